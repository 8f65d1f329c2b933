//! Faults as exceptions of Python, which are the classes of `cohaptic.errors`.

use std::fmt::Display;

use cohaptic_scene::{Diagnostic, SceneError};
use pyo3::prelude::*;

const MODULE: &str = "cohaptic.errors";

/// Returns an exception of the class, or the exception of the import if the class cannot be imported.
fn exception(py: Python<'_>, class: &str, message: String) -> PyErr {
    let made = py.import(MODULE).and_then(|module| module.getattr(class)).and_then(|class| class.call1((message,)));
    made.map_or_else(|error| error, PyErr::from_value)
}

/// Returns the exception for a refused scene, link or key, with the place of the fault.
pub(crate) fn of_scene(py: Python<'_>, error: &SceneError) -> PyErr {
    let place = error.diagnostic();
    let file = place.and_then(Diagnostic::file).map(|file| file.display().to_string());
    let key = place.map(Diagnostic::key).filter(|key| !key.is_empty());
    let numbers = (place.map(Diagnostic::line), place.map(Diagnostic::column));
    let arguments = (
        error.to_string(),
        file,
        place.and_then(Diagnostic::override_text),
        numbers.0,
        numbers.1,
        key,
        place.map(Diagnostic::message),
        error.is_io(),
    );
    let made = py.import(MODULE).and_then(|module| module.getattr("_of_scene")).and_then(|make| make.call1(arguments));
    made.map_or_else(|error| error, PyErr::from_value)
}

/// Returns the exception for a scene that the analysis does not cover.
pub(crate) fn of_analysis(py: Python<'_>, error: &impl Display) -> PyErr {
    exception(py, "AnalysisError", error.to_string())
}

/// Returns the exception for measurements without a fitting link.
pub(crate) fn of_fault(py: Python<'_>, message: &str) -> PyErr {
    exception(py, "CohapticError", message.to_owned())
}

/// Returns the exception for a refused value.
pub(crate) fn of_value(error: &impl Display) -> PyErr {
    pyo3::exceptions::PyValueError::new_err(error.to_string())
}
