//! The traces of CellReplay: *light* (`ms base-ms pdo …` a line) and *heavy* (`ms` a line, 1400 bytes at each instant, as in mahimahi).
//!
//! A light trace has the base delay over time, which lies on a line between two rows, and begins anew after the last row. The rest of its row says when the
//! packets of a short train arrive. CellReplay takes the light trace while little is sent and the heavy one otherwise. No link depends on the load like this,
//! so a reader gives the base delay of the one or the line of the other, and says what it leaves out.

use std::fmt::Write as _;

use super::recording::{Link, Recording};
use super::{Program, ReaderError};

/// Octets that leave at an instant of a heavy trace \[bytes\].
const PACKET_BYTES: u64 = 1_400;
/// Fewest rows of a light trace that CellReplay takes.
const FEWEST_ROWS: usize = 3;
/// Greatest number of a trace \[ms\], 31 years.
const MOST_MS: u64 = 1_000_000_000_000;

/// Returns whether the first line has numbers alone.
pub(super) fn is_cellreplay(text: &str) -> bool {
    let first = text.lines().next().unwrap_or("");
    !first.trim().is_empty() && first.bytes().all(|byte| byte.is_ascii_digit() || byte == b' ' || byte == b'\r')
}

/// Reads a trace. A line with one number shows a heavy trace, a line with several numbers a light one.
pub(super) fn read(text: &str) -> Result<Recording, ReaderError> {
    let is_light = text.lines().next().unwrap_or("").split_whitespace().nth(1).is_some();
    let mut rows: Vec<(u64, u64)> = Vec::new();
    for (line, row) in (1..).zip(text.lines()) {
        let mut numbers = row.split_whitespace();
        let mut number = |name: &str| {
            let word = numbers.next().unwrap_or("");
            let read = word.parse().ok().filter(|ms| *ms <= MOST_MS);
            read.ok_or_else(|| ReaderError::found(format!("line {line}, {name}"), format!("\"{word}\""), "whole milliseconds, at most 10^12"))
        };
        let at_ms = number("time")?;
        let base_ms = if is_light { number("base delay")? } else { 0 };
        let more = numbers.find(|word| !is_light || word.parse::<u64>().is_err());
        if let Some(word) = more {
            let expected = if is_light { "whole milliseconds of the packets of a train" } else { "one instant a line, as on the first line" };
            return Err(ReaderError::found(format!("line {line}"), format!("\"{word}\""), expected));
        }
        if let Some((before_ms, _)) = rows.last().filter(|(before_ms, _)| *before_ms > at_ms) {
            return Err(ReaderError::found(format!("line {line}, time"), at_ms, format!("at least {before_ms}, the time of the line before")));
        }
        rows.push((at_ms, base_ms));
    }
    if rows.last().is_none_or(|(at_ms, _)| *at_ms == 0) {
        return Err(ReaderError::found(format!("line {}, time", rows.len().max(1)), 0, "a trace that lasts longer than 0 ms"));
    }
    if is_light { light(&rows) } else { Ok(heavy(&rows)) }
}

fn light(rows: &[(u64, u64)]) -> Result<Recording, ReaderError> {
    if rows.len() < FEWEST_ROWS {
        return Err(ReaderError::found("the trace", format!("{} lines", rows.len()), format!("at least {FEWEST_ROWS} of a light trace")));
    }
    let mut text = "t_ms,delay_ms\n".to_owned();
    for (at_ms, base_ms) in rows {
        // Writing to a `String` cannot fail.
        let _ = writeln!(text, "{at_ms},{base_ms}");
    }
    let notes = vec![
        "the link has the base delay, on a line between two rows".to_owned(),
        "left out: when the packets of a train arrive, which CellReplay uses while little is sent; no link depends on the load like this".to_owned(),
    ];
    Ok(Recording { program: Program::CellReplay, rate: None, walk: None, notes, link: Link::Delays { text }, spans: Vec::new() })
}

fn heavy(rows: &[(u64, u64)]) -> Recording {
    let text: String = rows.iter().map(|(at_ms, _)| format!("{at_ms}\n")).collect();
    let notes = vec![
        format!("the line sends {PACKET_BYTES} bytes at each instant; of a trace of mahimahi itself, which looks the same, say 1504 bytes"),
        "left out: the base delay, which the light trace has, and that CellReplay uses this line only while much is sent".to_owned(),
    ];
    Recording { program: Program::CellReplay, rate: None, walk: None, notes, link: Link::Line { text, bytes: PACKET_BYTES }, spans: Vec::new() }
}
