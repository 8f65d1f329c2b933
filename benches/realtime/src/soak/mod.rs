//! The soak: a live session and a relay run beside each other for an hour, and are looked at every minute.
//!
//! What must not happen in an hour: memory or open files grow, logical time parts from the clock on the wall, or something is lost without being counted.
//! The soak of [`flooded`] starts the programs themselves, and floods each of their ports meanwhile.

pub mod flooded;
mod live;
mod probe;
mod row;
mod stream;
mod verdict;

use std::error::Error;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use cohaptic_live::{SessionKey, SystemEntropy};
use cohaptic_realtime::{Clock as _, MonotonicClock, Pacer, Pacing, Wishes};
use cohaptic_units::Instant;

pub use live::Lag;
pub use row::{HEADER, Row};
pub use verdict::{Account, Judgement, MEMORY_BOUND, Verdict, judge};

use crate::scene::scene;
use crate::visitor::{Invitation, Visitor, Visits};
use live::{Live, LiveLook};
use stream::{Stream, StreamLook};

/// The place of the peer in another program: the last.
const VISITOR: u32 = 3;

/// How many peers there are.
const PEERS: usize = 4;

/// Of the control loop.
const TICK: Duration = Duration::from_millis(1);

/// What to do.
#[derive(Clone, Copy, Debug)]
pub struct SoakPlan {
    /// For how long.
    pub duration: Duration,
    /// How often to look.
    pub every: Duration,
    /// How long the peer in another program stays.
    pub stay: Duration,
    /// And how long it is away.
    pub away: Duration,
    /// What session and relay ask of the system. Locked memory would count as memory in use, touched or not.
    pub wishes: Wishes,
}

impl SoakPlan {
    /// A look every so often; the visitor stays for three minutes and is away for 20 s, or less in a short run, so that it comes at least three times.
    #[must_use]
    pub fn new(duration: Duration, every: Duration) -> Self {
        let stay = Duration::from_secs(180).min(duration / 4);
        let away = Duration::from_secs(20).min(duration / 10);
        Self { duration, every, stay, away, wishes: Wishes { lock_memory: false, ..Wishes::default() } }
    }
}

/// What came of it.
#[derive(Debug)]
pub struct Outcome {
    /// How long it lasted.
    pub elapsed: Duration,
    /// `true` if somebody ended it before its time.
    pub interrupted: bool,
    /// What was seen at each look.
    pub rows: Vec<Row>,
    /// The accounts at the end.
    pub accounts: Vec<Account>,
    /// Accounts that did not balance at some look, with its time; the first few.
    pub unbalanced: Vec<(Duration, Account)>,
    /// By how much logical time was ahead of the wall at the end for certain, and behind the moment at which the session was asked to stop; zero is right.
    pub at_end: [Duration; 2],
    /// For so long it is not known when the time of the session began.
    pub unknown: Duration,
    /// How the session ended, if otherwise than by being stopped.
    pub fault: Option<String>,
    /// What the visitor did.
    pub visits: Visits,
    /// What the system refused the session and the relay.
    pub refused: Vec<String>,
}

/// The number of accounts that do not balance and are kept.
const MOST_UNBALANCED: usize = 20;

/// Longer than anything is on its way; a loaded machine may need it to read what has come.
const SETTLING: Duration = Duration::from_secs(20);

/// Runs it. `interrupted` ends it early; `show` is given each row when it is there.
///
/// # Errors
///
/// If something cannot be had or has to give up: a socket, random bytes, a thread.
pub fn run(plan: &SoakPlan, interrupted: &AtomicBool, mut show: impl FnMut(&Row)) -> Result<Outcome, Box<dyn Error>> {
    let scene = scene("A soak", 11, PEERS, plan.duration * 2 + Duration::from_secs(3600))?;
    let key = SessionKey::generate(&mut SystemEntropy)?;
    let (live, stream) = (Live::start(&scene, key.clone(), plan.wishes)?, Stream::start(scene.links.between(0, 1), plan.wishes)?);
    let visitor = Visitor::start(Invitation { door: live.address, session: scene.seed, place: VISITOR, key, stay: plan.stay, away: plan.away });
    let clock = MonotonicClock::start();
    let mut looks = Looks { live: &live, stream: &stream, clock, rows: Vec::new(), unbalanced: Vec::new() };
    let (end, mut next) = (Instant::ZERO + plan.duration, Instant::ZERO + plan.every);
    while !interrupted.load(Ordering::Relaxed) && next <= end && wait(&clock, next, interrupted)? {
        next += plan.every;
        let Some(row) = looks.look() else { break };
        show(row);
    }
    let was_interrupted = interrupted.load(Ordering::Relaxed);
    visitor.hush();
    settle(&clock, &live, &stream, &visitor)?;
    if let Some(row) = looks.look() {
        show(row);
    }
    let Looks { rows, unbalanced, .. } = looks;
    let elapsed = clock.now() - Instant::ZERO;
    let live_end = live.stop()?;
    let stream_end = stream.end()?;
    let visits = visitor.end()?;
    let mut accounts = live::last_accounts(&live_end, &visits);
    accounts.extend(stream::last_accounts(&stream_end));
    let prepared = live_end.report.prepared.refused.iter().chain(&stream_end.report.prepared.refused);
    let mut refused: Vec<String> = prepared.map(ToString::to_string).collect();
    refused.sort();
    refused.dedup();
    Ok(Outcome {
        elapsed,
        interrupted: was_interrupted,
        rows,
        accounts,
        unbalanced,
        at_end: [live_end.elapsed.saturating_sub(live_end.ended), live_end.asked.saturating_sub(live_end.elapsed)],
        unknown: live_end.unknown,
        fault: live::fault(&live_end.report),
        visits,
        refused,
    })
}

/// Waits, and looks every tenth of a second whether somebody wants the end; whether nobody does.
fn wait(clock: &MonotonicClock, until: Instant, interrupted: &AtomicBool) -> std::io::Result<bool> {
    let mut pacer = Pacer::new(Pacing::Sleep);
    while clock.now() < until && !interrupted.load(Ordering::Relaxed) {
        pacer.wait(clock, Some(until.min(clock.now() + Duration::from_millis(100))), &[])?;
    }
    Ok(!interrupted.load(Ordering::Relaxed))
}

/// Nobody sends any more: waits until everything that was sent has been read and has left.
fn settle(clock: &MonotonicClock, live: &Live, stream: &Stream, visitor: &Visitor) -> std::io::Result<()> {
    let (mut pacer, until) = (Pacer::new(Pacing::Sleep), clock.now() + SETTLING);
    stream.hush();
    loop {
        // Long enough for a thread that was just told, on a machine with nothing else to do; on another one more is waited for below.
        pacer.wait(clock, Some(clock.now() + Duration::from_millis(200)), &[])?;
        let (sent, visited) = (stream.sent(), visitor.sent());
        let relayed = stream.probe.ask().is_some_and(|look| look.intake.offered >= sent && look.held == 0);
        let heard = live.probe.ask().is_some_and(|look| look.status.admission.is_some_and(|door| door.handled >= visited));
        if (relayed && heard && sent == stream.sent() && visited == visitor.sent()) || clock.now() >= until {
            return Ok(());
        }
    }
}

/// What was seen so far.
struct Looks<'a> {
    live: &'a Live,
    stream: &'a Stream,
    clock: MonotonicClock,
    rows: Vec<Row>,
    unbalanced: Vec<(Duration, Account)>,
}

impl Looks<'_> {
    /// One more row; `None` if the session or the relay has ended.
    fn look(&mut self) -> Option<&Row> {
        let (live, stream): (LiveLook, StreamLook) = (self.live.probe.ask()?, self.stream.probe.ask()?);
        let at = self.clock.now() - Instant::ZERO;
        let accounts = live::accounts(&live.status).into_iter().chain(stream::accounts(&stream));
        let unbalanced = accounts.filter(|account| !account.balances()).map(|account| (at, account));
        let room = MOST_UNBALANCED - self.unbalanced.len();
        self.unbalanced.extend(unbalanced.take(room));
        let row = Row::new(at, &live, &stream, self.rows.last());
        self.rows.push(row);
        self.rows.last()
    }
}
