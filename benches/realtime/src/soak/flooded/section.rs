//! The section of the page.

use std::fmt::Write as _;

use cohaptic_units::print::Span;

use super::{FloodedPlan, Outcome, PROCESSES, Row};
use crate::machine;

/// The heading of the section. It stands at the end of its page.
pub const HEADING: &str = "## Under floods\n";

/// At most this many rows are shown: the looks of a soak of ten minutes are 600.
const ROWS: usize = 20;

/// Writes the section: what ran, the verdicts as given, what the floods came to, and memory over time.
///
/// # Errors
///
/// None but those of writing to a text, which do not happen.
pub fn section(plan: &FloodedPlan, outcome: &Outcome, verdicts: &[String], command: &str, date: &str) -> Result<String, std::fmt::Error> {
    let mut text = format!("{HEADING}\n");
    writeln!(
        text,
        "`cohaptic live` with two simulated Falcons and a peer with a key, which comes through `cohaptic relay`, for {}, while each port of both programs is flooded.\n\
         Written by `{command}` and measured on: {}; {date}.\n",
        Span(plan.duration),
        machine::name()
    )?;
    if !plan.priority {
        writeln!(text, "The programs did not ask for priority.\n")?;
    }
    for line in verdicts {
        writeln!(text, "{line}")?;
    }
    writeln!(text, "\n| flood | datagrams/s |\n| --- | ---: |")?;
    for (name, sent) in &outcome.floods {
        writeln!(text, "| {name} | {:.0} |", sent.per_second())?;
    }
    let connections = outcome.connections;
    writeln!(
        text,
        "\nBeside them {} connections to live control of both programs: without a token, with 300 bytes that are no request, and such as say nothing.\n",
        connections.made
    )?;
    writeln!(text, "| after | {} |", PROCESSES.map(|name| format!("{name}: memory \\[kB\\], files")).join(" | "))?;
    writeln!(text, "| ---: |{}", " ---: |".repeat(PROCESSES.len()))?;
    for row in outcome.rows.iter().step_by(outcome.rows.len().div_ceil(ROWS).max(1)) {
        writeln!(text, "{}", line(row))?;
    }
    Ok(text)
}

/// Returns the samples of one instant as a row of the table.
fn line(row: &Row) -> String {
    let seconds = row.at.as_secs();
    let processes = row.processes.map(|process| format!("{}, {}", process.memory, process.files));
    format!("| {}:{:02} | {} |", seconds / 60, seconds % 60, processes.join(" | "))
}

impl std::fmt::Display for Row {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&line(self))
    }
}
