//! `cohaptic relay`.

mod conduct;
mod document;
mod setup;
mod status;
mod words;

use std::process::ExitCode;
use std::sync::mpsc::channel;

use cohaptic_realtime::udp::EndpointConfig;
use cohaptic_relay::{Relay, RelayError, RunOptions};

use crate::arguments::RelayArguments;
use crate::document_schema::DocumentSchema;
use crate::failure::{Failure, INTERRUPTED};
use crate::realtime::{KeyedLinks, LiveControl, say, some_length};
use crate::{interrupt, output};
use document::RelayDocument;
use setup::Setup;

/// Puts the emulator between programs, and says what it did.
pub(crate) fn relay(arguments: &RelayArguments) -> Result<ExitCode, Failure> {
    let length = some_length(arguments.length)?;
    let mut setup = Setup::new(arguments)?;
    let relay = Relay::bind(setup.config.clone(), EndpointConfig::default()).map_err(failure)?;
    setup.opened(relay.ports()).iter().for_each(|line| say(line));
    let (changes, wanted) = channel();
    let editor = KeyedLinks { keys: std::mem::take(&mut setup.keys), folder: setup.folder.clone(), changes };
    let control = LiveControl::open(&arguments.real_time, status::description(&setup), Box::new(editor))?;
    let options = RunOptions {
        pacing: arguments.real_time.pacing(),
        wishes: arguments.real_time.wishes(),
        tolerance: setup.tolerance,
        duration: length,
        ..RunOptions::default()
    };
    let (report, edits) = conduct::conduct(relay, &setup, &options, &control, &wanted)?;
    let asked = setup.asked(&edits, report.elapsed);
    let is_interrupted = interrupt::requested();
    if arguments.json {
        output::json(DocumentSchema::RELAY, &RelayDocument::new(&setup, &report, &asked, is_interrupted))?;
    } else {
        output::text(&words::describe(&setup, &report, &asked))?;
    }
    Ok(if is_interrupted { ExitCode::from(INTERRUPTED) } else { ExitCode::SUCCESS })
}

fn failure(error: RelayError) -> Failure {
    if matches!(error, RelayError::Config(_)) { Failure::Input(error.to_string()) } else { Failure::System(error.to_string()) }
}
