//! `cohaptic falcon probe`: opens every Falcon in turn, exchanges packets without force, and reports the state of each device.

use std::process::ExitCode;
use std::time::Duration;

use cohaptic_falcon::boot::Firmware;
use cohaptic_falcon::driver::{DriverConfig, Status};
use cohaptic_falcon::kinematics::Triple;
use cohaptic_falcon::safety::Limits;
use serde::Serialize;

use super::answer;
use super::answer::{Identity, Seen, Traffic};
use super::bench::{Bench, End, Go, Task};
use super::reach::{self, FirmwareState, Target};
use crate::arguments::ProbeArguments;
use crate::document_schema::DocumentSchema;
use crate::failure::{Failure, INPUT_OUTPUT, INTERRUPTED};
use crate::{interrupt, output};

/// Configuration of a driver that limits every force to 0 N.
pub(super) const WITHOUT_FORCE: DriverConfig = DriverConfig { limits: Limits { force: 0.0, ..Limits::DEFAULT }, ..DriverConfig::DEFAULT };

#[derive(Serialize)]
struct ProbeDocument {
    falcons: Vec<Entry>,
}

/// Result of the probe of one Falcon. An obstacle ends the probe of the device; the fields of later steps are then empty.
#[derive(Serialize)]
struct Entry {
    #[serde(flatten)]
    identity: Identity,
    opened: bool,
    firmware: Option<&'static str>,
    #[serde(flatten)]
    answered: Option<Answered>,
    /// The obstacle, in words; `None` if the probe is complete.
    error: Option<String>,
    /// Name of the device in texts for people.
    #[serde(skip)]
    name: String,
}

/// Statistics and last state of an answering device.
#[derive(Serialize)]
struct Answered {
    #[serde(flatten)]
    traffic: Traffic,
    #[serde(flatten)]
    seen: Seen,
}

/// Probes the selected Falcons in turn, and answers with the results of all.
pub(super) fn probe(arguments: &ProbeArguments) -> Result<ExitCode, Failure> {
    let firmware = reach::read_firmware(arguments.which.firmware.as_deref())?;
    let targets = reach::targets(&arguments.which)?;
    let mut falcons = Vec::new();
    for target in &targets {
        // During an exchange the bench itself looks for an interruption.
        if !interrupt::requested() {
            falcons.push(Entry::of(target, firmware.as_ref(), arguments.length)?);
        }
    }
    // An interruption leaves out the remaining devices; the answer still has the results of the devices before the interruption.
    let document = ProbeDocument { falcons };
    output::answer(
        arguments.which.json,
        DocumentSchema::FALCON_PROBE,
        &document,
        || document.falcons.iter().map(Entry::describe).collect::<String>(),
        output::NO_FILES,
    )?;
    let is_whole = document.falcons.iter().all(|entry| entry.error.is_none());
    Ok(ExitCode::from(if interrupt::requested() {
        INTERRUPTED
    } else if is_whole {
        0
    } else {
        INPUT_OUTPUT
    }))
}

impl Entry {
    fn of(target: &Target, firmware: Option<&Firmware>, length: Duration) -> Result<Self, Failure> {
        let mut entry = Self { identity: Identity::of(target), opened: false, firmware: None, answered: None, error: None, name: target.name() };
        // Each step may fail. The entry then keeps the results of the steps before, and the error.
        let mut way = match target.open() {
            Ok(way) => way,
            Err(error) => return Ok(Self { error: Some(error.to_string()), ..entry }),
        };
        entry.opened = true;
        match reach::make_ready(&mut way, firmware) {
            Ok(state) => entry.firmware = Some(state.name()),
            Err(error) => return Ok(Self { error: Some(error), ..entry }),
        }
        let mut bench = match Bench::open(way, WITHOUT_FORCE) {
            Ok(bench) => bench,
            Err(error) => return Ok(Self { error: Some(error.to_string()), ..entry }),
        };
        let mut looking = Looking { seen: None, until: Duration::ZERO };
        let end = bench.run(Some(length), &mut looking)?;
        if let End::Failed(error) = end {
            entry.error = Some(error.to_string());
        }
        // Without a single exchange there is no state to show.
        entry.answered = looking.seen.map(|seen| Answered { traffic: Traffic::of(&bench, looking.until), seen });
        Ok(entry)
    }

    fn describe(&self) -> String {
        let mut lines = Vec::new();
        lines.push(if self.opened { "it may be opened" } else { "it cannot be opened" }.to_owned());
        lines.extend(self.firmware.map(|firmware| {
            if firmware == FirmwareState::Loaded.name() { "its firmware was loaded just now" } else { "its firmware runs" }.to_owned()
        }));
        if let Some(Answered { traffic, seen }) = &self.answered {
            lines.extend(answer::traffic(traffic));
            lines.extend(answer::seen(seen));
        }
        lines.extend(self.error.as_ref().map(|error| format!("ERROR: {error}")));
        answer::block(&self.name, &lines)
    }
}

/// The task of `probe`: asks for no force, and keeps the state after the last exchange.
struct Looking {
    /// State after the last exchange; `None` before the first.
    seen: Option<Seen>,
    /// Time from the first exchange to the end of the last.
    until: Duration,
}

impl Task for Looking {
    fn wants(&mut self, _at: Duration, _status: &Status) -> Option<Triple> {
        None
    }

    fn look(&mut self, at: Duration, status: &Status) -> Result<Go, Failure> {
        (self.seen, self.until) = (Some(Seen::of(status)), at);
        Ok(Go::On)
    }
}
