//! The loop with an artificial clock, which moves by readings and by waits. Packets arrive at the instants of a script.

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::fs::File;
use std::io;
use std::os::fd::{AsFd as _, BorrowedFd};
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use cohaptic_linkfile::link_from_keys;
use cohaptic_linkfile::router::Side;
use cohaptic_realtime::{Clock, Pacing};
use cohaptic_router::{Device, Framing, Packet, Router, RunError, Sent};
use cohaptic_units::Instant;

use crate::support::{file, udp_bytes};

/// Instant \[ns\], and the packet that arrived or left then.
type At = (u64, Vec<u8>);

type Log = Rc<RefCell<Vec<At>>>;

/// The artificial clock, and the packets still to arrive at each side.
struct World {
    now: Cell<u64>,
    /// Time for reading the clock \[ns\].
    step: u64,
    /// Lateness of each wake-up \[ns\].
    late: u64,
    coming: [RefCell<VecDeque<At>>; 2],
    /// Instant at which `stop` is set \[ns\].
    stop_at: Cell<u64>,
    stop: AtomicBool,
}

impl World {
    fn next(&self) -> Option<u64> {
        self.coming.iter().filter_map(|coming| coming.borrow().front().map(|(at, _)| *at)).min()
    }
}

#[derive(Clone)]
struct Watch(Rc<World>);

impl Clock for Watch {
    fn now(&self) -> Instant {
        self.0.now.set(self.0.now.get() + self.0.step);
        self.0.stop.fetch_or(self.0.now.get() >= self.0.stop_at.get(), Ordering::Relaxed);
        Instant::from_nanos(self.0.now.get())
    }

    fn block(&self, until: Option<Instant>, _readable: &[BorrowedFd<'_>]) -> io::Result<bool> {
        let until = until.expect("the loop never waits for ever").as_nanos();
        let readable = self.0.next().is_some_and(|next| next <= until);
        let wake = if readable { self.0.next().unwrap() } else { until };
        self.0.now.set(self.0.now.get().max(wake) + self.0.late);
        Ok(readable)
    }
}

struct Wire {
    side: usize,
    world: Rc<World>,
    sent: Log,
    takes: Sent,
    fd: File,
}

impl Device for Wire {
    fn readable(&self) -> BorrowedFd<'_> {
        self.fd.as_fd()
    }

    fn receive(&mut self, packets: &mut Vec<Packet>) -> io::Result<bool> {
        let mut coming = self.world.coming[self.side].borrow_mut();
        if coming.front().is_none_or(|(at, _)| *at > self.world.now.get()) {
            return Ok(false);
        }
        let (_, bytes) = coming.pop_front().unwrap();
        if bytes.is_empty() {
            return Err(io::Error::other("unplugged"));
        }
        packets.push(Packet::new(bytes, Framing::Ip));
        Ok(true)
    }

    fn send(&mut self, packets: &[Arc<Packet>]) -> (usize, Sent) {
        if self.takes == Sent::Sent {
            self.sent.borrow_mut().push((self.world.now.get(), packets[0].bytes().to_vec()));
        }
        (1, self.takes)
    }
}

fn router(text: &str, step: u64, late: u64, coming: [Vec<At>; 2], takes: Sent, pacing: Pacing) -> (Router<Wire, Watch>, [Log; 2]) {
    let (router, logs, _) = router_and_world(text, step, late, coming, takes, pacing);
    (router, logs)
}

fn router_and_world(
    text: &str,
    step: u64,
    late: u64,
    coming: [Vec<At>; 2],
    takes: Sent,
    pacing: Pacing,
) -> (Router<Wire, Watch>, [Log; 2], Rc<World>) {
    let coming = coming.map(|coming| RefCell::new(coming.into()));
    let world = Rc::new(World { now: Cell::new(0), step, late, coming, stop_at: Cell::new(u64::MAX), stop: AtomicBool::new(false) });
    let logs = [Log::default(), Log::default()];
    let wire = |side: usize| Wire { side, world: Rc::clone(&world), sent: Rc::clone(&logs[side]), takes, fd: File::open("/dev/null").unwrap() };
    (Router::with(&file(text), [wire(0), wire(1)], Watch(Rc::clone(&world)), pacing), logs, world)
}

const DELAY: &str = "router = { default = \"x\" }\nlinks = { x = { delay = \"5ms\" } }";
const SECOND: u64 = 1_000_000_000;

fn every_millisecond(count: u64) -> Vec<At> {
    (0..count).map(|number| (number * 1_000_000 + 500_000, udp_bytes([number as u16, 9], &[]))).collect()
}

fn run(router: &mut Router<Wire, Watch>) {
    router.run(&AtomicBool::new(false), Some(Instant::from_nanos(SECOND)), Duration::from_millis(100), |_| ()).unwrap();
}

#[test]
fn a_late_system_makes_packets_late_but_lateness_does_not_add_up() {
    // Wake-ups are later than the longest margin, so learning cannot compensate for the lateness.
    let (mut router, logs) = router(DELAY, 0, 180_000, [every_millisecond(100), Vec::new()], Sent::Sent, Pacing::Sleep);
    run(&mut router);
    let left = logs[1].borrow();
    assert_eq!(left.len(), 100);
    for (number, (at, bytes)) in left.iter().enumerate() {
        // The packet is read 180 µs after its arrival, which is then its instant, and written at most 180 µs after its departure.
        let came = number as u64 * 1_000_000 + 500_000;
        assert!((came + 5_180_000..=came + 5_360_000).contains(at), "{number} left at {at}");
        assert_eq!(u16::from_be_bytes([bytes[20], bytes[21]]), number as u16);
    }
    let error = router.release_error();
    assert_eq!(error.count, 100);
    // The bound includes the three digits of the histogram.
    assert!(error.max <= Duration::from_nanos(180_200), "{error:?}");
    // Lateness counts from the departure, 5 ms after the reading, until the packet is written.
    let late: u64 = left.iter().zip(0_u64..).map(|((at, _), number)| at - (number * 1_000_000 + 500_000 + 180_000 + 5_000_000)).sum();
    assert!(late > 0);
    assert_eq!(error.sum, Duration::from_nanos(late));
    // Each packet has 20 bytes of IPv4 and 8 of UDP.
    assert_eq!(router.report().written.map(|written| (written.packets, written.bytes)), [(0, 0), (100, 2800)]);
    assert_eq!((router.report().packets(), router.report().dropped()), (100, 0));
}

/// While the thread spins, the router reads an arriving packet at once, and departures are on time to a few readings of the clock.
#[test]
fn spinning_neither_makes_departures_late_nor_packets_wait() {
    let margin = Duration::from_micros(120);
    // The second packet arrives 60 µs before the departure of the first one, in the middle of the margin.
    let coming = vec![(1_000_000, udp_bytes([1, 9], &[])), (5_950_000, udp_bytes([2, 9], &[]))];
    let (mut router, logs) = router(DELAY, 50, 10_000, [coming, Vec::new()], Sent::Sent, Pacing::Spin { margin });
    run(&mut router);
    let left: Vec<u64> = logs[1].borrow().iter().map(|(at, _)| *at).collect();
    assert!((6_010_000..6_012_000).contains(&left[0]) && (10_950_000..10_953_000).contains(&left[1]), "{left:?}");
    assert!(router.release_error().max < Duration::from_micros(1), "{:?}", router.release_error());
}

#[test]
fn a_device_without_room_is_not_waited_for() {
    for (takes, expected) in [(Sent::Full, [1, 0, 0]), (Sent::TooLong, [0, 1, 0]), (Sent::Refused, [0, 0, 1])] {
        let (mut router, _) = router(DELAY, 0, 0, [every_millisecond(1), Vec::new()], takes, Pacing::Sleep);
        run(&mut router);
        let report = router.report();
        let written = report.written[1];
        assert_eq!(([written.full, written.too_long, written.refused], written.packets, report.dropped()), (expected, 0, 1));
    }
}

#[test]
fn a_device_that_is_gone_ends_the_run_and_is_named() {
    let (mut router, _) = router(DELAY, 0, 0, [Vec::new(), vec![(1_000, Vec::new())]], Sent::Sent, Pacing::Sleep);
    let error = router.run(&AtomicBool::new(false), None, SECOND_LONG, |_| ()).unwrap_err();
    assert!(matches!(error, RunError::Device { side: Side::Right, .. }));
    assert_eq!(error.to_string(), "right: cannot read the device: unplugged");
}

const SECOND_LONG: Duration = Duration::from_secs(1);

#[test]
fn it_looks_up_as_often_as_asked_and_links_can_be_changed_then() {
    let (mut router, logs) = router(DELAY, 0, 0, [every_millisecond(100), Vec::new()], Sent::Sent, Pacing::Sleep);
    let mut looks = Vec::new();
    let until = Some(Instant::from_nanos(SECOND / 5));
    router
        .run(&AtomicBool::new(false), until, Duration::from_millis(50), |router| {
            looks.push(router.report().elapsed.as_nanos());
            if looks.len() == 1 {
                router.set_link("x", Some(Side::Left), &link_from_keys(&["loss=100%".to_owned()]).unwrap()).unwrap();
            }
        })
        .unwrap();
    // The first two looks wait for the packet that leaves half a millisecond later, and the last look is the one at the end.
    assert_eq!(looks, [50_500_000, 100_500_000, 150_500_000, 200_000_000]);
    // Of 100 packets, 51 arrived before the change.
    assert_eq!(logs[1].borrow().len(), 51);
    assert_eq!(router.report().dropped(), 49);
}

#[test]
fn a_stop_is_noticed() {
    let (mut router, _) = router(DELAY, 0, 0, [Vec::new(), Vec::new()], Sent::Sent, Pacing::Sleep);
    let stop = AtomicBool::new(false);
    let mut looks = 0;
    router
        .run(&stop, Some(Instant::from_nanos(SECOND)), Duration::from_millis(10), |_| {
            looks += 1;
            stop.store(looks == 3, Ordering::Relaxed);
        })
        .unwrap();
    assert_eq!(looks, 4, "and a last look at the end");
}

/// No packet arrives, nothing is due, and the next look is an hour away.
#[test]
fn a_stop_is_noticed_however_seldom_it_is_looked_at() {
    let (mut router, _, world) = router_and_world(DELAY, 0, 0, [Vec::new(), Vec::new()], Sent::Sent, Pacing::Sleep);
    world.stop_at.set(SECOND);
    let mut looks = 0;
    router.run(&world.stop, Some(Instant::from_nanos(3600 * SECOND)), Duration::from_secs(3600), |_| looks += 1).unwrap();
    assert_eq!((router.report().elapsed, looks), (Instant::from_nanos(SECOND), 1), "it wakes every 50 ms, and so at that instant");
}
