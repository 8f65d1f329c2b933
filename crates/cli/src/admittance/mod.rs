//! `cohaptic admittance`.

mod bode;
mod curve;
mod document;
mod files;
mod frequencies;
mod words;

use std::process::ExitCode;

use curve::Curve;
use document::AdmittanceDocument;

use crate::analysis_watch::AnalysisWatch;
use crate::arguments::AdmittanceArguments;
use crate::document_schema::DocumentSchema;
use crate::failure::Failure;
use crate::output;

/// Says what the hand of one peer feels.
pub(crate) fn admittance(arguments: &AdmittanceArguments) -> Result<ExitCode, Failure> {
    let watch = AnalysisWatch::new();
    let subjects = curve::subjects(arguments, &watch);
    if subjects.is_err() {
        watch.clear();
    }
    let subjects = subjects?;
    let highest = subjects.iter().map(|subject| subject.admittance.highest_frequency()).fold(f64::INFINITY, f64::min);
    let frequencies = frequencies::of(arguments, highest)?;
    let curves = subjects.into_iter().map(|subject| Curve::of(subject, &frequencies, &watch));
    let curves = curves.collect::<Result<Vec<Curve>, Failure>>();
    watch.clear();
    let curves: Vec<Curve> = curves?.into_iter().filter(|curve| !curve.response.points.is_empty()).collect();
    let finished = curves.iter().map(|curve| curve.response.points.len()).sum::<usize>();
    let wanted = frequencies.len() * (1 + arguments.curve.len());
    let is_interrupted = finished < wanted;
    if curves.is_empty() {
        return Err(Failure::Interrupted(format!("none of {wanted} points was finished")));
    }
    // Nothing is written before everything is known to be right.
    let files = match &arguments.out {
        Some(folder) => files::write(folder, &arguments.peer, &curves, !is_interrupted, arguments.pictures.size())?,
        None => Vec::new(),
    };
    output::answer(
        arguments.scene.json,
        DocumentSchema::ADMITTANCE,
        &AdmittanceDocument::new(&arguments.peer, &curves, &files, is_interrupted),
        || words::describe(&arguments.peer, &curves),
        &files,
    )?;
    if is_interrupted {
        return Err(Failure::Interrupted(format!("these are the first {finished} of {wanted} points")));
    }
    Ok(ExitCode::SUCCESS)
}
