//! The figures of a session while it runs.

use std::time::Duration;

use cohaptic_harness::live::InputRow;
use cohaptic_harness::{Observer, PacketRow, TickRow};
use cohaptic_realtime::Lateness;
use cohaptic_units::Instant;
use cohaptic_wan::Fate;

use super::files::Release;
use super::recording::{Recording, Stopped};

/// Sees every tick and packet: how late ticks were, what links have carried of late, and the record if there is one.
#[derive(Debug)]
pub(super) struct Watch {
    recording: Option<Recording>,
    peers: usize,
    /// When the loop woke up for what happens now.
    pub(super) woken: Instant,
    last_tick: Option<Instant>,
    pub(super) ticks: Lateness,
    pub(super) releases: Lateness,
    pub(super) links: Vec<Carried>,
    /// The force that each device renders.
    pub(super) forces: Vec<[f64; 3]>,
}

/// What a link has delivered: all bytes, and the delays of the latest packets.
#[derive(Clone, Debug)]
pub(super) struct Carried {
    pub(super) bytes: u64,
    recent: [Duration; RECENT],
    next: usize,
    filled: usize,
}

/// The number of delays that are remembered: at 125 Hz those of a second.
const RECENT: usize = 125;

impl Carried {
    fn deliver(&mut self, bytes: u64, delay: Duration) {
        self.bytes += bytes;
        self.recent[self.next] = delay;
        self.next = (self.next + 1) % RECENT;
        self.filled = (self.filled + 1).min(RECENT);
    }

    /// The delays of the latest packets, in no order.
    pub(super) fn recent(&self) -> &[Duration] {
        &self.recent[..self.filled]
    }
}

impl Watch {
    pub(super) fn new(peers: usize, recording: Option<Recording>) -> Self {
        let empty = Carried { bytes: 0, recent: [Duration::ZERO; RECENT], next: 0, filled: 0 };
        Self {
            recording,
            peers,
            woken: Instant::ZERO,
            last_tick: None,
            ticks: Lateness::new(),
            releases: Lateness::new(),
            links: vec![empty; peers * peers],
            forces: vec![[0.0; 3]; peers],
        }
    }

    pub(super) fn released(&mut self, release: Release) -> Result<(), Stopped> {
        self.releases.record(release.late);
        self.recording.as_ref().map_or(Ok(()), |recording| recording.release(release))
    }

    pub(super) fn take_recording(&mut self) -> Option<Recording> {
        self.recording.take()
    }
}

impl Observer for Watch {
    type Error = Stopped;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn wants_packets(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Stopped> {
        // Peers that tick at the same instant are one tick of the loop.
        if self.last_tick != Some(row.at) {
            self.last_tick = Some(row.at);
            self.ticks.record(self.woken.saturating_duration_since(row.at));
        }
        self.forces[row.peer] = std::array::from_fn(|axis| row.coupling_force.get(axis).copied().unwrap_or(0.0));
        self.recording.as_ref().map_or(Ok(()), |recording| recording.tick(row))
    }

    fn on_packet(&mut self, row: &PacketRow) -> Result<(), Stopped> {
        if let Fate::Delivered(at) = row.fate {
            self.links[row.path.from.index() * self.peers + row.path.to.index()].deliver(row.size.get(), at.saturating_duration_since(row.offered));
        }
        self.recording.as_ref().map_or(Ok(()), |recording| recording.packet(row))
    }

    fn on_input(&mut self, row: &InputRow<'_>) -> Result<(), Stopped> {
        self.recording.as_ref().map_or(Ok(()), |recording| recording.input(row))
    }
}
