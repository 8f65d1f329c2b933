//! The loop with an artificial clock, around a line that delays packets. The line logs each reading, each instant told and each sending.

mod line;

use std::rc::Rc;

use super::*;
use line::{Did, Line, World};

const MICRO: u64 = 1000;
const MILLI: u64 = 1_000_000;

#[test]
fn departures_are_made_ready_ahead_and_leave_on_time() {
    let mut line = Line::<{ 3 * MICRO }, false>::new(50, 10 * MICRO, [MILLI]);
    line.run(Pacing::SPIN, 10 * MILLI);
    let due = 6 * MILLI;
    let sent = line.departures()[0];
    assert!((due..due + 200).contains(&sent), "sent at {sent}");
    let told = line.when(|did| did == Did::Told(due));
    assert!(told.len() == 1 && told[0] < due, "told at {told:?}");
    let readings = line.when(|did| did == Did::Read(0));
    assert!(readings.iter().filter(|at| (due - 50 * MICRO..due - 3 * MICRO).contains(*at)).count() > 100, "it reads while it spins");
    assert_eq!(readings.iter().filter(|at| (due - 3 * MICRO + 100..due).contains(*at)).count(), 0, "it reads nothing shortly before");
}

#[test]
fn a_packet_that_comes_while_it_spins_is_read_at_once() {
    let mut line = Line::<{ 3 * MICRO }, false>::new(50, 10 * MICRO, [MILLI, 6 * MILLI - 60 * MICRO]);
    line.run(Pacing::SPIN, 20 * MILLI);
    let read = line.when(|did| did == Did::Read(1));
    assert!((6 * MILLI - 60 * MICRO..6 * MILLI - 59 * MICRO).contains(&read[1]), "{read:?}");
    let sent = line.departures();
    assert!(sent.len() == 2 && sent[0] < 6 * MILLI + 200 && sent[1] < 11 * MILLI - 59 * MICRO, "{sent:?}");
}

#[test]
fn without_an_instant_ahead_nothing_is_read_or_told_before_the_deadline() {
    let mut line = Line::<0, false>::new(50, 10 * MICRO, [MILLI]);
    line.run(Pacing::SPIN, 10 * MILLI);
    let due = 6 * MILLI;
    let last_moments = line.log.iter().filter(|(at, _)| (due - 100 * MICRO..due).contains(at)).count();
    assert_eq!(last_moments, 0, "{:?}", line.log);
    assert!(line.log.iter().all(|(at, did)| !matches!(did, Did::Told(told) if told > at)));
    assert!((due..due + 300).contains(&line.departures()[0]));
}

/// A hundred packets wait, and one reading takes ten.
#[test]
fn time_passes_only_up_to_the_packets_that_were_read() {
    let mut line = Line::<{ 3 * MICRO }, false>::new(50, 0, (0..100).map(|number| number * MICRO));
    line.batch = 10;
    line.world.now.set(MILLI);
    line.run(Pacing::Sleep, 20 * MILLI);
    let log: Vec<Did> = line.log.iter().map(|(_, did)| *did).collect();
    let told: Vec<Did> = log.windows(2).filter(|pair| pair[0] == Did::Read(10)).map(|pair| pair[1]).collect();
    assert_eq!(told, (1..=10).map(|batch| Did::Told((batch * 10 - 1) * MICRO)).collect::<Vec<_>>());
    assert_eq!(line.sent, 100);
}

#[test]
fn what_is_left_to_be_made_ready_leaves_before_the_thread_sleeps() {
    let mut line = Line::<{ 3 * MICRO }, false>::new(50, 0, [MILLI; 50]);
    line.ready_at_once = 20;
    line.run(Pacing::Sleep, 20 * MILLI);
    let sent: Vec<Did> = line.log.iter().map(|(_, did)| *did).filter(|did| matches!(did, Did::Sent(_))).collect();
    assert_eq!(sent, [Did::Sent(20), Did::Sent(20), Did::Sent(10)]);
    let sent = line.departures();
    assert!(sent[0] >= 6 * MILLI && sent[2] < 6 * MILLI + MICRO, "{sent:?}");
}

/// Returns the instants of looks every 10 ms, and of departures, of a line with a packet every `gap` \[ns\].
fn looks(gap: u64) -> (Vec<u64>, Vec<u64>) {
    let mut line = Line::<{ 3 * MICRO }, false>::new(0, 0, (1..100 * MILLI / gap).map(|number| number * gap));
    let schedule = Schedule { pacing: Pacing::Sleep, end: Some(Instant::from_nanos(100 * MILLI)), look_every: Duration::from_millis(10) };
    let mut looks = Vec::new();
    drive(&mut line, &schedule, |_, now| {
        looks.push(now.as_nanos());
        ControlFlow::Continue(())
    })
    .unwrap();
    let sent = line.departures();
    (looks, sent)
}

#[test]
fn a_look_waits_for_a_deadline_that_is_near_and_for_no_other() {
    // Departures every 0.7 ms: each look but the first follows a departure.
    let (at, sent) = looks(700 * MICRO);
    assert!((9..=10).contains(&at.len()), "{at:?}");
    assert!(at[1..].iter().all(|at| sent.contains(at) || at % (700 * MICRO) == 0), "{at:?}");
    // Departures every 8 ms: a look without a departure in the next millisecond gets a wake-up of its own.
    let (at, sent) = looks(8 * MILLI);
    assert!((9..=10).contains(&at.len()), "{at:?}");
    assert!(at.windows(2).all(|pair| pair[1] - pair[0] <= 11 * MILLI), "{at:?}");
    assert!(at.iter().any(|at| !sent.contains(at)), "{at:?}");
}

#[test]
fn it_ends_at_its_end_when_the_program_is_over_and_when_a_look_breaks() {
    let mut line = Line::<0, false>::new(0, 0, []);
    line.run(Pacing::Sleep, 3_500 * MILLI);
    assert_eq!(line.world.now.get(), 3_500 * MILLI);
    let mut line = Line::<0, false>::new(0, 0, [MILLI, 2 * MILLI]);
    line.over_after = 1;
    line.run(Pacing::Sleep, 1_000 * MILLI);
    assert_eq!((line.world.now.get(), line.sent), (6 * MILLI, 1));
    let mut line = Line::<0, false>::new(0, 0, []);
    let mut looks = 0;
    let schedule = Schedule { pacing: Pacing::Sleep, end: None, look_every: Duration::from_secs(1) };
    drive(&mut line, &schedule, |_, _| {
        looks += 1;
        if looks == 3 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })
    .unwrap();
    assert_eq!(line.world.now.get(), 2_000 * MILLI);
}

/// Returns the number of rests with 100,000 packets a second for 20 ms.
fn rests<const RESTS: bool>(pacing: Pacing) -> usize {
    let mut line = Line::<{ 3 * MICRO }, RESTS>::new(50, 0, (0..2000).map(|number| number * 10 * MICRO));
    line.run(pacing, 40 * MILLI);
    assert_eq!(line.sent, 2000);
    line.world.slept.borrow().iter().filter(|(_, for_packets)| !for_packets).count()
}

#[test]
fn under_load_it_rests_if_the_program_may_and_the_thread_sleeps() {
    // 20 ms of arrivals and 5 ms until the last departure, in pieces of 50 µs.
    assert!((400..=520).contains(&rests::<true>(Pacing::Sleep)));
    assert_eq!(rests::<true>(Pacing::SPIN), 0);
    assert_eq!(rests::<false>(Pacing::Sleep), 0);
}

#[test]
fn an_error_ends_the_run() {
    struct Broken(Rc<World>);
    impl Driven for Broken {
        type Clock = Rc<World>;
        type Error = io::Error;
        const AHEAD: Option<Duration> = None;
        const RESTS: bool = false;
        fn clock(&self) -> &Rc<World> {
            &self.0
        }
        fn readable(&self) -> impl IntoIterator<Item = BorrowedFd<'_>> {
            None
        }
        fn receive(&mut self, _now: Instant) -> io::Result<Received> {
            Err(io::Error::other("unplugged"))
        }
        fn poll_timeout(&self) -> Option<Instant> {
            None
        }
        fn handle_timeout(&mut self, _now: Instant) -> bool {
            false
        }
        fn send(&mut self) -> u64 {
            0
        }
    }
    let world = Line::<0, false>::new(0, 0, []).world;
    let schedule = Schedule { pacing: Pacing::Sleep, end: None, look_every: Duration::MAX };
    let error = drive(&mut Broken(world), &schedule, |_, _| ControlFlow::Continue(())).unwrap_err();
    assert_eq!(error.to_string(), "unplugged");
}
