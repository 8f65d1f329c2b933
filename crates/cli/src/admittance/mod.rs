//! `cohaptic admittance`: computes how a peer's hand feels the coupled system, frequency by frequency.
//!
//! This module reads the arguments, chooses the frequencies and writes the answer; `curve` computes, `files` writes the files of `--out`.

mod curve;
mod files;

use std::process::ExitCode;

use cohaptic_answers::admittance::Curve;
use cohaptic_units::print::{Counted, Number};

use crate::analysis_watch::AnalysisWatch;
use crate::arguments::AdmittanceArguments;
use crate::document_schema::DocumentSchema;
use crate::failure::Failure;
use crate::file::own_folder;
use crate::{input, output};

/// Computes the admittance of a peer for the scene and for each `--curve`, and writes the answer.
///
/// An interrupted analysis still answers with the points finished so far; the returned failure then gives their number.
pub(crate) fn admittance(arguments: &AdmittanceArguments) -> Result<ExitCode, Failure> {
    // The text is read before the analysis, which may take long, so that the page shows the scene that was analysed.
    let text = input::text(&arguments.scene.scene)?;
    let watch = AnalysisWatch::new(arguments.memory);
    let subjects = curve::subjects(arguments, &watch);
    if subjects.is_err() {
        watch.clear();
    }
    let subjects = subjects?;
    // All curves have the same frequencies, so that no frequency may exceed the limit of the peer with the slowest ticks.
    let highest = subjects.iter().map(|subject| subject.admittance.highest_frequency()).fold(f64::INFINITY, f64::min);
    let frequencies = frequencies(arguments, highest)?;
    // The folder is locked until the command ends, so that no second command writes into the same folder.
    let _own = arguments.out.as_deref().map(own_folder).transpose()?;
    let curves = subjects.into_iter().map(|subject| subject.curve(&frequencies, &watch));
    let curves = curves.collect::<Result<Vec<Curve>, Failure>>();
    watch.clear();
    let curves: Vec<Curve> = curves?.into_iter().filter(|curve| !curve.response.points.is_empty()).collect();
    let finished = curves.iter().map(|curve| curve.response.points.len()).sum::<usize>();
    // The curve of the scene without changes comes in addition to the curves of `--curve`.
    let wanted = frequencies.len() * (1 + arguments.curve.len());
    let is_interrupted = finished < wanted;
    if curves.is_empty() {
        return Err(Failure::Interrupted(format!("none of {wanted} points was finished")));
    }
    // Files are written only after every curve has been computed without an error.
    let files = match &arguments.out {
        Some(folder) => files::write(folder, arguments, &text, &curves, !is_interrupted)?,
        None => Vec::new(),
    };
    output::answer(
        arguments.scene.json,
        DocumentSchema::ADMITTANCE,
        &cohaptic_answers::admittance::document(&arguments.peer, &curves, &files, is_interrupted),
        || cohaptic_answers::admittance::words(&arguments.peer, &curves),
        &files,
    )?;
    if is_interrupted {
        return Err(Failure::Interrupted(format!("these are the first {finished} of {wanted} points")));
    }
    Ok(ExitCode::SUCCESS)
}

/// Lowest frequency without `--from` \[Hz\].
const LOWEST: f64 = 0.01;
/// Highest frequency without `--to` \[Hz\], if the peer's ticks are fast enough.
const HIGHEST: f64 = 100.0;
/// Number of frequencies without `--points`.
const POINTS: usize = 60;
/// Largest accepted number of points: the table of a larger number could fill the memory of a small machine.
const MOST: usize = 1_000_000;

/// Returns the frequencies of `--at`, or frequencies evenly spaced on a logarithmic scale from `--from` to `--to` \[Hz\].
///
/// A frequency that is not above zero, or above `highest` \[Hz\], is an input failure.
fn frequencies(arguments: &AdmittanceArguments, highest: f64) -> Result<Vec<f64>, Failure> {
    if !arguments.at.is_empty() {
        return arguments.at.iter().map(|hz| checked("--at", *hz, highest)).collect();
    }
    let from = checked("--from", arguments.from.unwrap_or(LOWEST), highest)?;
    let to = checked("--to", arguments.to.unwrap_or_else(|| HIGHEST.min(highest)), highest)?;
    let points = arguments.points.map_or(POINTS, std::num::NonZeroUsize::get);
    if points == 1 || from >= to {
        return Err(Failure::Input(format!(
            "{} from {} Hz to {} Hz: expected at least 2, the first below the last; --at takes one alone",
            Counted(points, "frequency"),
            Number(from),
            Number(to)
        )));
    }
    if points > MOST {
        return Err(Failure::Input(format!("--points {points}: expected at most {MOST}")));
    }
    // `points` is at least 2 here, so that the divisor is at least 1.
    #[expect(clippy::cast_precision_loss, reason = "at most a million points")]
    let share = |place: usize| place as f64 / (points - 1) as f64;
    // The last frequency is `to` itself: rounding in the power could put the frequency above `highest`.
    let between = |place: usize| if place + 1 == points { to } else { from * (to / from).powf(share(place)) };
    Ok((0..points).map(between).collect())
}

/// Returns `hz` if the frequency is above zero and at most `highest` \[Hz\].
fn checked(option: &str, hz: f64, highest: f64) -> Result<f64, Failure> {
    if hz > 0.0 && hz <= highest {
        return Ok(hz);
    }
    Err(Failure::Input(format!(
        "{option} {}: expected a frequency above 0 and at most {} Hz, half the rate of the peer's ticks",
        Number(hz),
        Number(highest)
    )))
}
