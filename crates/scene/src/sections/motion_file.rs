//! Reader of files of recorded motions or forces, with or without torques: rows of comma-separated numbers, the time first.

use core::ops::Range;
use std::sync::Arc;

use cohaptic_linkfile::document::{Node, quote, shorten};
use cohaptic_linkfile::reading::named_file::{Fault, file_path, read_file};
use cohaptic_peer::{Table as MotionTable, TableError};
use cohaptic_units::print::Counted;
use cohaptic_units::{Instant, parse};

use crate::context::SceneContext;

/// Quantity in the columns after the time.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Columns {
    /// Columns fx, fy, fz \[N\].
    Force,
    /// Columns x, y, z \[m\].
    Position,
}

impl Columns {
    fn header(self, axes: usize) -> Vec<&'static str> {
        let names = match self {
            Self::Force => ["t", "fx", "fy", "fz"],
            Self::Position => ["t", "x", "y", "z"],
        };
        names.into_iter().take(1 + axes).collect()
    }
}

/// Columns of a torque in world axes \[N·m\], after all other columns.
const TORQUE: [&str; 3] = ["tx", "ty", "tz"];

/// Content of a file.
#[derive(Clone, Debug)]
pub(crate) struct Recorded {
    /// Force \[N\] or position \[m\], as the caller asked.
    pub(crate) motion: Arc<MotionTable>,
    /// Torque in world axes \[N·m\]; `None` if the file has no such columns.
    pub(crate) torque: Option<Arc<MotionTable>>,
}

/// Reads the file named by `node`, relative to the folder of the scene.
pub(crate) fn read_motion_file(node: &Node, context: SceneContext<'_>, columns: Columns) -> Option<Recorded> {
    let path = file_path(node, *context, "the name of a CSV file, relative to the folder of the scene")?;
    let header = columns.header(context.axes?.count());
    // Files are kept by path and form. The same path with other columns must be parsed again, to be refused by the header.
    let form = format!("{}{}", header.join(","), if context.turns { " and torques" } else { "" });
    read_file(node, *context, &path, &form, |text| parse_rows(text, &header, context.turns))
}

fn parse_rows(text: &str, motion: &[&str], turns: bool) -> Result<Recorded, Fault> {
    // `flexible`: rows of another length are refused below, with a message about the columns.
    let mut reader = csv::ReaderBuilder::new().has_headers(false).flexible(true).trim(csv::Trim::All).from_reader(text.as_bytes());
    let mut lines: Vec<Range<usize>> = Vec::new();
    let (mut rows, mut torques) = (Vec::new(), Vec::new());
    let (mut header, with_torque) = (motion, [motion, &TORQUE].concat());
    let columns = motion.join(",");
    for record in reader.records() {
        // End of the last read line, for faults without a position.
        let from = lines.last().map_or(0, |line| line.end);
        let record = record.map_err(|error| Fault { span: from..from, message: format!("{error}: expected the columns {columns}") })?;
        // The position is before empty lines, which `line_at` skips.
        let at = record.position().and_then(|position| usize::try_from(position.byte()).ok()).unwrap_or(from);
        let line = line_at(text, at);
        let fault = |column: usize, name: &str, message| Fault { span: field_at(text, &line, column), message: format!("column {name}: {message}") };
        if lines.is_empty() {
            // A header with torques is valid only if the object turns.
            if record.iter().eq(with_torque.iter().copied()) {
                if !turns {
                    let message = format!("a torque needs an object that turns: expected object.inertia, or the columns {columns}");
                    return Err(fault(motion.len(), TORQUE[0], message));
                }
                // From here on a row has the columns of the torque too.
                header = &with_torque;
            } else if record.iter().ne(motion.iter().copied()) {
                let torques = if turns { format!(", or {}", with_torque.join(",")) } else { String::new() };
                let message = format!("the header is {}: expected {columns}{torques}", quote(text[line.clone()].trim()));
                return Err(Fault { span: line, message });
            }
        } else {
            if record.len() != header.len() {
                let message = format!("{}: expected {}, {}", Counted(record.len(), "column"), header.len(), header.join(","));
                return Err(Fault { span: line, message });
            }
            let time = seconds(&record[0]).map_err(|message| fault(0, header[0], message))?;
            let triple = |columns: Range<usize>| {
                let mut values = [0.0; 3];
                for (value, column) in values.iter_mut().zip(columns) {
                    *value = finite(&record[column]).map_err(|message| fault(column, header[column], message))?;
                }
                Ok(values)
            };
            // The length was checked above, so that the columns exist. Components beyond the axes stay zero.
            rows.push((time, triple(1..motion.len())?));
            if header.len() > motion.len() {
                torques.push((time, triple(motion.len()..header.len())?));
            }
        }
        lines.push(line);
    }
    if lines.is_empty() {
        return Err(Fault { span: 0..0, message: format!("the file is empty: expected a header, {columns}, and rows") });
    }
    let has_torque = header.len() > motion.len();
    let table = |rows| MotionTable::new(rows).map(Arc::new).map_err(|error| table_fault(text, &lines, &error));
    Ok(Recorded { motion: table(rows)?, torque: if has_torque { Some(table(torques)?) } else { None } })
}

fn table_fault(text: &str, lines: &[Range<usize>], error: &TableError) -> Fault {
    // Line 0 is the header, so that row `n` is line `n + 1`.
    let at = |row: usize| lines.get(row + 1).map_or(0..0, |line| field_at(text, line, 0));
    match error {
        TableError::NotLater { row, at: time, before } => {
            let message = format!("column t: {time} is not later than the row before it, at {before}: expected times that increase from row to row");
            Fault { span: at(*row), message }
        }
        TableError::NotFinite { row, .. } => Fault { span: at(*row), message: format!("{error}: expected a number") },
        TableError::Empty => {
            Fault { span: lines.first().cloned().unwrap_or(0..0), message: "no row after the header: expected at least one".to_owned() }
        }
    }
}

/// Returns the span of the first line of a record, without the line end. `at` is the byte position of the record by the CSV reader. Line ends and empty lines
/// at this position are skipped.
fn line_at(text: &str, at: usize) -> Range<usize> {
    let bytes = text.as_bytes();
    let mut start = at.min(bytes.len());
    while bytes.get(start).is_some_and(|byte| matches!(byte, b'\r' | b'\n')) {
        start += 1;
    }
    let end = bytes[start..].iter().position(|byte| matches!(byte, b'\r' | b'\n')).map_or(bytes.len(), |length| start + length);
    start..end
}

/// Returns the span of a field in a line, without the space around the field. `column` is the number of commas before the field. The whole line if there is
/// no such field.
fn field_at(text: &str, line: &Range<usize>, column: usize) -> Range<usize> {
    let mut start = line.start;
    let Some(content) = text.get(line.clone()) else { return line.clone() };
    for (index, field) in content.split(',').enumerate() {
        if index == column {
            let trimmed = field.trim_start();
            let start = start + field.len() - trimmed.len();
            return start..start + trimmed.trim_end().len();
        }
        start += field.len() + 1;
    }
    line.clone()
}

fn finite(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(_) => Err(format!("{} is not finite: expected a number", quote(text))),
        Err(_) => Err(format!("{} is not a number: expected one such as 1.5 or -2e-3", quote(text))),
    }
}

/// Reads seconds as an instant. The decimal number, also with an exponent, is read exactly and rounded once.
fn seconds(text: &str) -> Result<Instant, String> {
    const EXPECTED: &str = "expected a time in seconds such as 0.25";
    // Also refuses texts that are not numbers: below, only the notation is changed.
    let value = finite(text)?;
    if value < 0.0 {
        return Err(format!("{} is negative: {EXPECTED}", shorten(text)));
    }
    // The sign belongs to a zero, or is a plus.
    let plain = without_exponent(text.trim_start_matches(['+', '-'])).ok_or_else(|| format!("{} is out of range: {EXPECTED}", shorten(text)))?;
    let span = parse::duration(&format!("{plain}s")).map_err(|_| format!("{} is out of range: {EXPECTED}", shorten(text)))?;
    Instant::ZERO.checked_add(span).ok_or_else(|| format!("{} is out of range: {EXPECTED}", shorten(text)))
}

/// Returns the number without an exponent: `0.125` for `1.25e-1`. `None` for exponents beyond ±400, which no time in seconds needs.
fn without_exponent(text: &str) -> Option<String> {
    let Some((mantissa, exponent)) = text.split_once(['e', 'E']) else { return Some(text.to_owned()) };
    let exponent: i64 = exponent.parse().ok().filter(|exponent| (-400..=400).contains(exponent))?;
    // The exponent moves digits from one side of the point to the other. Missing digits are zeros.
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let shift = usize::try_from(exponent.unsigned_abs()).ok()?;
    Some(if exponent >= 0 {
        let (moved, rest) = fraction.split_at(shift.min(fraction.len()));
        format!("{whole}{moved}{}.{rest}", "0".repeat(shift - moved.len()))
    } else {
        let (rest, moved) = whole.split_at(whole.len().saturating_sub(shift));
        format!("0{rest}.{}{moved}{fraction}", "0".repeat(shift - moved.len()))
    })
}

#[cfg(test)]
mod tests {
    use cohaptic_peer::Signal;
    use cohaptic_units::Excerpt;

    use super::*;

    fn nanos(text: &str) -> Option<u64> {
        seconds(text).ok().map(Instant::as_nanos)
    }

    #[test]
    fn times_are_rounded_once_also_with_an_exponent() {
        assert_eq!(nanos("0.001"), Some(1_000_000));
        assert_eq!(nanos("1.000000000000000000e-03"), Some(1_000_000));
        assert_eq!(nanos("1.25E1"), Some(12_500_000_000));
        assert_eq!(nanos("12345e-4"), Some(1_234_500_000));
        assert_eq!(nanos("0.0000000005"), Some(1));
        assert_eq!(nanos("-0.0"), Some(0));
        assert_eq!(nanos("+1"), Some(1_000_000_000));
        assert_eq!(nanos(".5"), Some(500_000_000));
    }

    #[test]
    fn what_is_no_time_is_refused() {
        for text in ["", "nan", "inf", "-1", "-1e-9", "1e300", "1e999", "1s", "e5", "1e", "--1", "+-1", "0x10"] {
            assert_eq!(nanos(text), None, "{text}");
        }
    }

    fn fault(text: &str) -> (usize, usize, String) {
        let Fault { span, message } = parse_rows(text, &["t", "fx"], false).unwrap_err();
        let excerpt = Excerpt::new(text, span);
        (excerpt.line, excerpt.column, message)
    }

    #[test]
    fn a_fault_in_a_row_is_found_in_its_column() {
        assert_eq!(fault("t,fx\n0,1\n\n0.1, x\n"), (4, 6, "column fx: \"x\" is not a number: expected one such as 1.5 or -2e-3".to_owned()));
        assert_eq!(fault("t,fx\r\n0,1\r\n0.1,nan\r\n"), (3, 5, "column fx: \"nan\" is not finite: expected a number".to_owned()));
        assert_eq!(fault("t,fx\n-1,1\n").0, 2);
        assert_eq!(fault("t,fx\n0,1,2\n"), (2, 1, "3 columns: expected 2, t,fx".to_owned()));
        assert_eq!(fault("t,fy\n0,1\n"), (1, 1, "the header is \"t,fy\": expected t,fx".to_owned()));
        assert_eq!(fault("t,fx\n"), (1, 1, "no row after the header: expected at least one".to_owned()));
        assert_eq!(fault("").2, "the file is empty: expected a header, t,fx, and rows");
        let (line, column, message) = fault("t,fx\n0,1\n1,1\n1,1\n");
        assert_eq!((line, column), (4, 1));
        assert!(message.starts_with("column t: 1s is not later than the row before it, at 1s"));
    }

    #[test]
    fn space_around_fields_and_a_byte_order_mark_are_no_fault() {
        assert!(parse_rows("\u{feff}t, fx\n 0 , 1\n", &["t", "fx"], false).is_ok());
    }

    #[test]
    fn torques_stand_behind_all_other_columns() {
        const COLUMNS: [&str; 4] = ["t", "x", "y", "z"];
        let text = "t,x,y,z,tx,ty,tz\n0,1,2,3,4,5,6\n1,0,0,0,8,5,6\n";
        let Recorded { motion, torque } = parse_rows(text, &COLUMNS, true).unwrap();
        let at_half = |table: Arc<MotionTable>| Signal::Table(table).value::<3>(Instant::from_nanos(500_000_000));
        assert_eq!((at_half(motion), torque.map(at_half)), ([0.5, 1.0, 1.5], Some([6.0, 5.0, 6.0])));
        assert!(parse_rows("t,x,y,z\n0,1,2,3\n", &COLUMNS, true).unwrap().torque.is_none());
        let refused = |text: &str, turns: bool| {
            let Fault { span, message } = parse_rows(text, &COLUMNS, turns).unwrap_err();
            (Excerpt::new(text, span).column, message)
        };
        let needs = "column tx: a torque needs an object that turns: expected object.inertia, or the columns t,x,y,z";
        assert_eq!(refused(text, false), (9, needs.to_owned()));
        assert_eq!(refused(&text.replace("8", "nan"), true).0, 9);
        let header = "the header is \"t,x,y,z,tx\": expected t,x,y,z, or t,x,y,z,tx,ty,tz";
        assert_eq!(refused("t,x,y,z,tx\n", true), (1, header.to_owned()));
    }
}
