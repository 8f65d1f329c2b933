//! `cohaptic inverse3 probe`: exchanges messages without force, and reports what the service says of the device.

use std::process::ExitCode;
use std::time::Duration;

use cohaptic_inverse3::client::Snapshot;
use serde::Serialize;

use super::answer::{self, Exchanges, Identity, Seen};
use super::bench::{self, End, PERIOD, Task};
use crate::arguments::Inverse3ProbeArguments;
use crate::device_text::{Triple, block};
use crate::document_schema::DocumentSchema;
use crate::failure::{Failure, INPUT_OUTPUT, INTERRUPTED};
use crate::output;

#[derive(Serialize)]
struct ProbeDocument {
    #[serde(flatten)]
    identity: Identity,
    ending: &'static str,
    #[serde(flatten)]
    seen: Option<Seen>,
    exchanges: Exchanges,
}

/// Probes the device, and answers with the facts. A service without the device is a failure with the facts as answer.
pub(super) fn probe(arguments: &Inverse3ProbeArguments) -> Result<ExitCode, Failure> {
    let mut looking = Looking(None);
    let (end, summary) = bench::run(&arguments.which, 0.0, Some(arguments.length), &mut looking)?;
    let document = ProbeDocument {
        identity: Identity::of(&summary, arguments.which.simulated),
        ending: end.name(),
        seen: looking.0.as_ref().map(Seen::of),
        exchanges: Exchanges::of(&summary.report, PERIOD),
    };
    let describe = || {
        let mut lines = document.identity.lines();
        lines.extend(looking.0.iter().flat_map(answer::seen));
        if summary.report.readings > 0 {
            lines.extend(document.exchanges.lines());
        }
        block(&document.identity.name(), &lines)
    };
    output::answer(arguments.which.json, DocumentSchema::INVERSE3_PROBE, &document, describe, output::NO_FILES)?;
    Ok(ExitCode::from(match end {
        End::Interrupted => INTERRUPTED,
        End::Over if summary.report.readings > 0 => 0,
        End::Over | End::Failed => INPUT_OUTPUT,
    }))
}

/// The task of `probe`: asks for no force, and keeps the last state before the stop.
struct Looking(Option<Snapshot>);

impl Task for Looking {
    fn wants(&self, _snapshot: &Snapshot) -> Option<Triple> {
        None
    }

    fn look(&mut self, _at: Duration, snapshot: &Snapshot) -> Result<(), Failure> {
        self.0 = Some(*snapshot);
        Ok(())
    }
}
