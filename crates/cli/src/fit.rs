//! `cohaptic fit`: estimates the parameters of a link from measurements.

use std::path::Path;
use std::process::ExitCode;

use cohaptic_answers::fit::{Corrections, FitFailure, ReadAs, Source, SourceError, Tick};
use cohaptic_files::MOST_BYTES;
use cohaptic_measure::fit::FitError;

use crate::arguments::FitArguments;
use crate::document_schema::DocumentSchema;
use crate::failure::{EXPECTATION, Failure};
use crate::file::write_file;
use crate::{file, output};

/// Estimates a link, or takes the link recorded by a file, and prints the link. With `--out`, also writes the link into a file, unless `--require-law` is given
/// and no law fits the delays.
pub(crate) fn fit(arguments: &FitArguments) -> Result<ExitCode, Failure> {
    let source = read(arguments)?;
    let out = arguments.out.as_deref().unwrap_or_else(|| Path::new("link.toml"));
    let tick = arguments.tick.map(|tick| if arguments.cut { Tick::Cut(tick) } else { Tick::Rounded(tick) });
    let corrections = Corrections { offset_s: arguments.offset, least: arguments.least, skew: arguments.skew, tick, hold_out: arguments.hold_out };
    let answered = source.fit(&corrections, out).map_err(|error| failure(&arguments.file, error))?;
    let law_is_missing = arguments.require_law && !answered.has_law;
    let mut written: Vec<&Path> = Vec::new();
    if arguments.out.is_some() && !law_is_missing {
        // The file beside the link is written first, so that the link never names a file that does not exist.
        if let Some(beside) = &answered.beside {
            write_file(&beside.path, &beside.content)?;
            written.push(&beside.path);
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
    let read_as = ReadAs { direction: arguments.direction.map(Into::into), split: arguments.split, bytes: arguments.bytes, walk: arguments.walk };
    // A log is read line by line and may be long. Every other file is read as a whole, and gets the lower limit.
    Source::read(file::open_large(path)?, |rest| rest.limited_to(MOST_BYTES), &read_as).map_err(|error| match error {
        SourceError::Io(error) => Failure::File { verb: "read", path: path.clone(), error },
        SourceError::NotText { line } => file::not_text(path, line),
        SourceError::OneEnd => {
            named(&format!("{error}: cohaptic fit SENDER RECEIVER (of what `cohaptic link` did, give the file of --fates instead)"))
        }
        SourceError::Content(why) => named(&why),
    })
}
