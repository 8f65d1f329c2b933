//! Measures the cost and the error of methods.

use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use cohaptic_stability::{AnalysisError, Radius, Watch, analyse_watched};

use super::runs::{Trajectory, unwatched};
use super::{Kind, Method, Work};
use crate::verdict::OPERATIONS_A_SECOND;

/// Time spent on the cost of a method; the first round is always run.
const BUDGET: Duration = Duration::from_millis(50);
/// Greatest number of rounds of a method. The median of 31 rounds is steady.
const MOST_ROUNDS: usize = 31;
/// Time after which further methods get no figures: in scenes of thousands of peers a run takes seconds.
const MOST_TIME: Duration = Duration::from_secs(6);
/// Greatest number of operations of a measured analysis, by the estimate of the analysis: about a second.
const MOST_OPERATIONS: f64 = OPERATIONS_A_SECOND;

/// Observer of a measurement, which can also stop the measurement.
pub trait MeasurementWatch: Sync {
    /// Called before a method is measured.
    fn begins(&self, _method: &Method) {}

    /// Returns `true` if the current method takes too long. Called often.
    fn is_late(&self) -> bool {
        false
    }

    /// Returns `true` if the measurement must stop. Called often.
    fn stops(&self) -> bool {
        false
    }
}

/// Methods with their measured costs and errors.
#[derive(Clone, PartialEq, Debug)]
pub struct Measured {
    /// Simulated span of the runs.
    pub span: Duration,
    /// The methods, kind by kind.
    pub methods: Vec<MeasuredMethod>,
    /// `true` if the watch stopped the measurement. Some kinds are missing then.
    pub interrupted: bool,
}

/// A method with cost and error on the scene.
#[derive(Clone, PartialEq, Debug)]
pub struct MeasuredMethod {
    /// Purpose of the method.
    pub kind: Kind,
    /// Name of the method, unique within its kind.
    pub name: String,
    /// Option of the method on the command line; empty for the default.
    pub option: String,
    /// `true` if the scene as it stands uses this method.
    pub chosen: bool,
    /// Processor time per simulated second, or of one analysis \[ms\], the median of some rounds. `None` if the method does not apply; the note then gives the reason.
    pub cost_ms: Option<f64>,
    /// Largest difference from the reference, in [`Kind::error_unit`]. The error is computed, and the same every time. `None` if there is no such number; the
    /// note then gives the reason.
    pub error: Option<f64>,
    /// Name of the method used as the reference; `None` without an error.
    pub reference: Option<String>,
    /// Remark for the reader; may be empty.
    pub note: String,
}

/// Measures the methods, kind by kind. `clock` returns the processor time used so far.
pub fn measure(methods: &[Method], clock: &dyn Fn() -> Duration, watch: &dyn MeasurementWatch) -> Measured {
    let span = methods.iter().find_map(|method| match &method.work {
        Ok(Work::Run(run)) => Some(run.span()),
        Ok(Work::Analysis { .. }) | Err(_) => None,
    });
    let mut measured = Measured { span: span.unwrap_or_default(), methods: Vec::new(), interrupted: false };
    // Measured once for all kinds: `MOST_TIME` bounds the runs of the whole list.
    let begin = clock();
    for kind in Kind::ALL {
        let of_kind: Vec<&Method> = methods.iter().filter(|method| method.kind == kind).collect();
        let Some(rows) = of_one_kind(&of_kind, begin, clock, watch) else {
            measured.interrupted = true;
            break;
        };
        measured.methods.extend(rows);
    }
    measured
}

/// Result of a method, compared with the result of the reference.
enum Outcome {
    Trajectory(Trajectory),
    Radius(Radius),
}

/// Returns the rows of a kind; `None` if the watch stopped the measurement.
fn of_one_kind(methods: &[&Method], begin: Duration, clock: &dyn Fn() -> Duration, watch: &dyn MeasurementWatch) -> Option<Vec<MeasuredMethod>> {
    let mut outcomes = Vec::new();
    for method in methods {
        watch.begins(method);
        outcomes.push(match &method.work {
            // The limit does not apply to analyses, which have a limit of their own.
            Ok(Work::Run(_)) if clock().saturating_sub(begin) > MOST_TIME => Err("not measured: the methods before took too long".to_owned()),
            Ok(work) => outcome(work, watch)?,
            Err(why) => Err(why.clone()),
        });
    }
    let costs = costs(methods, &outcomes, clock, watch)?;
    let is_had = |place: &usize| outcomes[*place].is_ok();
    let named = (0..methods.len()).find(|place| methods[*place].is_reference).filter(is_had);
    // If the reference does not apply, the first applicable method of the kind becomes the reference. A kind without a reference has no errors.
    let reference = named.or_else(|| methods.iter().any(|method| method.is_reference).then(|| (0..methods.len()).find(is_had)).flatten());
    let row = |(place, method): (usize, &&Method)| {
        let (error, note) = match (&outcomes[place], reference.map(|place| &outcomes[place])) {
            (Err(why), _) => (None, why.clone()),
            (Ok(_), None) => (None, "other random numbers, so that positions differ by chance".to_owned()),
            (Ok(own), Some(Ok(other))) => error(own, other, method.turns()),
            (Ok(_), Some(Err(why))) => (None, why.clone()),
        };
        MeasuredMethod {
            kind: method.kind,
            name: method.name.clone(),
            option: method.option.clone(),
            chosen: method.chosen,
            cost_ms: costs[place],
            error,
            reference: error.and(reference).map(|place| methods[place].name.clone()),
            note,
        }
    };
    Some(methods.iter().enumerate().map(row).collect())
}

/// Does the work of a method once. Returns the result, or the reason for a missing result; `None` if the watch stopped the measurement.
fn outcome(work: &Work, watch: &dyn MeasurementWatch) -> Option<Result<Outcome, String>> {
    match work {
        Work::Run(run) => Trajectory::of(run, &|| watch.stops()).map(|trajectory| Ok(Outcome::Trajectory(trajectory))),
        Work::Analysis { scene, method } => {
            let limited = Limited { watch, expected: Mutex::new(0.0), is_first: true };
            match analyse_watched(scene, *method, &limited) {
                Ok(analysis) => Some(Ok(Outcome::Radius(analysis.radius))),
                Err(AnalysisError::Stopped) if watch.stops() => None,
                Err(AnalysisError::Stopped) if limited.expected() <= MOST_OPERATIONS => Some(Err("too long to be measured here".to_owned())),
                Err(AnalysisError::Stopped) => {
                    let seconds = limited.expected() / OPERATIONS_A_SECOND;
                    Some(Err(format!("takes about {seconds:.0} s, too long to be measured here")))
                }
                Err(error) => Some(Err(error.to_string())),
            }
        }
    }
}

/// Returns the error of a result, and a note about the error.
fn error(own: &Outcome, reference: &Outcome, turns: bool) -> (Option<f64>, String) {
    match (own, reference) {
        (Outcome::Trajectory(own), Outcome::Trajectory(reference)) => match own.difference(reference) {
            Ok(difference) => (Some(difference), if turns { "of positions alone: turns are not compared" } else { "" }.to_owned()),
            Err(why) => (None, why),
        },
        (Outcome::Radius(own), Outcome::Radius(reference)) => {
            let error = Some((own.value - reference.value).abs()).filter(|error| error.is_finite());
            (error, format!("radius {:.12} +- {:.1e}", own.value, own.error))
        }
        (Outcome::Trajectory(_), Outcome::Radius(_)) | (Outcome::Radius(_), Outcome::Trajectory(_)) => {
            unreachable!("methods of one kind do the same work")
        }
    }
}

/// Returns the cost of each method \[ms\]; `None` for a method without a result. The outer `None` means that the watch stopped the measurement.
///
/// The methods take turns, so that a disturbance of the machine affects all methods. The caches are warm, because each method has already run once for the
/// result.
fn costs(
    methods: &[&Method],
    outcomes: &[Result<Outcome, String>],
    clock: &dyn Fn() -> Duration,
    watch: &dyn MeasurementWatch,
) -> Option<Vec<Option<f64>>> {
    let mut times = vec![Vec::new(); methods.len()];
    for _ in 0..MOST_ROUNDS {
        for ((method, outcome), times) in methods.iter().zip(outcomes).zip(&mut times) {
            let (Ok(work), Ok(_)) = (&method.work, outcome) else { continue };
            // A cheap method gets more rounds: the median of short times needs more of them.
            if times.iter().sum::<Duration>() < BUDGET {
                let start = clock();
                once(work, watch)?;
                times.push(clock().saturating_sub(start));
            }
        }
    }
    let cost = |(method, mut times): (&&Method, Vec<Duration>)| {
        times.sort();
        // An odd number of rounds is not guaranteed, so the upper of two middle rounds counts.
        let median = times.get(times.len() / 2)?.as_secs_f64();
        let units = match &method.work {
            Ok(Work::Run(run)) => run.span().as_secs_f64(),
            Ok(Work::Analysis { .. }) | Err(_) => 1.0,
        };
        Some(1e3 * median / units)
    };
    Some(methods.iter().zip(times).map(cost).collect())
}

/// Does the work of a method once, as a user would; `None` if the watch stopped the measurement.
fn once(work: &Work, watch: &dyn MeasurementWatch) -> Option<()> {
    match work {
        Work::Run(run) => drop(std::hint::black_box(unwatched(run, &|| watch.stops())?)),
        Work::Analysis { scene, method } => {
            let limited = Limited { watch, expected: Mutex::new(0.0), is_first: false };
            // The same analysis has succeeded before, so an error now means that the watch stopped the analysis.
            drop(std::hint::black_box(analyse_watched(scene, *method, &limited).ok()?));
        }
    }
    if watch.stops() { None } else { Some(()) }
}

/// Watch of an analysis. Stops the analysis if the estimate exceeds [`MOST_OPERATIONS`], if the first analysis of a method takes too long, or if the
/// measurement must stop.
struct Limited<'a> {
    watch: &'a dyn MeasurementWatch,
    /// Estimate of the analysis so far \[operations\].
    expected: Mutex<f64>,
    /// `true` if this is the first analysis of a method. Later analyses are never late, because the first was not.
    is_first: bool,
}

impl Limited<'_> {
    fn expected(&self) -> f64 {
        *self.expected.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Watch for Limited<'_> {
    fn expects(&self, operations: f64) {
        *self.expected.lock().unwrap_or_else(PoisonError::into_inner) += operations;
    }

    fn stops(&self) -> bool {
        self.expected() > MOST_OPERATIONS || self.is_first && self.watch.is_late() || self.watch.stops()
    }
}
