//! Tables: columns that NumPy and Arrow share.

use std::sync::Arc;

use arrow_array::cast::AsArray;
use arrow_array::ffi_stream::FFI_ArrowArrayStream;
use arrow_array::types::{Float64Type, Int32Type, Int64Type, UInt64Type};
use arrow_array::{Array, ArrayRef, DictionaryArray, Int32Array, RecordBatch, RecordBatchIterator, StringArray};
use arrow_schema::ffi::FFI_ArrowSchema;
use arrow_schema::{DataType, Field, Schema};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::PyCapsule;

use crate::arrays::view;
use crate::errors::of_value;

/// Key of the unit in the metadata of a field.
const UNIT: &str = "unit";

/// Columns of equal length. NumPy arrays are views of the memory that Arrow gets.
#[pyclass(frozen, module = "cohaptic._native")]
#[derive(Debug)]
pub(crate) struct Table {
    batch: RecordBatch,
}

/// Column of names. Each different name is stored once.
pub(crate) fn names(codes: Vec<i32>, names: impl IntoIterator<Item = String>) -> ArrayRef {
    let names = StringArray::from_iter_values(names);
    // Codes are places in the names.
    let array = DictionaryArray::<Int32Type>::try_new(Int32Array::from(codes), Arc::new(names));
    Arc::new(array.unwrap_or_else(|error| unreachable!("codes of names: {error}")))
}

impl Table {
    /// Returns a table of columns of equal length, with their names.
    pub(crate) fn new(columns: Vec<(String, ArrayRef)>) -> PyResult<Self> {
        Self::with_units(columns, |_| String::new())
    }

    /// Returns a table of columns of equal length, with their names and units. `unit` returns the unit of a name, empty for a column without a unit. Arrow
    /// gets the unit as metadata of the field.
    pub(crate) fn with_units(columns: Vec<(String, ArrayRef)>, unit: impl Fn(&str) -> String) -> PyResult<Self> {
        let field = |(name, column): &(String, ArrayRef)| {
            let field = Field::new(name, column.data_type().clone(), column.null_count() > 0);
            let unit = unit(name);
            if unit.is_empty() { field } else { field.with_metadata([(UNIT.to_owned(), unit)]) }
        };
        let schema = Arc::new(Schema::new(columns.iter().map(field).collect::<Vec<_>>()));
        let columns = columns.into_iter().map(|(_, column)| column).collect();
        Ok(Self { batch: RecordBatch::try_new(schema, columns).map_err(|error| of_value(&error))? })
    }

    fn find(&self, name: &str) -> PyResult<&ArrayRef> {
        self.batch.column_by_name(name).ok_or_else(|| PyKeyError::new_err(name.to_owned()))
    }
}

#[pymethods]
impl Table {
    /// Names of the columns.
    #[getter]
    fn names(&self) -> Vec<String> {
        self.batch.schema().fields().iter().map(|field| field.name().clone()).collect()
    }

    fn __len__(&self) -> usize {
        self.batch.num_rows()
    }

    /// Returns the unit of a column; empty for a column without a unit.
    fn unit(&self, name: &str) -> PyResult<String> {
        self.find(name)?;
        let schema = self.batch.schema();
        Ok(schema.field_with_name(name).ok().and_then(|field| field.metadata().get(UNIT).cloned()).unwrap_or_default())
    }

    /// Returns the numbers of a column without a copy; for a column of names, the codes of the names.
    #[pyo3(signature = (name: "str") -> "numpy.ndarray")]
    fn column<'py>(slf: &Bound<'py, Self>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let array = slf.get().find(name)?;
        let owner = slf.clone().into_any();
        Ok(match array.data_type() {
            DataType::Float64 => view(owner, array.as_primitive::<Float64Type>().values())?.into_any(),
            DataType::Int64 => view(owner, array.as_primitive::<Int64Type>().values())?.into_any(),
            DataType::UInt64 => view(owner, array.as_primitive::<UInt64Type>().values())?.into_any(),
            DataType::Dictionary(_, _) => view(owner, array.as_dictionary::<Int32Type>().keys().values())?.into_any(),
            other => return Err(of_value(&format!("no array of {other}"))),
        })
    }

    /// Returns the names for which the codes of a column stand; `None` for a column of numbers.
    fn categories(&self, name: &str) -> PyResult<Option<Vec<String>>> {
        let array = self.find(name)?;
        let strings = matches!(array.data_type(), DataType::Dictionary(_, _)).then(|| array.as_dictionary::<Int32Type>().values());
        Ok(strings.map(|strings| strings.as_string::<i32>().iter().map(|name| name.unwrap_or_default().to_owned()).collect()))
    }

    /// Returns the address of the numbers of a column.
    fn address(&self, name: &str) -> PyResult<usize> {
        let data = self.find(name)?.to_data();
        Ok(data.buffers().first().map_or(0, |buffer| buffer.as_ptr().addr()))
    }

    /// Returns the schema, by the Arrow PyCapsule protocol.
    #[pyo3(signature = () -> "typing.Any")]
    fn __arrow_c_schema__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyCapsule>> {
        let schema = FFI_ArrowSchema::try_from(self.batch.schema().as_ref()).map_err(|error| of_value(&error))?;
        PyCapsule::new_with_value(py, schema, c"arrow_schema")
    }

    /// Returns the rows, by the Arrow PyCapsule protocol.
    #[pyo3(signature = (requested_schema: "typing.Any | None" = None) -> "typing.Any")]
    fn __arrow_c_stream__<'py>(&self, py: Python<'py>, requested_schema: Option<Bound<'py, PyAny>>) -> PyResult<Bound<'py, PyCapsule>> {
        // A producer may leave a requested schema unheeded.
        drop(requested_schema);
        let reader = RecordBatchIterator::new([Ok(self.batch.clone())], self.batch.schema());
        PyCapsule::new_with_value(py, FFI_ArrowArrayStream::new(Box::new(reader)), c"arrow_array_stream")
    }
}
