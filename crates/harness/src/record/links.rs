//! `links.csv`.

use std::path::{Path, PathBuf};

use cohaptic_wan::{DropCause, LinkStats};

use super::file::{RecordFile, push_display};
use crate::Summary;
use crate::record::RecordError;

/// Rows are handed on in pieces of about this length \[bytes\].
const PIECE: usize = 1 << 16;

/// Writes `links.csv` into a folder.
pub(crate) fn write(folder: &Path, summary: &Summary) -> Result<PathBuf, RecordError> {
    let mut file = RecordFile::create(folder.join("links.csv"))?;
    links_csv(summary, |rows| file.write(rows))?;
    file.finish()
}

/// Gives `write` the text of `links.csv` piece by piece: one row a link and access line with what became of its packets, and the mean delay of those delivered
/// (empty if there is none).
///
/// # Errors
///
/// The first error of `write`, which is not called again.
pub fn links_csv<E>(summary: &Summary, mut write: impl FnMut(&[u8]) -> Result<(), E>) -> Result<(), E> {
    let causes = DropCause::ALL.map(DropCause::name).join(",");
    let mut rows = format!("link,offered,duplicated,delivered,{causes},in-flight,mean-delay-s\n").into_bytes();
    let mut counters = Vec::new();
    let name = |peer: usize| summary.peers[peer].name.as_str();
    for line in &summary.access_lines {
        let (from, to) = if line.uplink { (name(line.peer), "*") } else { ("*", name(line.peer)) };
        counters.clear();
        push_counters(&mut counters, &line.stats);
        push_row(&mut rows, from, to, &counters);
    }
    for from in 0..summary.peers.len() {
        let mut last: Option<&LinkStats> = None;
        for (to, peer) in summary.peers.iter().enumerate() {
            let Some(stats) = summary.links.between(from, to) else { continue };
            // Links that do the same have one entry: their counters are put into words once.
            if !last.is_some_and(|last| std::ptr::eq(last, stats)) {
                last = Some(stats);
                counters.clear();
                push_counters(&mut counters, stats);
            }
            push_row(&mut rows, name(from), &peer.name, &counters);
            if rows.len() >= PIECE {
                write(&rows)?;
                rows.clear();
            }
        }
    }
    write(&rows)
}

#[inline]
fn push_row(rows: &mut Vec<u8>, from: &str, to: &str, counters: &[u8]) {
    for part in [from.as_bytes(), b"->", to.as_bytes(), counters] {
        rows.extend_from_slice(part);
    }
}

/// The columns of a row behind its name.
fn push_counters(row: &mut Vec<u8>, stats: &LinkStats) {
    for count in [stats.offered(), stats.duplicated(), stats.delivered()] {
        push_count(row, count);
    }
    for cause in DropCause::ALL {
        push_count(row, stats.dropped(cause));
    }
    push_count(row, stats.in_flight());
    row.push(b',');
    if let Some(delay) = stats.mean_delay() {
        push_display(row, delay.as_secs_f64());
    }
    row.push(b'\n');
}

/// A comma and a count. Most are zero; through [`std::fmt`] they take most of the time of a row.
fn push_count(row: &mut Vec<u8>, mut count: u64) {
    row.push(b',');
    let first = row.len();
    loop {
        row.push(b'0' + (count % 10).to_le_bytes()[0]);
        count /= 10;
        if count == 0 {
            break;
        }
    }
    row[first..].reverse();
}
