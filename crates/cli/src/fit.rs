//! `cohaptic fit`: estimates the parameters of a link from measurements.

use std::path::Path;
use std::process::ExitCode;

use cohaptic_answers::fit::{Corrections, FitFailure, Source, SourceError};
use cohaptic_files::MOST_BYTES;
use cohaptic_measure::fit::FitError;

use crate::arguments::FitArguments;
use crate::document_schema::DocumentSchema;
use crate::failure::{EXPECTATION, Failure};
use crate::file::write_file;
use crate::{file, output};

/// Estimates a link and prints the estimate. With `--out`, also writes the link into a file, unless `--require-law` is given and no law fits the delays.
pub(crate) fn fit(arguments: &FitArguments) -> Result<ExitCode, Failure> {
    let source = read(arguments)?;
    let out = arguments.out.as_deref().unwrap_or_else(|| Path::new("link.toml"));
    // The delays stand beside the file with the link, so that a scene in that folder finds both files.
    let delays_file = out.with_extension("delays.csv");
    let delays_name = delays_file.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let corrections = Corrections { offset_s: arguments.offset, least: arguments.least, skew: arguments.skew };
    let answered = source.fit(&corrections, out, &delays_name).map_err(|error| failure(&arguments.file, error))?;
    let law_is_missing = arguments.require_law && answered.delays.is_some();
    let mut written: Vec<&Path> = Vec::new();
    if arguments.out.is_some() && !law_is_missing {
        // The delays are written first, so that the file with the link never names a file that does not exist.
        if let Some(csv) = &answered.delays {
            write_file(&delays_file, csv)?;
            written.push(&delays_file);
        }
        write_file(out, &answered.scene)?;
        written.push(out);
    }
    let document = cohaptic_answers::fit::document(&answered);
    output::answer(arguments.json, DocumentSchema::FIT, &document, || cohaptic_answers::fit::words(&answered), written)?;
    Ok(if law_is_missing { ExitCode::from(EXPECTATION) } else { ExitCode::SUCCESS })
}

/// Advice on the options that help if the clocks of sender and receiver differ.
const CLOCKS: &str = "--offset TIME adds a time to the clock of the receiver, --least TIME says what the least delay is";

/// Converts an error of the estimate into a failure that names the options that may help.
fn failure(file: &Path, error: FitFailure) -> Failure {
    let named = |why: String| Failure::Input(format!("{}: {why}", output::path(file)));
    match error {
        FitFailure::LongDelays { .. } => named(format!("{error} {CLOCKS}; with --offset 0s the delays are taken as they are")),
        FitFailure::Fit(FitError::NegativeDelay { .. }) => named(format!("{error}: {CLOCKS}")),
        FitFailure::Measurements(_) | FitFailure::Fit(_) => named(error.to_string()),
        FitFailure::Scene(error) => Failure::Scene(*error),
        FitFailure::Unheld(why) => Failure::Input(why),
    }
}

fn read(arguments: &FitArguments) -> Result<Source, Failure> {
    let path = &arguments.file;
    if let Some(receiver) = &arguments.receiver {
        return Source::between(file::open_large(path)?, file::open_large(receiver)?, arguments.port)
            .map_err(|error| Failure::Input(format!("{}, {}: {error}", output::path(path), output::path(receiver))));
    }
    let named = |why: &dyn std::fmt::Display| Failure::Input(format!("{}: {why}", output::path(path)));
    Source::read(file::open_large(path)?, |rest| rest.limited_to(MOST_BYTES)).map_err(|error| match error {
        SourceError::Io(error) => Failure::File { verb: "read", path: path.clone(), error },
        SourceError::NotText { line } => file::not_text(path, line),
        SourceError::OneEnd => {
            named(&format!("{error}: cohaptic fit SENDER RECEIVER (of what `cohaptic link` did, give the file of --fates instead)"))
        }
        SourceError::Content(why) => named(&why),
    })
}
