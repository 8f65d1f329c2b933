//! Figures of a running session: the observer of the scene, which also feeds the record.

use std::time::Duration;

use cohaptic_harness::live::InputRow;
use cohaptic_harness::measures::{MeasuredValue, Measures};
use cohaptic_harness::task::{TaskResult, TaskView};
use cohaptic_harness::{HoldRow, InstantRow, Observer, PacketRow, SendRow, StepRow, Summary, TickRow};
use cohaptic_realtime::Lateness;
use cohaptic_scene::Scene;
use cohaptic_units::Instant;
use cohaptic_wan::Fate;

use super::files::Release;
use super::motion::EndedPackets;
use super::recording::{Recording, Stopped};

/// Observer of a session. Keeps the lateness of ticks and releases, the traffic of the links and the measures, and hands rows to the record if there is a
/// record.
#[derive(Debug)]
pub(super) struct Watch {
    recording: Option<Recording>,
    /// Number of peers of the scene.
    peers: usize,
    /// Instant at which the loop woke up for the present event. The lateness of a tick is counted up to this instant.
    pub(super) woken: Instant,
    /// Instant of the latest tick, to count peers that tick together as one tick.
    last_tick: Option<Instant>,
    pub(super) ticks: Lateness,
    pub(super) releases: Lateness,
    /// Traffic of the directed links: the entry `from * peers + to`, for every pair of peers. Pairs without a link stay empty.
    pub(super) links: Vec<Carried>,
    /// `true` if the conductor wants a status. Otherwise `links` is not kept up, because this takes time for each delivered packet.
    pub(super) is_shown: bool,
    /// Packets for the next [`Motion`](super::Motion). `None` if the conductor wants no motion.
    pub(super) ended: Option<EndedPackets>,
    /// Coupling force at the latest tick \[N\], indexed by peer.
    pub(super) forces: Vec<[f64; 3]>,
    measures: Option<Measures>,
}

/// Traffic of one link: the sum of delivered bytes, and a ring of the delays of the packets delivered last.
#[derive(Clone, Debug)]
pub(super) struct Carried {
    pub(super) bytes: u64,
    /// Ring of delays. Only the first `filled` entries are valid.
    recent: [Duration; RECENT],
    /// Index in `recent` of the next delay, below `RECENT`.
    next: usize,
    /// Number of valid delays, at most `RECENT`.
    filled: usize,
}

/// Number of delays in the ring: one second of packets at 125 Hz.
const RECENT: usize = 125;

impl Carried {
    fn deliver(&mut self, bytes: u64, delay: Duration) {
        self.bytes += bytes;
        self.recent[self.next] = delay;
        // The ring overwrites its oldest delay.
        self.next = (self.next + 1) % RECENT;
        self.filled = (self.filled + 1).min(RECENT);
    }

    /// Returns the delays of the packets delivered last, in no particular order.
    pub(super) fn recent(&self) -> &[Duration] {
        &self.recent[..self.filled]
    }
}

impl Watch {
    pub(super) fn new(scene: &Scene, recording: Option<Recording>) -> Self {
        let peers = scene.peers.len();
        let empty = Carried { bytes: 0, recent: [Duration::ZERO; RECENT], next: 0, filled: 0 };
        Self {
            recording,
            peers,
            woken: Instant::ZERO,
            last_tick: None,
            ticks: Lateness::new(),
            releases: Lateness::new(),
            links: vec![empty; peers * peers],
            is_shown: true,
            ended: None,
            forces: vec![[0.0; 3]; peers],
            measures: Measures::of(scene),
        }
    }

    /// Returns the measures at the logical time `elapsed`. Empty if the scene asks for no measures.
    pub(super) fn measured(&self, elapsed: Duration) -> Vec<MeasuredValue> {
        self.measures.as_ref().map(|measures| measures.values(elapsed)).unwrap_or_default()
    }

    /// Returns the visible state of the task at an instant; `None` for a scene without a task.
    pub(super) fn task_view(&self, at: Instant) -> Option<TaskView> {
        self.measures.as_ref().and_then(|measures| measures.task_view(at))
    }

    /// Returns the result of the task of a session with this summary; `None` for a scene without a task.
    pub(super) fn task(&self, summary: &Summary) -> Option<TaskResult> {
        self.measures.as_ref().and_then(|measures| measures.task(summary))
    }

    /// Counts a datagram that was queued for another program, and hands its row to the record.
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

    fn wants_steps(&self) -> bool {
        self.measures.wants_steps()
    }

    fn wants_instants(&self) -> bool {
        self.measures.wants_instants()
    }

    fn wants_sends(&self) -> bool {
        self.measures.wants_sends()
    }

    fn wants_holds(&self) -> bool {
        self.measures.wants_holds()
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Stopped> {
        // Peers that tick at the same instant are one tick of the loop. The scene handles their ticks one after another, so the previous instant is enough to
        // compare with.
        if self.last_tick != Some(row.at) {
            self.last_tick = Some(row.at);
            self.ticks.record(self.woken.saturating_duration_since(row.at));
        }
        // A row has as many components as the scene has axes; the others are zero.
        self.forces[row.peer] = std::array::from_fn(|axis| row.coupling_force.get(axis).copied().unwrap_or(0.0));
        // The measures cannot fail: their error type has no value.
        let Ok(()) = self.measures.on_tick(row);
        self.recording.as_ref().map_or(Ok(()), |recording| recording.tick(row))
    }

    fn on_step(&mut self, row: &StepRow<'_>) -> Result<(), Stopped> {
        let Ok(()) = self.measures.on_step(row);
        Ok(())
    }

    fn on_instant(&mut self, row: &InstantRow) -> Result<(), Stopped> {
        let Ok(()) = self.measures.on_instant(row);
        Ok(())
    }

    fn on_send(&mut self, row: &SendRow) -> Result<(), Stopped> {
        let Ok(()) = self.measures.on_send(row);
        Ok(())
    }

    fn on_hold(&mut self, row: &HoldRow) -> Result<(), Stopped> {
        let Ok(()) = self.measures.on_hold(row);
        Ok(())
    }

    fn on_packet(&mut self, row: &PacketRow) -> Result<(), Stopped> {
        if let Fate::Delivered(at) = row.fate
            && self.is_shown
        {
            self.links[row.path.from.index() * self.peers + row.path.to.index()].deliver(row.size.get(), at.saturating_duration_since(row.offered));
        }
        // Lost packets, too, are shown in a motion.
        if let Some(ended) = &mut self.ended {
            ended.see(row);
        }
        self.recording.as_ref().map_or(Ok(()), |recording| recording.packet(row))
    }

    fn on_input(&mut self, row: &InputRow<'_>) -> Result<(), Stopped> {
        self.recording.as_ref().map_or(Ok(()), |recording| recording.input(row))
    }
}
