//! Admittances.

use cohaptic_answers::{AdmittanceCurve, admittance_picture};
use cohaptic_picture::Picture;
use cohaptic_stability::{Admittance, AdmittanceError, Estimate, PushedAxis};
use numpy::IntoPyArray;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::drawing::Drawing;
use crate::errors::of_analysis;
use crate::interrupt::interruptible;
use crate::scene::Scene;

fn axis(word: Option<&str>) -> PyResult<Option<PushedAxis>> {
    let unknown = |word: &str| PyValueError::new_err(format!("no axis \"{word}\": expected x, y, z, rx, ry or rz"));
    word.map(|word| PushedAxis::ALL.into_iter().find(|axis| axis.word() == word).ok_or_else(|| unknown(word))).transpose()
}

/// Returns the admittance of a peer as a mapping: at frequencies \[Hz\], or at the frequencies that a function returns for the highest valid
/// frequency.
#[pyfunction]
#[pyo3(signature = (scene: "Scene", peer: "str", frequencies: "list[float] | typing.Callable[[float], list[float]]", axis: "str | None", seen: "str | None") -> "dict[str, typing.Any]")]
#[pyo3(name = "admittance")]
pub(crate) fn admittance_of<'py>(
    py: Python<'py>,
    scene: &Scene,
    peer: &str,
    frequencies: Bound<'py, PyAny>,
    axis: Option<&str>,
    seen: Option<&str>,
) -> PyResult<Bound<'py, PyDict>> {
    let axes = (self::axis(axis)?, self::axis(seen)?);
    let unknown = || PyValueError::new_err(format!("no peer \"{peer}\": expected one of scene.peers"));
    let place = scene.scene.peer_index(peer).ok_or_else(unknown)?;
    let refused = |error: AdmittanceError| of_analysis(py, &error);
    let admittance = interruptible(py, |stop| Admittance::between_watched(&scene.scene, place, axes.0, axes.1, stop))?.map_err(refused)?;
    let frequencies = if frequencies.is_callable() { frequencies.call1((admittance.highest_frequency(),))? } else { frequencies };
    let frequencies: Vec<f64> = frequencies.extract()?;
    let (response, fit) = interruptible(py, |stop| (admittance.response_watched(&frequencies, stop), admittance.fit_low_frequency()))?;
    let response = response.map_err(refused)?;
    let points = &response.points;
    let said = PyDict::new(py);
    said.set_item("frequencies", frequencies.into_pyarray(py))?;
    said.set_item("values", points.iter().map(|point| point.value).collect::<Vec<_>>().into_pyarray(py))?;
    said.set_item("errors", points.iter().map(|point| point.error).collect::<Vec<_>>().into_pyarray(py))?;
    said.set_item("verdict", admittance.verdict().word())?;
    said.set_item("radius", admittance.radius().value)?;
    said.set_item("error", admittance.radius().error)?;
    let pair = |Estimate { value, error }: Estimate| (value, error);
    said.set_item("stiffness", pair(fit.stiffness))?;
    said.set_item("viscosity", pair(fit.viscosity))?;
    said.set_item("inertia", pair(fit.inertia))?;
    said.set_item("object_mass", admittance.object_mass())?;
    said.set_item("notes", admittance.notes().to_vec())?;
    let (title, peer, law) = (scene.scene.title.clone(), peer.to_owned(), scene.scene.coordination.strategy.name());
    let drawing = Drawing::of(move || {
        let curve = AdmittanceCurve { name: law, admittance: &admittance, response: &response };
        // The same frequencies had a response above, so there is no error here.
        admittance_picture(&title, &peer, &[curve]).unwrap_or_else(|_| Picture::new(title.as_str()))
    });
    said.set_item("drawing", drawing)?;
    Ok(said)
}
