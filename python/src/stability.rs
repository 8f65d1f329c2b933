//! Verdicts and monodromy matrices.

use cohaptic_answers::notes;
use cohaptic_stability::{
    AnalysisError, ContactMode, Judgement, Limits, Method, analyse_with, eigenvalues, judge_watched, left_out, monodromy, monodromy_with,
};
use num_complex::Complex64;
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::arrays::matrix;
use crate::errors::of_analysis;
use crate::interrupt::{Stop, interruptible};
use crate::law::Laws;
use crate::scene::Scene;

/// Matrix, names of the states as peer and kind, length of the frame \[s\], time by which velocities are multiplied \[s\], number of rigid-body modes, and
/// bound of the error.
type Matrix<'py> = (Bound<'py, PyArray2<f64>>, Vec<(String, String)>, f64, f64, usize, f64);

/// Returns the verdict on the scene as a mapping.
#[pyfunction]
#[pyo3(signature = (scene: "Scene", method: "str", law: "typing.Any | None" = None) -> "dict[str, typing.Any]")]
pub(crate) fn stability<'py>(py: Python<'py>, scene: &Scene, method: &str, law: Option<Bound<'py, PyAny>>) -> PyResult<Bound<'py, PyDict>> {
    let methods = [Method::Reduced, Method::Determinant, Method::Full];
    let unknown = || PyValueError::new_err(format!("no method \"{method}\": expected reduced, determinant or full"));
    let method = methods.into_iter().find(|known| known.word() == method).ok_or_else(unknown)?;
    let laws = law.map(|law| Laws::new(&law, &scene.scene)).transpose()?;
    let judged = interruptible(py, |stop| match &laws {
        None => judge_watched(&scene.scene, method, &Limits { watch: stop, ..Limits::of_unknowns(usize::MAX) }),
        Some(laws) => Laws::attached(|| analyse_with(&scene.scene, &laws)).map(|analysis| Judgement {
            verdict: analysis.verdict(),
            analysis,
            mean_square: None,
            left_out: left_out(&scene.scene),
        }),
    })?;
    if let Some(laws) = &laws {
        laws.raise(py)?;
    }
    document(py, scene, &judged.map_err(|error| of_analysis(py, &error))?)
}

/// Returns the monodromy matrix with the names of its states and further facts.
#[pyfunction]
#[pyo3(signature = (scene: "Scene", law: "typing.Any | None" = None) -> "tuple[numpy.ndarray, list[tuple[str, str]], float, float, int, float]")]
#[pyo3(name = "monodromy")]
pub(crate) fn monodromy_of<'py>(py: Python<'py>, scene: &Scene, law: Option<Bound<'py, PyAny>>) -> PyResult<Matrix<'py>> {
    let laws = law.map(|law| Laws::new(&law, &scene.scene)).transpose()?;
    let found = interruptible(py, |_: &Stop| match &laws {
        None => monodromy(&scene.scene),
        Some(laws) => Laws::attached(|| monodromy_with(&scene.scene, &laws)),
    })?;
    if let Some(laws) = &laws {
        laws.raise(py)?;
    }
    let found = found.map_err(|error: AnalysisError| of_analysis(py, &error))?;
    let (rows, columns) = (found.matrix.rows(), found.matrix.columns());
    let numbers = (0..rows).flat_map(|row| found.matrix.row(row).to_vec()).collect();
    let states = found.states.iter().map(|state| (scene.scene.peers[state.peer].name.clone(), state.kind.to_string())).collect();
    Ok((matrix(py, rows, columns, numbers)?, states, found.frame.as_secs_f64(), found.time, found.rigid_modes, found.error))
}

/// Returns the eigenvalues of a square matrix, in the order of decreasing modulus.
#[pyfunction]
#[pyo3(name = "eigenvalues", signature = (rows: "list[list[float]]") -> "numpy.ndarray")]
pub(crate) fn eigenvalues_of(py: Python<'_>, rows: Vec<Vec<f64>>) -> PyResult<Bound<'_, PyArray1<Complex64>>> {
    if rows.iter().any(|row| row.len() != rows.len()) {
        return Err(PyValueError::new_err("a matrix with eigenvalues is square"));
    }
    let found =
        interruptible(py, |_: &Stop| eigenvalues(&cohaptic_stability::Matrix::from_fn(rows.len(), rows.len(), |row, column| rows[row][column])))?;
    Ok(found.into_pyarray(py))
}

fn document<'py>(py: Python<'py>, scene: &Scene, judgement: &Judgement) -> PyResult<Bound<'py, PyDict>> {
    let Judgement { verdict, analysis, mean_square, left_out } = judgement;
    let said = PyDict::new(py);
    said.set_item("verdict", verdict.word())?;
    said.set_item("judged", judgement.kind().word())?;
    said.set_item("left_out", left_out)?;
    said.set_item("radius", analysis.radius.value)?;
    said.set_item("error", analysis.radius.error)?;
    said.set_item("mean_square", mean_square.as_ref().map(|moment| (moment.radius.value, moment.radius.error)))?;
    said.set_item("method", analysis.method.word())?;
    said.set_item("frame", analysis.frame.as_secs_f64())?;
    said.set_item("dimension", analysis.dimension)?;
    said.set_item("rigid_modes", analysis.rigid_modes)?;
    let modes = analysis.modes.iter().map(|mode| contact_mode(py, scene, mode)).collect::<PyResult<Vec<_>>>()?;
    said.set_item("modes", PyList::new(py, modes)?)?;
    said.set_item("notes", notes(judgement))?;
    Ok(said)
}

fn contact_mode<'py>(py: Python<'py>, scene: &Scene, mode: &ContactMode) -> PyResult<Bound<'py, PyDict>> {
    let said = PyDict::new(py);
    said.set_item("motion", &mode.motion)?;
    said.set_item("contacts", &mode.contacts)?;
    said.set_item("verdict", mode.radius.verdict().word())?;
    said.set_item("radius", mode.radius.value)?;
    said.set_item("error", mode.radius.error)?;
    let parts = mode.parts.iter().map(|part| {
        let said = PyDict::new(py);
        said.set_item("kind", part.kind.word())?;
        said.set_item("peer", part.kind.peer().map(|peer| scene.scene.peers[peer].name.clone()))?;
        said.set_item("dimension", part.size)?;
        said.set_item("multiplicity", part.copies)?;
        said.set_item("radius", part.radius.value)?;
        said.set_item("error", part.radius.error)?;
        Ok(said)
    });
    said.set_item("parts", PyList::new(py, parts.collect::<PyResult<Vec<_>>>()?)?)?;
    Ok(said)
}
