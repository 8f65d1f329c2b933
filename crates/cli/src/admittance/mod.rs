//! `cohaptic admittance`.

mod bode;
mod curve;
mod document;
mod files;
mod frequencies;
mod words;

use std::process::ExitCode;

use curve::Curve;
use document::Document;

use crate::arguments::AdmittanceArguments;
use crate::failure::Failure;
use crate::output;

/// Says what the hand of one peer feels.
pub(crate) fn admittance(arguments: &AdmittanceArguments) -> Result<ExitCode, Failure> {
    let subjects = curve::subjects(arguments)?;
    let highest = subjects.iter().map(|subject| subject.admittance.highest_frequency()).fold(f64::INFINITY, f64::min);
    let frequencies = frequencies::of(arguments, highest)?;
    let curves = subjects.into_iter().map(|subject| Curve::of(subject, &frequencies));
    let curves = curves.collect::<Result<Vec<Curve>, Failure>>()?;
    // Nothing is written before everything is known to be right.
    let files = match &arguments.out {
        Some(folder) => files::write(folder, &arguments.peer, &curves, arguments.pictures.size())?,
        None => Vec::new(),
    };
    if arguments.scene.json {
        output::json(&Document::new(&arguments.peer, &curves, &files))?;
    } else {
        output::text(&words::describe(&arguments.peer, &curves, &files))?;
    }
    Ok(ExitCode::SUCCESS)
}
