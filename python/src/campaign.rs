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

/// A campaign or a comparison that was checked, any runs of which can be made in any process.
#[pyclass(frozen, module = "cohaptic._native")]
#[derive(Debug)]
pub(crate) struct Campaign {
    campaign: SpreadCampaign,
    is_comparison: bool,
    /// Ends what is being computed, in whatever thread.
    stop: Stop,
}

/// What all runs of a campaign or of a comparison come to.
#[pyclass(frozen, module = "cohaptic._native")]
#[derive(Debug)]
pub(crate) struct CampaignAnswer {
    table: Py<Table>,
    document: String,
    /// `None` for a comparison.
    finished: Option<campaign::Finished>,
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

/// The keys that are varied: the strategies before the others, if strategies are compared.
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
    /// Keys are varied as by `cohaptic campaign --vary`. With strategies it is a comparison of these, as by `cohaptic compare --strategies`. Without a roster, all
    /// combinations are checked.
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

    /// What the rows of all runs come to. Combinations are judged on that number of threads, 0 for one a core: those of a comparison always, those of a campaign with
    /// `verdicts`.
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
    /// The title of the scene of the first combination that is run.
    fn title(&self, refused: &Refused) -> Result<String, CampaignError> {
        let plan = self.campaign.plan();
        let first = (0..plan.combinations()).find(|combination| !refused.contains_key(combination)).unwrap_or_default();
        Ok(plan.scene(first)?.title)
    }

    fn finished(&self, rows: &[Row], judgements: Vec<Judgement>) -> Result<(String, campaign::Finished), CampaignError> {
        let report = self.campaign.report(rows, judgements)?;
        let (title, notes) = (self.title(&report.refused)?, campaign::notes(&report));
        let mut finished = campaign::Finished { plan: self.campaign.plan().clone(), title, report, notes };
        // What cannot be drawn is said, as by the program.
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

    /// As JSON.
    #[getter]
    fn summary(&self) -> &str {
        &self.document
    }

    /// The picture of that file name as SVG.
    fn picture(&self, py: Python<'_>, file: &str) -> PyResult<String> {
        let drawn = self.finished.as_ref().map(|finished| py.detach(|| campaign::pictures(finished, Size::default()))).unwrap_or_default();
        let names: Vec<&str> = drawn.pictures.iter().map(|(name, _)| name.trim_end_matches(".svg")).collect();
        let expected = if names.is_empty() { "none, because no key has several values that are drawn".to_owned() } else { names.join(" or ") };
        let unknown = || PyValueError::new_err(format!("no picture \"{file}\": expected {expected}"));
        let found = names.iter().position(|name| *name == file).ok_or_else(unknown)?;
        Ok(drawn.pictures[found].1.svg())
    }
}
