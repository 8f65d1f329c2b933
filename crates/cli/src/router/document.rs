//! The JSON document of a router.

use cohaptic_linkfile::router::{RouterFile, Side};
use cohaptic_realtime::Wish;
use cohaptic_router::{Count, LaneSnapshot, Received, Written};
use serde::Serialize;

use super::conduct::{Ending, RouterRun};
use super::status::elapsed;
use crate::documents::{Counters, LatenessDocument, LinkDocument};
use crate::output;
use crate::realtime::ConfiguredDelay;

/// What `cohaptic router --json` prints.
#[derive(Serialize)]
pub(super) struct RouterDocument {
    title: String,
    duration_s: f64,
    ending: &'static str,
    valid: bool,
    packets: u64,
    dropped: u64,
    release_error_us: LatenessDocument,
    sides: [SideDocument; 2],
    links: Vec<LaneDocument>,
    rules: Vec<CountDocument>,
    in_flight: CountDocument,
    granted: Vec<&'static str>,
    refused_wishes: Vec<String>,
}

/// A side: what came from it, and what was handed to its device.
#[derive(Serialize)]
struct SideDocument {
    name: &'static str,
    device: String,
    received: ReceivedDocument,
    by_default: CountDocument,
    written: WrittenDocument,
}

#[derive(Serialize)]
struct ReceivedDocument {
    #[serde(flatten)]
    all: CountDocument,
    not_ip: u64,
    malformed: u64,
    passed: u64,
    dropped: u64,
}

#[derive(Serialize)]
struct WrittenDocument {
    packets: u64,
    bytes: u64,
    full: u64,
    too_long: u64,
    refused: u64,
}

#[derive(Serialize)]
struct CountDocument {
    packets: u64,
    bytes: u64,
}

/// One direction of a link.
#[derive(Serialize)]
struct LaneDocument {
    name: String,
    #[serde(flatten)]
    link: LinkDocument,
    delivered_bytes: u64,
    overload: u64,
    asked_mean_delay_s: Option<f64>,
    changes: u64,
}

impl RouterDocument {
    pub(super) fn new(file: &RouterFile, ran: &RouterRun) -> Self {
        let RouterRun { report, prepared, validity, asked, ending } = ran;
        let counters = &report.counters;
        let side = |side: Side, device: &str| SideDocument {
            name: side.name(),
            device: device.to_owned(),
            received: ReceivedDocument::new(&counters.received[side.index()]),
            by_default: CountDocument::new(counters.by_default[side.index()]),
            written: WrittenDocument::new(&report.written[side.index()]),
        };
        Self {
            title: output::path(&file.file),
            duration_s: elapsed(report).as_secs_f64(),
            ending: match ending {
                Ending::Complete => "complete",
                Ending::Interrupted => "interrupted",
                Ending::Failed(_) => "failed",
            },
            valid: validity.is_valid(),
            packets: report.packets(),
            dropped: report.dropped(),
            release_error_us: LatenessDocument::new(&report.release),
            sides: [side(Side::Left, file.left.device()), side(Side::Right, file.right.device())],
            links: counters.lanes.iter().zip(asked).map(|(lane, asked)| LaneDocument::new(lane, asked)).collect(),
            rules: counters.by_rule.iter().copied().map(CountDocument::new).collect(),
            in_flight: CountDocument { packets: counters.held.packets, bytes: counters.held.bytes.get() },
            granted: prepared.granted.iter().copied().map(Wish::name).collect(),
            refused_wishes: prepared.refused.iter().map(ToString::to_string).collect(),
        }
    }
}

impl LaneDocument {
    fn new(lane: &LaneSnapshot, asked: &ConfiguredDelay) -> Self {
        let (from, to) = (lane.from.name().to_owned(), lane.from.opposite().name().to_owned());
        Self {
            name: lane.link.clone(),
            link: LinkDocument { from, to, counters: Counters::new(&lane.stats) },
            delivered_bytes: lane.delivered_bytes,
            overload: lane.overload,
            asked_mean_delay_s: asked.first.map(|delay| delay.as_secs_f64()),
            changes: asked.changes,
        }
    }
}

impl ReceivedDocument {
    const fn new(received: &Received) -> Self {
        let Received { all, not_ip, malformed, passed, dropped } = *received;
        Self { all: CountDocument::new(all), not_ip, malformed, passed, dropped }
    }
}

impl WrittenDocument {
    const fn new(written: &Written) -> Self {
        let Written { packets, bytes, full, too_long, refused } = *written;
        Self { packets, bytes, full, too_long, refused }
    }
}

impl CountDocument {
    const fn new(count: Count) -> Self {
        let Count { packets, bytes } = count;
        Self { packets, bytes }
    }
}
