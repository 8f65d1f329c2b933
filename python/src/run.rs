//! A run and what it left behind.

use cohaptic_harness::measures::Measures;
use cohaptic_harness::record::Pictures;
use cohaptic_harness::{Observer, Simulation, Summary};
use cohaptic_picture::Size;
use cohaptic_units::Instant;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::errors::of_scene;
use crate::interrupt::{Stop, interruptible};
use crate::law::Laws;
use crate::record::{Packets, Trajectory, links};
use crate::scene::{Scene, json, model};
use crate::table::Table;

/// Run with its summary and the kept rows.
#[pyclass(frozen, module = "cohaptic._native")]
#[derive(Debug)]
pub(crate) struct Run {
    title: String,
    summary: Summary,
    document: String,
    trajectory: Option<Py<Table>>,
    packets: Option<Py<Table>>,
    pictures: Option<Pictures>,
}

/// Observer that ends a run if the user asks for the end, or if a law has failed.
struct Asked<'a> {
    stop: &'a Stop,
    laws: Option<&'a Laws>,
}

impl Observer for Asked<'_> {
    type Error = std::convert::Infallible;

    fn keep_going(&mut self, _now: Instant) -> bool {
        !(self.stop.is_asked() || self.laws.is_some_and(Laws::has_failed))
    }
}

#[pymethods]
impl Run {
    /// Runs a scene. `law`: function that makes the coordination law of each peer; `None` for the law of the scene.
    #[new]
    #[pyo3(signature = (scene: "Scene", threads: "int", general: "bool", trajectory: "bool", packets: "bool", law: "typing.Any | None" = None))]
    fn run(
        py: Python<'_>,
        scene: &Scene,
        threads: usize,
        general: bool,
        trajectory: bool,
        packets: bool,
        law: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let laws = law.map(|law| Laws::new(&law, &scene.scene)).transpose()?;
        let measures = Measures::of(&scene.scene);
        let watched = trajectory || packets || measures.is_some() || laws.is_some();
        scene.refuse_too_large(model(general), watched).map_err(|error| of_scene(py, &error))?;
        let (summary, ((kept_ticks, kept_packets), (pictures, measures))) = interruptible(py, |stop| {
            let recorded = (trajectory.then(|| Trajectory::new(&scene.scene)), packets.then(|| Packets::new(&scene.scene)));
            // A picture shows both.
            let pictures = (trajectory && packets).then(|| Pictures::new(&scene.scene));
            let mut observer = ((recorded, (pictures, measures)), Asked { stop, laws: laws.as_ref() });
            let Ok(summary) = match &laws {
                None => Simulation::new(&scene.scene, model(general)).on_threads(threads.max(1)).run(&mut observer),
                Some(laws) => Laws::attached(|| Simulation::with_strategies(&scene.scene, model(general), laws).run(&mut observer)),
            };
            (summary, observer.0)
        })?;
        if let Some(laws) = &laws {
            laws.raise(py)?;
        }
        let measured = measures.as_ref().map(|measures| measures.values(summary.duration)).unwrap_or_default();
        let task = measures.and_then(|measures| measures.task(&summary));
        let document = json(&cohaptic_answers::run(&scene.scene, &summary, &measured, task.as_ref(), None));
        let table = |table: PyResult<Table>| Py::new(py, table?);
        let trajectory = kept_ticks.map(|ticks| table(ticks.table())).transpose()?;
        let packets = kept_packets.map(|packets| table(packets.table())).transpose()?;
        Ok(Self { title: scene.scene.title.clone(), summary, document, trajectory, packets, pictures })
    }

    #[getter]
    fn title(&self) -> &str {
        &self.title
    }

    /// Document of the run as JSON.
    #[getter]
    fn summary(&self) -> &str {
        &self.document
    }

    #[getter]
    fn trajectory(&self, py: Python<'_>) -> Option<Py<Table>> {
        self.trajectory.as_ref().map(|table| table.clone_ref(py))
    }

    #[getter]
    fn packets(&self, py: Python<'_>) -> Option<Py<Table>> {
        self.packets.as_ref().map(|table| table.clone_ref(py))
    }

    fn links(&self) -> PyResult<Table> {
        links(&self.summary)
    }

    /// Returns the picture with the file name `file` as SVG.
    fn picture(&self, py: Python<'_>, file: &str) -> PyResult<String> {
        let pictures = self.pictures.as_ref().ok_or_else(|| PyValueError::new_err("no pictures: expected a run with record=True"))?;
        let drawn = py.detach(|| pictures.drawn(Size::default()));
        let names: Vec<&str> = drawn.iter().map(|(name, _)| name.trim_end_matches(".svg")).collect();
        let unknown = || PyValueError::new_err(format!("no picture \"{file}\": expected one of {}", names.join(", ")));
        let found = names.iter().position(|name| *name == file).ok_or_else(unknown)?;
        Ok(drawn[found].1.clone())
    }
}
