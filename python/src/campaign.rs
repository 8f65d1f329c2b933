//! The runs of a campaign or of a comparison, some of which each process makes.

use std::path::PathBuf;

use cohaptic_answers::{campaign, compare};
use cohaptic_campaign::{
    CampaignError, CampaignPlan, Format, Judgement, PlanSpec, Refused, Row, SpreadCampaign, Strategies, Value, Variation, Watch,
};
use cohaptic_picture::Size;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyList;

use crate::campaign_table::{table, value};
use crate::errors::{of_scene, of_value};
use crate::interrupt::{Stop, interruptible, on_threads};
use crate::scene::json;
use crate::table::Table;

/// Checked campaign or comparison. Any process can do any of the runs.
#[pyclass(frozen, module = "cohaptic._native")]
#[derive(Debug)]
pub(crate) struct Campaign {
    campaign: SpreadCampaign,
    is_comparison: bool,
    /// Mark that ends all computations, in every thread.
    stop: Stop,
}

/// Results of all runs of a campaign or of a comparison.
#[pyclass(frozen, module = "cohaptic._native")]
#[derive(Debug)]
pub(crate) struct CampaignAnswer {
    table: Py<Table>,
    document: String,
    /// Results for pictures; `None` for a comparison.
    finished: Option<campaign::Finished>,
}

/// Watch that ends a computation if one of two marks is set.
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

/// Returns the varied keys. If strategies are compared, their key comes first.
fn variations(vary: &[String], strategies: Option<&str>) -> PyResult<Vec<Variation>> {
    let strategies = strategies.map(Strategies::parse).transpose().map_err(|error| of_value(&error))?;
    let mut variations: Vec<Variation> = strategies.iter().map(Strategies::variation).collect();
    for text in vary {
        let variation = Variation::parse(text).map_err(|error| of_value(&error))?;
        if strategies.is_some() && variation.is_key(Strategies::KEY) {
            return Err(PyValueError::new_err(format!("{text}: the strategies are those that are compared: expected another key")));
        }
        variations.push(variation);
    }
    Ok(variations)
}

#[pymethods]
impl Campaign {
    /// Returns a campaign over keys as for `cohaptic campaign --vary`. With `strategies`, as for `cohaptic compare --strategies`, returns a comparison.
    /// Without a roster, all combinations are checked.
    #[new]
    #[pyo3(signature = (text, file, overrides, vary, runs, threads, strategies = None, roster = None))]
    fn new(
        py: Python<'_>,
        text: &str,
        file: PathBuf,
        mut overrides: Vec<String>,
        vary: Vec<String>,
        runs: u64,
        threads: usize,
        strategies: Option<&str>,
        roster: Option<&str>,
    ) -> PyResult<Self> {
        let variations = variations(&vary, strategies)?;
        let is_comparison = strategies.is_some();
        if is_comparison {
            overrides.push("measure.names=\"all\"".to_owned());
        }
        let program = concat!("cohaptic ", env!("CARGO_PKG_VERSION"));
        let spec = PlanSpec { text, file: &file, set: &overrides, variations, runs, format: Format::Csv, part: None, program };
        let plan = CampaignPlan::new(spec).map_err(|error| refused(py, &error))?;
        let plan = if is_comparison { plan.leaving_out(Strategies::fallback()) } else { plan };
        let campaign = match roster {
            Some(roster) => SpreadCampaign::with_roster(plan, roster),
            None => on_threads(py, threads, |stop| SpreadCampaign::check(plan, stop))?,
        };
        Ok(Self { campaign: campaign.map_err(|error| refused(py, &error))?, is_comparison, stop: Stop::default() })
    }

    /// Number of runs.
    #[getter]
    fn runs(&self) -> u64 {
        self.campaign.runs()
    }

    /// Peers of all runs and left out combinations as a text, for the same campaign in another process.
    #[getter]
    fn roster(&self) -> String {
        self.campaign.roster()
    }

    /// Returns the rows of the runs from `start` to before `end`, computed on this thread.
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

    /// Ends all computations of rows, running and later ones.
    fn stop(&self) {
        self.stop.ask();
    }

    /// Returns the results of the rows of all runs. The combinations of a comparison are judged, and with `verdicts` the combinations of a campaign. `threads`:
    /// number of threads for the judgement, 0 for one per core.
    #[pyo3(signature = (rows: "list[list[int | float | str | None]]", verdicts: "bool", threads: "int") -> "CampaignAnswer")]
    fn answer(&self, py: Python<'_>, rows: Vec<Vec<Bound<'_, PyAny>>>, verdicts: bool, threads: usize) -> PyResult<CampaignAnswer> {
        let columns = self.campaign.columns();
        let row = |row: &Vec<Bound<'_, PyAny>>| row.iter().zip(columns).map(|(cell, column)| value(cell, column)).collect();
        let rows = rows.iter().map(row).collect::<PyResult<Vec<Row>>>()?;
        let failed = |error: CampaignError| refused(py, &error);
        let judgements = match (self.is_comparison, verdicts) {
            (true, _) => on_threads(py, threads, |stop| self.campaign.judge(&compare::ByAnalysisOrRuns(stop), stop))?.map_err(failed)?,
            (false, true) => on_threads(py, threads, |stop| self.campaign.judge(&campaign::ByAnalysis(stop), stop))?.map_err(failed)?,
            (false, false) => Vec::new(),
        };
        let judged = if self.is_comparison { &[] } else { judgements.as_slice() };
        let table = Py::new(py, table(&self.campaign, &rows, judged)?)?;
        if self.is_comparison {
            let document = py.detach(|| self.comparison(&rows, judgements)).map_err(failed)?;
            return Ok(CampaignAnswer { table, document, finished: None });
        }
        let (document, finished) = py.detach(|| self.finished(&rows, judgements)).map_err(failed)?;
        Ok(CampaignAnswer { table, document, finished: Some(finished) })
    }
}

impl Campaign {
    /// Returns the title of the scene of the first accepted combination.
    fn title(&self, refused: &Refused) -> Result<String, CampaignError> {
        let plan = self.campaign.plan();
        let first = (0..plan.combinations()).find(|combination| !refused.contains_key(combination)).unwrap_or_default();
        Ok(plan.scene(first)?.title)
    }

    fn finished(&self, rows: &[Row], judgements: Vec<Judgement>) -> Result<(String, campaign::Finished), CampaignError> {
        let report = self.campaign.report(rows, judgements)?;
        let (title, notes) = (self.title(&report.refused)?, campaign::notes(&report));
        let mut finished = campaign::Finished { plan: self.campaign.plan().clone(), title, report, notes };
        // The notes name pictures that cannot be drawn, as the notes of the program do.
        finished.notes.extend(campaign::pictures(&finished, Size::default()).notes);
        let document = json(&campaign::document(&finished, None));
        Ok((document, finished))
    }

    fn comparison(&self, rows: &[Row], stability: Vec<Judgement>) -> Result<String, CampaignError> {
        let report = self.campaign.report(rows, Vec::new())?;
        let (title, comparison) = (self.title(&report.refused)?, self.campaign.compare(rows)?);
        let finished = compare::Finished { plan: self.campaign.plan().clone(), title, report, comparison, stability };
        Ok(json(&compare::document(&finished, None)))
    }
}

#[pymethods]
impl CampaignAnswer {
    #[getter]
    fn table(&self, py: Python<'_>) -> Py<Table> {
        self.table.clone_ref(py)
    }

    /// Document of the runs as JSON.
    #[getter]
    fn summary(&self) -> &str {
        &self.document
    }

    /// Returns the picture with the file name `file` as SVG.
    fn picture(&self, py: Python<'_>, file: &str) -> PyResult<String> {
        let drawn = self.finished.as_ref().map(|finished| py.detach(|| campaign::pictures(finished, Size::default()))).unwrap_or_default();
        let names: Vec<&str> = drawn.pictures.iter().map(|(name, _)| name.trim_end_matches(".svg")).collect();
        let expected = if names.is_empty() { "none, because no key has several values that are drawn".to_owned() } else { names.join(" or ") };
        let unknown = || PyValueError::new_err(format!("no picture \"{file}\": expected {expected}"));
        let found = names.iter().position(|name| *name == file).ok_or_else(unknown)?;
        Ok(drawn.pictures[found].1.svg())
    }
}
