//! Coordination laws that are written in Python.

use std::sync::{Arc, Mutex, PoisonError};

use cohaptic_harness::Strategies;
use cohaptic_peer::{Command, Context, Gains, Strategy};
use cohaptic_scene::Scene;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::matrix;

/// First exception that a law raised.
type Failure = Arc<Mutex<Option<PyErr>>>;

/// Maker of the laws: calls a Python function for the law of each peer.
#[derive(Debug)]
pub(crate) struct Laws {
    make: Py<PyAny>,
    peer: Py<PyAny>,
    failure: Failure,
}

impl Laws {
    pub(crate) fn new(make: &Bound<'_, PyAny>, scene: &Scene) -> PyResult<Self> {
        if scene.rotation.is_some() {
            return Err(PyValueError::new_err("a law in Python moves objects that do not turn: expected a scene without object.inertia"));
        }
        if !make.is_callable() {
            return Err(PyValueError::new_err("a law is made for each peer: expected a class, or another callable that takes the peer"));
        }
        let peer = make.py().import("cohaptic.law")?.getattr("Peer")?.unbind();
        Ok(Self { make: make.clone().unbind(), peer, failure: Failure::default() })
    }

    pub(crate) fn has_failed(&self) -> bool {
        self.failure().is_some()
    }

    /// Raises the first exception of a law.
    pub(crate) fn raise(&self, _py: Python<'_>) -> PyResult<()> {
        self.failure().take().map_or(Ok(()), Err)
    }

    fn failure(&self) -> std::sync::MutexGuard<'_, Option<PyErr>> {
        self.failure.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Keeps the interpreter attached during `work`, because `work` calls laws all the time.
    pub(crate) fn attached<T>(work: impl FnOnce() -> T) -> T {
        Python::attach(|_| work())
    }

    fn made(&self, py: Python<'_>, scene: &Scene, place: usize) -> PyResult<Law> {
        let gains = scene.coordination.gains.scaled(scene.coordination_factor(place));
        let spec = &scene.peers[place];
        let keywords = PyDict::new(py);
        keywords.set_item("name", &spec.name)?;
        keywords.set_item("place", place)?;
        keywords.set_item("others", scene.peers.len() - 1)?;
        keywords.set_item("axes", scene.axes.count())?;
        keywords.set_item("stiffness", gains.stiffness)?;
        keywords.set_item("damping", gains.damping)?;
        keywords.set_item("tick", spec.clock.tick.as_secs_f64())?;
        keywords.set_item("update", scene.coordination.update.as_secs_f64())?;
        let peer = self.peer.bind(py).call((), Some(&keywords))?;
        let law = self.make.bind(py).call1((peer,))?;
        let command = law.getattr(intern!(py, "command"))?.unbind();
        let remembers = law.hasattr(intern!(py, "memory"))?;
        let takes_gains = law.hasattr(intern!(py, "set_gains"))?;
        let memory = if remembers { numbers(&law.getattr(intern!(py, "memory"))?)? } else { Vec::new() };
        Ok(Law { law: law.unbind(), command, remembers, takes_gains, memory, failure: Arc::clone(&self.failure) })
    }
}

impl Strategies for &Laws {
    type Strategy<const A: usize> = PeerLaw;

    fn strategy<const A: usize>(&self, scene: &Scene, peer: usize) -> PeerLaw {
        PeerLaw(Python::attach(|py| self.made(py, scene, peer).map_err(|error| keep(&self.failure, error)).ok()))
    }
}

/// Stores an exception, unless an earlier one is stored.
fn keep(failure: &Failure, error: PyErr) {
    failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
}

/// Law of one peer; `None` if the Python function raised an exception, which ends the run.
#[derive(Debug)]
pub(crate) struct PeerLaw(Option<Law>);

#[derive(Debug)]
struct Law {
    law: Py<PyAny>,
    /// Method `command` of the law.
    command: Py<PyAny>,
    remembers: bool,
    takes_gains: bool,
    memory: Vec<f64>,
    failure: Failure,
}

impl Law {
    fn force<const A: usize>(&mut self, py: Python<'_>, context: &Context<'_, A>) -> PyResult<[f64; A]> {
        let own = State::of(py, context.own)?;
        let held = Bound::new(py, Held::of(py, context.held)?)?;
        let answer = self.command.bind(py).call1((own, held, context.now.as_secs_f64()))?;
        let force = vector::<A>(&answer)?;
        if self.remembers {
            self.memory = numbers(&self.law.bind(py).getattr(intern!(py, "memory"))?)?;
        }
        Ok(force)
    }

    /// Calls `act`, and stores an exception that `act` raises.
    fn with(&mut self, act: impl FnOnce(&mut Self, Python<'_>) -> PyResult<()>) {
        Python::attach(|py| {
            if let Err(error) = act(self, py) {
                keep(&self.failure, error);
            }
        });
    }
}

impl<const A: usize> Strategy<A> for PeerLaw {
    fn command(&mut self, context: &Context<'_, A>) -> Command<A> {
        let mut force = [0.0; A];
        if let Some(law) = &mut self.0 {
            law.with(|law, py| {
                force = law.force(py, context)?;
                Ok(())
            });
        }
        Command { force, target: *context.held.mean() }
    }

    fn set_gains(&mut self, gains: Gains) {
        if let Some(law) = self.0.as_mut().filter(|law| law.takes_gains) {
            law.with(|law, py| law.law.bind(py).call_method1(intern!(py, "set_gains"), (gains.stiffness, gains.damping)).map(drop));
        }
    }

    fn memory(&self) -> &[f64] {
        self.0.as_ref().map_or(&[], |law| &law.memory)
    }

    fn set_memory(&mut self, memory: &[f64]) {
        if let Some(law) = self.0.as_mut().filter(|law| law.remembers) {
            law.memory = memory.to_vec();
            law.with(|law, py| law.law.bind(py).setattr(intern!(py, "memory"), PyArray1::from_slice(py, memory)));
        }
    }
}

/// Returns the numbers of a Python value, one for each axis. For one axis, a plain number is accepted too.
fn vector<const A: usize>(answer: &Bound<'_, PyAny>) -> PyResult<[f64; A]> {
    let found = numbers(answer)?;
    let count = found.len();
    <[f64; A]>::try_from(found).map_err(|_| PyValueError::new_err(format!("a force of {count} numbers: expected one for each of {A} axes")))
}

/// Returns the numbers of an array, of a list, or of a plain number.
fn numbers(value: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    if let Ok(array) = value.cast::<PyArray1<f64>>() {
        return array.readonly().to_vec().map_err(Into::into);
    }
    value.extract::<f64>().map(|number| vec![number]).or_else(|_| value.extract::<Vec<f64>>())
}

/// Position and velocity of a copy along each axis.
#[pyclass(frozen, module = "cohaptic._native")]
#[derive(Debug)]
pub(crate) struct State {
    position: Py<PyArray1<f64>>,
    velocity: Py<PyArray1<f64>>,
}

impl State {
    fn of<'py, const A: usize>(py: Python<'py>, state: &cohaptic_peer::State<A>) -> PyResult<Bound<'py, Self>> {
        let array = |numbers: &[f64; A]| PyArray1::from_slice(py, numbers).unbind();
        Bound::new(py, Self { position: array(&state.position), velocity: array(&state.velocity) })
    }
}

#[pymethods]
impl State {
    /// Position \[m\], a number for each axis.
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.position.bind(py).clone()
    }

    /// Velocity [m/s], a number for each axis.
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.velocity.bind(py).clone()
    }
}

/// Newest samples of the other peers.
#[pyclass(frozen, module = "cohaptic._native")]
#[derive(Debug)]
pub(crate) struct Held {
    mean: Py<State>,
    others: usize,
    axes: usize,
    /// Numbers of the samples, row after row.
    positions: Vec<f64>,
    velocities: Vec<f64>,
}

impl Held {
    fn of<const A: usize>(py: Python<'_>, held: &cohaptic_peer::Held<A>) -> PyResult<Self> {
        let states = || (0..held.len()).filter_map(|place| held.state(place));
        Ok(Self {
            mean: State::of(py, held.mean())?.unbind(),
            others: held.len(),
            axes: A,
            positions: states().flat_map(|state| state.position).collect(),
            velocities: states().flat_map(|state| state.velocity).collect(),
        })
    }
}

#[pymethods]
impl Held {
    /// Mean of the samples.
    #[getter]
    fn mean(&self, py: Python<'_>) -> Py<State> {
        self.mean.clone_ref(py)
    }

    fn __len__(&self) -> usize {
        self.others
    }

    /// Positions of the samples \[m\], a row for each other peer in the order of the scene.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, self.others, self.axes, self.positions.clone())
    }

    /// Velocities of the samples [m/s], a row for each other peer in the order of the scene.
    #[getter]
    fn velocities<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, self.others, self.axes, self.velocities.clone())
    }
}
