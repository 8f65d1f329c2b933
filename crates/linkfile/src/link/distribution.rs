//! Reader of the law of jitter, by name or from a file.

use std::sync::Arc;

use cohaptic_wan::Distribution;
use cohaptic_wan::law::{DistTable, DistTableError, Empirical, EmpiricalError};

use crate::document::{Node, quote};
use crate::link::keys::LINK_TABLE;
use crate::reading::named_file::{Fault, file_path, line_span, read_file};
use crate::reading::{Context, TableReader, only_one, values};

const EXPECTED: &str = "the name of a law, { table = \"file.dist\" } or { empirical = \"file.csv\" }";

/// Reads a law: a name, a table of tc (`.dist`) or a file of measured delays.
pub(super) fn read_distribution(node: &Node, context: Context<'_>) -> Option<Distribution> {
    if node.as_text().is_some() {
        return values::word(node, context, &Distribution::CHOICES);
    }
    let mut table = TableReader::new(node, context, LINK_TABLE.table("jitter.distribution"), EXPECTED)?;
    let files = [table.entry("table"), table.entry("empirical")];
    table.finish();
    let file = only_one(node, context, &files, EXPECTED)?;
    if file.name == "table" {
        let path = file_path(&file.node, context, "the name of a .dist file, relative to the folder of this file")?;
        return read_file(&file.node, context, &path, "dist", dist_table).map(Distribution::Table);
    }
    let path = file_path(&file.node, context, "the name of a CSV file, relative to the folder of this file")?;
    read_file(&file.node, context, &path, "delays", empirical).map(Distribution::Empirical)
}

/// Parses the text of a `.dist` file.
pub(super) fn dist_table(text: &str) -> Result<Arc<DistTable>, Fault> {
    DistTable::parse(text).map(Arc::new).map_err(|error| dist_fault(text, &error))
}

/// Returns the fault of a `.dist` file, with its line.
pub(super) fn dist_fault(text: &str, error: &DistTableError) -> Fault {
    let line = match error {
        DistTableError::NotAnInteger { line, .. } | DistTableError::OutOfRange { line, .. } | DistTableError::TooMany { line, .. } => Some(*line),
        DistTableError::Empty => None,
    };
    Fault::in_line(text, line, error)
}

/// Parses a file of measured delays: a header `delay`, then one delay \[s\] per line. Blank lines and lines that begin with # are skipped. The law has
/// nanoseconds.
fn empirical(text: &str) -> Result<Arc<Empirical>, Fault> {
    const DELAY: &str = "expected a delay in seconds from 0 to 9e9";
    // Lines are numbered before blank lines and comments are left out, so that a fault names the line of the file.
    let mut lines = (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty() && !line.trim_start().starts_with('#'));
    match lines.next() {
        Some((_, header)) if header.trim() == "delay" => {}
        Some((line, header)) => {
            let message = format!("the header is {}: expected delay, and one delay in seconds a line below", quote(header.trim()));
            return Err(Fault { span: line_span(text, line), message });
        }
        None => return Err(Fault { span: 0..0, message: "the file is empty: expected a header, delay, and rows".to_owned() }),
    }
    let mut delays = Vec::new();
    for (line, content) in lines {
        // The bound keeps every delay below 2⁶³ ns: the law has nanoseconds.
        let seconds = content.trim().parse::<f64>().ok().filter(|seconds| (0.0..=9e9).contains(seconds));
        let fault = || Fault { span: line_span(text, line), message: format!("{}: {DELAY}", quote(content.trim())) };
        delays.push(seconds.ok_or_else(fault)? * 1e9);
    }
    Empirical::new(delays).map(Arc::new).map_err(|error| {
        let message = match error {
            EmpiricalError::Constant { value } => format!("all delays are {} s: expected two different ones", value / 1e9),
            EmpiricalError::Count { .. } | EmpiricalError::NotANumber { .. } => error.to_string(),
        };
        // No single line is at fault.
        Fault { span: 0..0, message }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delays_are_read_in_seconds() {
        let delays = empirical("# from a capture\ndelay\n0.02\n\n 0.03 \n").unwrap();
        assert_eq!(delays.knots(), [2e7, 3e7]);
    }

    #[test]
    fn what_is_no_law_is_refused_in_its_line() {
        for (text, span, message) in [
            ("", 0..0, "the file is empty: expected a header, delay, and rows"),
            ("t\n1", 0..1, "the header is \"t\": expected delay, and one delay in seconds a line below"),
            ("delay\n0.1\n -1\n", 11..13, "\"-1\": expected a delay in seconds from 0 to 9e9"),
            ("delay\n0.1\n", 0..0, "an empirical law has 1 values: expected 2 to 1048576"),
            ("delay\n0.5\n0.5\n", 0..0, "all delays are 0.5 s: expected two different ones"),
        ] {
            let fault = empirical(text).unwrap_err();
            assert_eq!((fault.span, fault.message.as_str()), (span, message));
        }
        let fault = dist_table("1 2\n3 x").unwrap_err();
        assert_eq!(fault.span, 4..7);
        assert!(fault.message.starts_with("column 3: `x` is not an integer"), "{}", fault.message);
    }
}
