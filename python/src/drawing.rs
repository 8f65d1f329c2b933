//! Pictures that are drawn when somebody looks at them.

use std::fmt;

use cohaptic_picture::{Picture, Size};
use pyo3::prelude::*;
use pyo3::types::PyType;

/// Picture as SVG.
#[pyclass(frozen, module = "cohaptic._native")]
pub(crate) struct Drawing(Box<dyn Fn() -> String + Send + Sync>);

impl Drawing {
    pub(crate) fn of(draw: impl Fn() -> Picture + Send + Sync + 'static) -> Self {
        Self(Box::new(move || draw().size(Size::default()).svg()))
    }
}

impl fmt::Debug for Drawing {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        to.write_str("Drawing")
    }
}

#[pymethods]
impl Drawing {
    /// Returns a picture that is drawn already.
    #[new]
    fn drawn(svg: String) -> Self {
        Self(Box::new(move || svg.clone()))
    }

    /// Returns the whole text of the picture.
    fn svg(&self, py: Python<'_>) -> String {
        py.detach(|| (self.0)())
    }

    /// Pickles the drawn picture, for other processes.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> (Bound<'py, PyType>, (String,)) {
        (slf.get_type(), (slf.get().svg(slf.py()),))
    }
}
