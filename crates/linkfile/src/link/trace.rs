//! Readers of recordings: `trace`, a recorded line or a recorded path, and `replay`, a link that repeats the fates of a log.

use std::sync::Arc;
use std::time::Duration;

use cohaptic_units::print::Span;
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::delay_table::DelayTableError;
use cohaptic_wan::{Between, DeliveryTrace, DeliveryTraceError, FateLog, FateLogError, MAHIMAHI_BYTES, PathTrace, PathTraceError};

use super::is_none;
use crate::document::Node;
use crate::link::keys::LINK_TABLE;
use crate::reading::named_file::{Fault, file_path, line_span, read_file};
use crate::reading::{Context, TableReader, values};

/// Content of a recording.
#[derive(Clone, Debug)]
pub(super) enum Trace {
    /// Instants at which a line can deliver, in the format of mahimahi.
    Delivery(DeliveryTrace),
    /// Delay and loss of a path over time, as a CSV.
    Path(PathTrace),
}

const FILE: &str = "the name of a recording, relative to the folder of this file";

/// Reads a recording: the name of a file, or a table. Returns `Some(None)` for "none".
pub(super) fn read_trace(node: &Node, context: Context<'_>) -> Option<Option<Trace>> {
    if is_none(node) {
        return Some(None);
    }
    let declaration = LINK_TABLE.table("trace");
    if node.as_table().is_none() {
        return load(node, context, Form { bytes: MAHIMAHI_BYTES, between: Between::Steps, repeat: false, start: Start::Zero }).map(Some);
    }
    let mut table =
        TableReader::new(node, context, declaration, "the name of a recording, or a table such as { file = \"path.csv\", repeat = true }")?;
    let (bytes_entry, of_path) = (table.entry("bytes"), [table.entry("between"), table.entry("repeat"), table.entry("start")]);
    // The form of a size allows zero, and a line without bytes would never deliver.
    let bytes = table.read("bytes", |node, context| {
        let bytes = values::size(node, context)?;
        if bytes == Bytes::ZERO {
            context.fault_at(node, "zero is out of range: expected a size above zero such as \"1504B\"");
            return None;
        }
        Some(bytes)
    });
    let between = table.choice("between", &Between::CHOICES);
    let repeat = table.value("repeat");
    let start = table.value("start").map(|word: &str| if word == "first" { Start::First } else { Start::Zero });
    let file = table.get("file");
    if file.is_none() {
        table.miss("file", FILE);
    }
    table.finish();
    let form = Form { bytes: bytes?, between: between?, repeat: repeat?, start: start? };
    let Some(file) = file else {
        // `miss` has reported the missing key, except in a part, which may lack the key.
        return context.partial.then_some(None);
    };
    let trace = load(file, context, form)?;
    // Only the content of the file tells the kind of the recording, so keys of the other kind are refused after the file is read.
    let misplaced = match &trace {
        Trace::Delivery(_) => of_path.into_iter().flatten().next(),
        Trace::Path(_) => bytes_entry,
    };
    if let Some(entry) = misplaced {
        let message = match &trace {
            Trace::Delivery(_) => "is for a recorded path: expected only bytes with instants of delivery, which always repeat",
            Trace::Path(_) => "is for instants of delivery: expected between, repeat and start with a recorded path",
        };
        context.fault(entry.key, &entry.node.path, format!("{} {message}", entry.name));
        return None;
    }
    Some(Some(trace))
}

/// Parameters for reading a recording.
#[derive(Clone, Copy, Debug)]
struct Form {
    /// Bytes that a line can deliver per instant.
    bytes: Bytes,
    /// Values of a path between two rows.
    between: Between,
    /// `true` if the recording of a path begins again after its end.
    repeat: bool,
    /// Origin of the times of a recorded path.
    start: Start,
}

/// Origin of the times of a recorded path: the start of the run, or the first row.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Start {
    Zero,
    First,
}

/// Assumed end of a run without a known end: ten years. Recordings with times since 1970 begin later, and are refused.
const LONGEST_RUN: Duration = Duration::from_secs(10 * 365 * 86_400);

/// Reads and parses the file of a recording.
fn load(node: &Node, context: Context<'_>, form: Form) -> Option<Trace> {
    let path = file_path(node, context, FILE)?;
    let Form { bytes, between, repeat, start } = form;
    let ends = context.ends;
    // The end of the run belongs to the form, because the end decides whether the recording is refused.
    let read_as = format!("trace {bytes} {between:?} {repeat} {start:?} {ends:?}");
    read_file(node, context, &path, &read_as, |text| match parse(text, bytes, between, repeat)? {
        // From the first row on, any recording begins at the start of the run, so the end of the run does not matter.
        Trace::Path(path) if start == Start::First => path.from_first().map(Trace::Path).map_err(|error| Fault::in_line(text, None, &error)),
        Trace::Path(path) => match outside(&path, ends) {
            Some(message) => Err(Fault { span: first_row_span(text), message }),
            None => Ok(Trace::Path(path)),
        },
        delivery @ Trace::Delivery(_) => Ok(delivery),
    })
}

/// Returns a message if the recording begins at or after the end of the run. A run would see only the first row of such a recording.
fn outside(path: &PathTrace, ends: Option<Duration>) -> Option<String> {
    let first = path.first().saturating_duration_since(Instant::ZERO);
    let end = ends.unwrap_or(LONGEST_RUN);
    (first >= end).then(|| {
        let run = if ends.is_some() { format!("the run ends at {}", Span(end)) } else { "no run lasts for ten years".to_owned() };
        format!(
            "the recording begins at {}, and {run}: expected times since the start of the run, or start = \"first\", which counts from the first row",
            Span(first)
        )
    })
}

/// Parses a recording. A file with a number as the first line has instants of delivery; any other file is a CSV.
fn parse(text: &str, bytes: Bytes, between: Between, repeat: bool) -> Result<Trace, Fault> {
    // Some programs put a byte order mark before the text.
    let content = text.strip_prefix('\u{feff}').unwrap_or(text);
    // The first line tells the kind of the recording: a CSV begins with a header or a comment.
    let first = content.lines().map(str::trim).find(|line| !line.is_empty()).unwrap_or_default();
    if first.parse::<f64>().is_ok() {
        return DeliveryTrace::parse(content, bytes).map(Trace::Delivery).map_err(|error| {
            let line = match &error {
                DeliveryTraceError::Number { line } | DeliveryTraceError::Order { line, .. } => Some(*line),
                DeliveryTraceError::NoLength | DeliveryTraceError::Empty | DeliveryTraceError::NoBytes => None,
            };
            Fault::in_line(text, line, &error)
        });
    }
    PathTrace::parse(text, between, repeat).map(Trace::Path).map_err(|error| {
        let line = match &error {
            PathTraceError::Table(DelayTableError::Columns { line, .. }) => {
                let message = "no recording: expected the columns t,delay or t,delay,loss, or a whole number of milliseconds on each line".to_owned();
                return Fault { span: line_span(text, *line), message };
            }
            PathTraceError::Table(error) => Some(error.line()),
            PathTraceError::Value { line, .. } => Some(*line),
            PathTraceError::Empty | PathTraceError::NoLength => None,
        };
        Fault::in_line(text, line, &error)
    })
}

/// Returns the bytes of the first row of a CSV: the second line that is neither blank nor a comment.
fn first_row_span(text: &str) -> core::ops::Range<usize> {
    let content = |line: &&str| !line.trim().is_empty() && !line.trim_start().starts_with('#');
    // Without a row the first line is at fault.
    let line = text.lines().enumerate().filter(|(_, line)| content(line)).nth(1).map_or(1, |(place, _)| place + 1);
    line_span(text, line)
}

/// Reads a log of fates with a path relative to the folder of the document.
pub(super) fn read_replay(node: &Node, context: Context<'_>) -> Option<Arc<FateLog>> {
    let path = file_path(node, context, "the name of a log of fates, relative to the folder of this file")?;
    read_file(node, context, &path, "fates", |text| FateLog::parse(text).map(Arc::new).map_err(|error| fault(text, &error)))
}

/// Returns the fault of a log of fates, with the line if the error has a line.
fn fault(text: &str, error: &FateLogError) -> Fault {
    let line = match error {
        FateLogError::Header { .. } => Some(1),
        FateLogError::Cells { line, .. }
        | FateLogError::Cell { line, .. }
        | FateLogError::UnknownFate { line, .. }
        | FateLogError::Missing { line, .. }
        | FateLogError::OfferedBefore { line, .. }
        | FateLogError::ImpossibleTime { line, .. }
        | FateLogError::Contradiction { line, .. }
        | FateLogError::TwoEnds { line, .. } => Some(*line),
        FateLogError::NoEnd { .. } | FateLogError::CopyFromNowhere { .. } => None,
    };
    Fault::in_line(text, line.and_then(|line| usize::try_from(line).ok()), error)
}
