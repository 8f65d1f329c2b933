//! The live session of a soak, on a thread of its own, and how far its logical time is from the clock on the wall.

use std::error::Error;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use cohaptic_harness::Ending;
use cohaptic_live::{Conductor, LinkChange, Report, Session, SessionConfig, SessionError, SessionKey, Status};
use cohaptic_realtime::{Clock as _, MonotonicClock, Wishes};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use super::probe::{Asked, Probe, probe};
use super::verdict::{Account, nanos};
use super::{PEERS, TICK, VISITOR};
use crate::visitor::Visits;

/// How far logical time was from the clock on the wall, over the looks since the sample before. `CLOCK_MONOTONIC`, read by the thread that looks on.
///
/// The session does not tell at which reading its time began: between the last reading before it was started and the first from within. So there is an earliest and a
/// latest answer, and each rule is judged by the one that is in favour of the session: what it fails, it fails for certain.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Lag {
    /// How many looks there were.
    pub looks: u64,
    /// The wall less logical time at the look where that was least, at most \[ns\]: below zero, logical time was ahead for certain.
    pub least_at_most: i128,
    /// The same, at least \[ns\]: a tick or more, and logical time was behind all the time.
    pub least_at_least: i128,
    /// At the look where it was most, at most \[ns\]: a pause of the machine shows here.
    pub most: i128,
    /// How many looks found it a tick or more behind.
    pub behind: u64,
}

impl Lag {
    const NONE: Self = Self { looks: 0, least_at_most: i128::MAX, least_at_least: i128::MAX, most: i128::MIN, behind: 0 };

    fn look(&mut self, at_most: i128, at_least: i128) {
        self.looks += 1;
        self.least_at_most = self.least_at_most.min(at_most);
        self.least_at_least = self.least_at_least.min(at_least);
        self.most = self.most.max(at_most);
        self.behind += u64::from(at_least >= nanos(TICK));
    }
}

/// The session at one moment.
#[derive(Clone, Debug)]
pub(super) struct LiveLook {
    pub(super) status: Status,
    pub(super) lag: Lag,
}

/// How the session ended.
#[derive(Debug)]
pub(super) struct LiveEnd {
    pub(super) report: Report,
    /// Logical time at the end.
    pub(super) elapsed: Duration,
    /// The wall when it was asked to stop, since the latest moment at which it can have begun: logical time must have caught up with this.
    pub(super) asked: Duration,
    /// The wall after the end, since the earliest: logical time must not be ahead of this.
    pub(super) ended: Duration,
    /// Between the earliest and the latest.
    pub(super) unknown: Duration,
}

/// The thread.
#[derive(Debug)]
pub(super) struct Live {
    pub(super) address: SocketAddr,
    pub(super) probe: Probe<LiveLook>,
    stop: Arc<AtomicBool>,
    thread: JoinHandle<Result<LiveEnd, SessionError>>,
}

/// The onlooker.
struct Host {
    clock: MonotonicClock,
    earliest: Instant,
    latest: Option<Instant>,
    stop: Arc<AtomicBool>,
    asked_to_stop: Instant,
    elapsed: Duration,
    lag: Lag,
    asked: Asked<LiveLook>,
}

impl Live {
    pub(super) fn start(scene: &Scene, key: SessionKey, wishes: Wishes) -> Result<Self, SessionError> {
        let config = SessionConfig { key: Some(key), wishes, ..SessionConfig::new(SocketAddr::from(([127, 0, 0, 1], 0))) };
        let listen = config.listen;
        let session = Session::open(scene, config, |_| None)?;
        let address = session.address().unwrap_or(listen);
        let stop = Arc::new(AtomicBool::new(false));
        let (probe, asked) = probe();
        let is_over = Arc::clone(&stop);
        let thread = std::thread::spawn(move || {
            let clock = MonotonicClock::start();
            let earliest = clock.now();
            let (asked_to_stop, elapsed, lag) = (earliest, Duration::ZERO, Lag::NONE);
            let mut host = Host { clock, earliest, latest: None, stop: is_over, asked_to_stop, elapsed, lag, asked };
            let report = session.run(&mut host)?;
            let latest = host.latest.unwrap_or(earliest);
            Ok(LiveEnd {
                report,
                elapsed: host.elapsed,
                asked: host.asked_to_stop.saturating_duration_since(latest),
                ended: clock.now().saturating_duration_since(earliest),
                unknown: latest.saturating_duration_since(earliest),
            })
        });
        Ok(Self { address, probe, stop, thread })
    }

    pub(super) fn stop(self) -> Result<LiveEnd, Box<dyn Error>> {
        self.stop.store(true, Ordering::Release);
        Ok(self.thread.join().map_err(|_| "the session panicked")??)
    }
}

impl Conductor for Host {
    fn keep_going(&mut self) -> bool {
        let now = self.clock.now();
        self.latest.get_or_insert(now);
        let stop = self.stop.load(Ordering::Acquire);
        if stop {
            self.asked_to_stop = now;
        }
        !stop
    }

    fn next_change(&mut self) -> Option<LinkChange> {
        None
    }

    fn show(&mut self, status: Status) {
        let now = self.clock.now();
        self.elapsed = status.elapsed;
        let since = |began: Instant| nanos(now.saturating_duration_since(began)) - nanos(status.elapsed);
        self.lag.look(since(self.earliest), since(self.latest.unwrap_or(now)));
        let lag = &mut self.lag;
        self.asked.answer(|| LiveLook { status, lag: core::mem::replace(lag, Lag::NONE) });
    }
}

/// What must be equal in a session at any moment.
pub(super) fn accounts(status: &Status) -> Vec<Account> {
    let visitor = VISITOR as usize;
    let link = |from: usize, to: usize| status.links.iter().find(|link| (link.from, link.to) == (from, to)).map(|link| link.stats);
    let others = || (0..PEERS).filter(move |place| *place != visitor);
    let mut accounts = Vec::new();
    let ticks = status.elapsed.as_nanos().div_ceil(TICK.as_nanos());
    // What happened before the first instant that is open: every tick, once.
    accounts.push(Account::of("ticks made and ticks of logical time", status.ticks.count, u64::try_from(ticks).unwrap_or(u64::MAX)));
    if let (Some(door), Some(seat)) = (&status.admission, status.peers.get(visitor).and_then(|peer| peer.seat)) {
        let settled = door.admitted + door.welcomed + door.refused_in_all();
        accounts.push(Account::of("datagrams that came in, and admitted, welcomed and refused", door.handled, settled));
        accounts.push(Account::of(
            "admitted by the session, and by the scene or refused there",
            door.admitted,
            seat.taken + seat.refused + seat.out_of_order,
        ));
        for to in others() {
            let offered = link(visitor, to).map_or(0, |stats| stats.offered());
            accounts.push(Account::of("samples taken from the visitor and offered to a link", seat.taken, offered));
        }
        let delivered = others().filter_map(|from| link(from, visitor)).map(|stats| stats.delivered()).sum();
        accounts.push(Account::of("delivered to the visitor, and sent or without anybody there", delivered, door.sent + door.nobody_there));
        accounts.push(Account::of("sent to the visitor, and release errors recorded", door.sent, status.releases.count));
    }
    for from in others() {
        let mut offered = (0..PEERS).filter_map(|to| link(from, to)).map(|stats| stats.offered());
        if let Some(first) = offered.next() {
            accounts.extend(offered.map(|other| Account::of("samples of a peer on two of its links", first, other)));
        }
    }
    accounts
}

/// What must be equal at the end, when nobody sends any more.
pub(super) fn last_accounts(end: &LiveEnd, visits: &Visits) -> Vec<Account> {
    let Some((door, socket)) = &end.report.admission else { return Vec::new() };
    let counts = socket.counts;
    let made_ready = door.sent + door.welcomed;
    vec![
        Account::with_drops(
            "sent by the visitor, and received or dropped by the kernel",
            visits.sent,
            counts.received + counts.oversized,
            socket.kernel_drops,
        ),
        Account::of("received by the session, and handled by its admission", counts.received, door.handled),
        Account::of("made ready for the visitor, and sent or failed", made_ready, counts.sent + counts.failures.in_all()),
        Account::with_drops("sent to the visitor, and received or dropped by the kernel", counts.sent, visits.received, visits.kernel_drops),
    ]
}

/// How it ended, if otherwise than by being stopped.
pub(super) fn fault(report: &Report) -> Option<String> {
    match report.summary.ending {
        Ending::Interrupted(_) => None,
        Ending::Complete => Some("the scene came to its end".to_owned()),
        Ending::Diverged(at) => Some(format!("the scene diverged at {at}")),
    }
}
