//! NumPy arrays over memory of Rust.

use numpy::ndarray::{Array2, ArrayView1};
use numpy::{Element, IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;

/// Returns a read-only array over numbers, without a copy. `owner` keeps the numbers alive and never changes them.
pub(crate) fn view<'py, T: Element>(owner: Bound<'py, PyAny>, numbers: &[T]) -> PyResult<Bound<'py, PyArray1<T>>> {
    let numbers = ArrayView1::from(numbers);
    // SAFETY: the callers' numbers lie in reference-counted buffers of a frozen object, which are never reallocated or written to; the array holds a
    // reference to that object for as long as it lives.
    #[expect(unsafe_code, reason = "NumPy knows no lifetimes")]
    let array = unsafe { PyArray1::borrow_from_array(&numbers, owner) };
    read_only(array.as_any())?;
    Ok(array)
}

fn read_only(array: &Bound<'_, PyAny>) -> PyResult<()> {
    let keywords = pyo3::types::PyDict::new(array.py());
    keywords.set_item("write", false)?;
    array.call_method("setflags", (), Some(&keywords)).map(drop)
}

/// Returns rows of equal length as an array that owns the numbers.
pub(crate) fn matrix<T: Element>(py: Python<'_>, rows: usize, columns: usize, numbers: Vec<T>) -> PyResult<Bound<'_, PyArray2<T>>> {
    Array2::from_shape_vec((rows, columns), numbers).map(|array| array.into_pyarray(py)).map_err(|error| crate::errors::of_value(&error))
}
