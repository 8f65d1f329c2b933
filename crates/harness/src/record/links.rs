//! `links.csv`: counters of links.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Duration;

use cohaptic_units::Instant;
use cohaptic_wan::{CrossCounts, DropCause, LinkName, LinkStats};

use super::file::{RecordFile, push_display, push_seconds, push_whole};
use crate::Summary;
use crate::record::RecordError;

/// Length from which rows are passed on \[bytes\].
const PIECE: usize = 1 << 16;

/// Writes `links.csv` into a folder and returns its path.
pub(crate) fn write(folder: &Path, summary: &Summary) -> Result<PathBuf, RecordError> {
    let mut file = RecordFile::create(folder.join("links.csv"))?;
    links_csv(summary, |rows| file.write(rows))?;
    file.finish()
}

/// Passes the text of `links.csv` to `write` piece by piece: one row for each link and access line, with the numbers of packets by fate, of the packets of the
/// cross-traffic, and the mean delay of the delivered packets (empty without any).
///
/// # Errors
///
/// The first error of `write`, which is not called again after it.
pub fn links_csv<E>(summary: &Summary, mut write: impl FnMut(&[u8]) -> Result<(), E>) -> Result<(), E> {
    let causes = DropCause::ALL.map(DropCause::name).join(",");
    let mut rows = format!("link,offered,duplicated,delivered,{causes},in-flight,cross-offered,cross-dropped,mean-delay-s\n").into_bytes();
    let name = |peer: usize| summary.peers[peer].name.as_str();
    for line in &summary.access_lines {
        let named = if line.uplink { LinkName::uplink(name(line.peer)) } else { LinkName::downlink(name(line.peer)) };
        rows.extend_from_slice(named.as_str().as_bytes());
        push_counters(&mut rows, &line.stats);
    }
    for from in 0..summary.peers.len() {
        let sender = LinkName::between(name(from), "");
        let mut last: Option<(&LinkStats, Range<usize>)> = None;
        for (to, stats) in summary.links.sent_by(from) {
            rows.extend_from_slice(sender.as_str().as_bytes());
            rows.extend_from_slice(name(to).as_bytes());
            let counters = rows.len();
            // Links with equal counters can share one entry, whose text is then copied.
            match last {
                Some((last, counters)) if std::ptr::eq(last, stats) => rows.extend_from_within(counters),
                _ => push_counters(&mut rows, stats),
            }
            last = Some((stats, counters..rows.len()));
            // The copied range lies in the piece that is passed on here, so the next row is formatted anew.
            if rows.len() >= PIECE {
                write(&rows)?;
                rows.clear();
                last = None;
            }
        }
    }
    write(&rows)
}

/// Appends the columns of a row after the name of the link.
fn push_counters(row: &mut Vec<u8>, stats: &LinkStats) {
    let counts = [stats.offered(), stats.duplicated(), stats.delivered()].into_iter();
    let CrossCounts { offered, dropped, .. } = stats.cross_traffic();
    let mut zeros = 0;
    for count in counts.chain(DropCause::ALL.map(|cause| stats.dropped(cause))).chain([stats.in_flight(), offered, dropped]) {
        // Most counts are zero: their columns are appended in one piece.
        // A comma and the digit 0 for each column.
        if count == 0 {
            zeros += 2;
            continue;
        }
        row.extend_from_slice(&ZEROS[..zeros]);
        zeros = 0;
        row.push(b',');
        push_whole(row, count);
    }
    row.extend_from_slice(&ZEROS[..zeros]);
    row.push(b',');
    if let Some(delay) = stats.mean_delay() {
        push_delay(row, delay);
    }
    row.push(b'\n');
}

/// Number of columns with counts: the causes of drops, and offered, duplicated, delivered, in flight, and two of the cross-traffic.
const COUNTS: usize = DropCause::ALL.len() + 6;

/// Text of the longest possible run of columns with the count 0.
const ZEROS: [u8; 2 * COUNTS] = {
    let mut zeros = [b'0'; 2 * COUNTS];
    let mut at = 0;
    while at < zeros.len() {
        zeros[at] = b',';
        at += 2;
    }
    zeros
};

/// Appends a delay as an `f64` of seconds prints. Below a second, the nine digits of the nanoseconds are the shortest text of this `f64`.
fn push_delay(row: &mut Vec<u8>, delay: Duration) {
    if delay.as_secs() == 0 {
        push_seconds(row, Instant::ZERO.saturating_add(delay));
    } else {
        push_display(row, delay.as_secs_f64());
    }
}

#[cfg(test)]
mod tests {
    use cohaptic_tests_common::properties;
    use proptest::prelude::*;

    use super::*;

    properties! {
        #[test]
        fn delays_are_written_as_their_seconds_print(nanos in prop_oneof![0..2_000_000_000_u64, any::<u64>()], power in 0..9_u32) {
            for delay in [nanos, nanos / 10_u64.pow(power) * 10_u64.pow(power)].map(Duration::from_nanos) {
                let mut row = Vec::new();
                push_delay(&mut row, delay);
                prop_assert_eq!(String::from_utf8(row).unwrap(), format!("{}", delay.as_secs_f64()));
            }
        }

        #[test]
        fn counters_are_written_as_they_print(counts in proptest::collection::vec(prop_oneof![Just(0), 0..12_u64, 0..1_u64 << 40], DropCause::ALL.len() + 2)) {
            let (offered, delivered) = (counts.iter().sum::<u64>() + 1, counts[0]);
            let stats = LinkStats::counted(offered, delivered, 24_000_000 * u128::from(delivered), DropCause::ALL.into_iter().zip(counts[2..].iter().copied()));
            let mut row = Vec::new();
            push_counters(&mut row, &stats);
            let dropped: String = counts[2..].iter().map(|count| format!(",{count}")).collect();
            let delay = if delivered > 0 { "0.024" } else { "" };
            prop_assert_eq!(String::from_utf8(row).unwrap(), format!(",{offered},0,{delivered}{dropped},{},0,0,{delay}\n", stats.in_flight()));
        }
    }
}
