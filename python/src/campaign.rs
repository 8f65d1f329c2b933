//! The runs of a campaign, some of which each process makes.

use std::path::PathBuf;
use std::sync::Arc;

use arrow_array::{ArrayRef, Float64Array, Int64Array};
use cohaptic_campaign::{CampaignError, CampaignPlan, Format, Kind, PlanSpec, Row, SpreadCampaign, Value, Variation, Watch};
use cohaptic_scene::schema::FileSchema;
use pyo3::prelude::*;
use pyo3::types::PyList;

use crate::errors::{of_scene, of_value};
use crate::interrupt::{Stop, interruptible, on_threads};
use crate::table::{Table, names};

/// A campaign that was checked, any runs of which can be made in any process.
#[pyclass(frozen, module = "cohaptic._native")]
#[derive(Debug)]
pub(crate) struct Campaign {
    campaign: SpreadCampaign,
    /// Ends what is being computed, in whatever thread.
    stop: Stop,
}

/// Ends with either.
struct Either<'a>(&'a Stop, &'a Stop);

impl Watch for Either<'_> {
    fn keep_going(&self) -> bool {
        !(self.0.is_asked() || self.1.is_asked())
    }
}

fn refused(py: Python<'_>, error: &CampaignError) -> PyErr {
    match error {
        CampaignError::Scene { error, .. } => of_scene(py, error),
        error => of_value(error),
    }
}

#[pymethods]
impl Campaign {
    /// Keys are varied as by `cohaptic campaign --vary`. Without a roster, all combinations are checked.
    #[new]
    #[pyo3(signature = (text, file, overrides, vary, runs, threads, roster = None))]
    fn new(
        py: Python<'_>,
        text: &str,
        file: PathBuf,
        overrides: Vec<String>,
        vary: Vec<String>,
        runs: u64,
        threads: usize,
        roster: Option<&str>,
    ) -> PyResult<Self> {
        let variations = vary.iter().map(|text| Variation::parse(text)).collect::<Result<_, _>>().map_err(|error| of_value(&error))?;
        let program = concat!("cohaptic ", env!("CARGO_PKG_VERSION"));
        let spec = PlanSpec { text, file: &file, set: &overrides, variations, runs, format: Format::Csv, part: None, program };
        let plan = CampaignPlan::new(spec).map_err(|error| refused(py, &error))?;
        let campaign = match roster {
            Some(roster) => SpreadCampaign::with_roster(plan, roster),
            None => on_threads(py, threads, |stop| SpreadCampaign::check(plan, stop))?,
        };
        Ok(Self { campaign: campaign.map_err(|error| refused(py, &error))?, stop: Stop::default() })
    }

    /// How many runs there are.
    #[getter]
    fn runs(&self) -> u64 {
        self.campaign.runs()
    }

    /// Everybody who takes part, for the same campaign in another process.
    #[getter]
    fn roster(&self) -> String {
        self.campaign.roster()
    }

    /// The rows of the runs from one number up to another, on this thread.
    #[pyo3(signature = (start: "int", end: "int") -> "list[list[int | float | str | None]]")]
    fn rows<'py>(&self, py: Python<'py>, start: u64, end: u64) -> PyResult<Bound<'py, PyList>> {
        let rows = interruptible(py, |stop| self.campaign.rows(start..end, &Either(stop, &self.stop)))?.map_err(|error| refused(py, &error))?;
        let cell = |value: &Value| {
            Ok(match value {
                Value::Absent => py.None().into_bound(py),
                Value::Integer(count) => count.into_pyobject(py)?.into_any(),
                Value::Number(number) => number.into_pyobject(py)?.into_any(),
                Value::Text(text) => text.as_ref().into_pyobject(py)?.into_any(),
            })
        };
        let rows = rows.iter().map(|row: &Row| PyList::new(py, row.iter().map(cell).collect::<PyResult<Vec<_>>>()?));
        PyList::new(py, rows.collect::<PyResult<Vec<_>>>()?)
    }

    /// Ends every computation of rows, now and later.
    fn stop(&self) {
        self.stop.ask();
    }

    /// The rows of all runs as one table. The column of a key that was varied has the name of the key, and the unit of its values.
    #[pyo3(signature = (rows: "list[list[int | float | str | None]]") -> "Table")]
    fn table(&self, rows: Vec<Vec<Bound<'_, PyAny>>>) -> PyResult<Table> {
        let variations = self.campaign.variations();
        let columns = self.campaign.columns().iter().enumerate().map(|(place, column)| {
            let cells = || rows.iter().map(move |row| &row[place]);
            let array: ArrayRef = match column.kind {
                Kind::Integer => Arc::new(cells().map(|cell| cell.extract::<i64>()).collect::<PyResult<Vec<i64>>>().map(Int64Array::from)?),
                Kind::Number => {
                    let number = |cell: &Bound<'_, PyAny>| cell.extract::<Option<f64>>().map(|number| number.unwrap_or(f64::NAN));
                    Arc::new(cells().map(number).collect::<PyResult<Vec<f64>>>().map(Float64Array::from)?)
                }
                Kind::Text => {
                    let texts = cells().map(|cell| cell.extract::<Option<String>>().map(Option::unwrap_or_default));
                    coded(texts.collect::<PyResult<Vec<String>>>()?)
                }
            };
            let varied = variations.iter().find(|varied| varied.column() == column.name);
            Ok((varied.map_or_else(|| column.name.clone(), |varied| varied.key().to_owned()), array))
        });
        let unit =
            |name: &str| variations.iter().find(|varied| varied.key() == name).map(|varied| unit_of(varied.key(), varied.unit())).unwrap_or_default();
        Table::with_units(columns.collect::<PyResult<Vec<_>>>()?, unit)
    }
}

/// The unit of values of a key: the one that all of them carry, or the one in which the key takes plain numbers; empty if there is none.
pub(crate) fn unit_of(key: &str, carried: &str) -> String {
    if carried.is_empty() { FileSchema::Scene.unit_of(key) } else { carried }.to_owned()
}

/// Texts, each of which is kept once, in the order of their first appearance.
fn coded(texts: Vec<String>) -> ArrayRef {
    let mut known: Vec<String> = Vec::new();
    let codes = texts.into_iter().map(|text| {
        let place = known.iter().position(|known| *known == text).unwrap_or_else(|| {
            known.push(text);
            known.len() - 1
        });
        i32::try_from(place).unwrap_or(i32::MAX)
    });
    let codes = codes.collect();
    names(codes, known)
}
