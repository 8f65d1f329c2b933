//! Live sessions with peers whose device is real and held by a person.

use std::convert::Infallible;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use cohaptic_device::{Description, Device, GatedForce, Reading, Stopper, ZeroCause};
use cohaptic_harness::live::{LiveScene, Presence};
use cohaptic_harness::{NoObserver, Observer, TickRow};
use cohaptic_units::Instant;

use crate::remote::millis;
use crate::scenes::{Written, read};

const COUPLING: f64 = 900.0;
/// Greatest force of the device \[N\].
const FORCE: f64 = 3.0;

/// Forces on the hand \[N\] that a device was told to hold, with the instants.
type HeldForces = Arc<Mutex<Vec<(Instant, [f64; 3])>>>;

/// Device whose position follows a script, and which records the forces that it is told to hold.
struct Told {
    /// Position along x \[m\] at a millisecond; `None` while nobody holds the device.
    shows: fn(u64) -> Option<f64>,
    held: HeldForces,
    stopper: Stopper,
}

impl Device for Told {
    fn description(&self) -> Description {
        Description { name: "told".to_owned(), motions: 1, force: FORCE, period: Duration::from_millis(1) }
    }

    fn stopper(&self) -> Stopper {
        self.stopper.clone()
    }

    fn read(&mut self, now: Instant) -> Option<Reading> {
        (self.shows)(now.as_nanos() / 1_000_000).map(|x| Reading { position: [x, 99.0, 99.0], velocity: [0.0, 99.0, 99.0] })
    }

    fn hold(&mut self, now: Instant, _span: Duration, force: GatedForce) {
        self.held.lock().unwrap().push((now, force.newtons()));
    }
}

fn duo() -> Written {
    duo_with("")
}

/// Two peers, with further keys of their devices.
fn duo_with(device: &str) -> Written {
    read(format!(
        "scene = {{ duration = \"3s\" }}\nobject = {{ mass = 0.4, damping = 2.0 }}\n\
         coordination = {{ strategy = \"average-position\", stiffness = 500.0, damping = 5.0, update = \"8ms\" }}\n\
         peer = {{ device = {{ mass = 0.1, damping = 5.0{device} }}, coupling = {{ stiffness = {COUPLING}, damping = 0.0 }} }}\n\
         peers = [{{ name = \"here\", contact = \"none\" }}, {{ name = \"hand\", kind = \"falcon\" }}]\nlink = {{ delay = \"4ms\" }}\n"
    ))
}

/// Numbers of each tick. First of the peer with the device: instant, coupling force FC \[N\] and position of the copy \[m\]. Then of the simulated peer: the
/// coordination force FT \[N\].
#[derive(Default)]
struct Forces(Vec<(Instant, f64, f64)>, Vec<f64>);

impl Forces {
    /// Returns the coupling force of the peer with the device at a tick \[N\].
    fn computed(&self, tick: u64) -> f64 {
        self.0[usize::try_from(tick).unwrap()].1
    }
}

impl Observer for Forces {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        if row.peer == 1 {
            self.0.push((row.at, row.coupling_force[0], row.object.position[0]));
        } else {
            self.1.push(row.coordination_force[0]);
        }
        Ok(())
    }
}

fn run(shows: fn(u64) -> Option<f64>) -> (Forces, Vec<(Instant, [f64; 3])>, LiveScene) {
    run_of(&duo(), shows)
}

fn run_of(Written { scene, .. }: &Written, shows: fn(u64) -> Option<f64>) -> (Forces, Vec<(Instant, [f64; 3])>, LiveScene) {
    let held = Arc::new(Mutex::new(Vec::new()));
    let device = Arc::clone(&held);
    let mut live = LiveScene::new(scene, |place| {
        assert_eq!(place, 1, "only the falcon has one");
        Some(Box::new(Told { shows, held: Arc::clone(&device), stopper: Stopper::default() }))
    });
    let mut forces = Forces::default();
    let Ok(()) = live.handle_timeout(millis(2500), &mut forces);
    let held = held.lock().unwrap().clone();
    (forces, held, live)
}

/// Asserts that a device was told at each millisecond to hold the opposite of the computed force \[N\], within the limits of the device. `None`: no reading.
fn felt(held: &[(Instant, [f64; 3])], computed: impl Fn(u64) -> Option<f64>) {
    let mut last = 0.0_f64;
    for (tick, (at, [x, y, z])) in (0_u64..).zip(held) {
        // At most 1 N in a millisecond, and nothing at the first tick, before which nothing is known.
        let expected = computed(tick).map_or(0.0, |force| (-force).clamp(-FORCE, FORCE).clamp(last - 1.0, last + 1.0));
        let expected = if tick == 0 { 0.0 } else { expected };
        assert!(*at == millis(tick) && (x - expected).abs() < 1e-9 && (*y, *z) == (0.0, 0.0), "tick {tick}: {x} N, expected {expected} N");
        last = *x;
    }
}

#[test]
fn a_device_that_is_never_read_feels_and_exerts_nothing() {
    for shows in [|_| None, |_| Some(f64::NAN), |_| Some(f64::INFINITY)] as [fn(u64) -> Option<f64>; 3] {
        let (forces, held, live) = run(shows);
        assert!(held.iter().all(|(_, force)| *force == [0.0; 3]));
        assert_eq!(held.len(), 2501);
        assert!(forces.0.iter().all(|(_, force, _)| *force == 0.0) && forces.1.iter().all(|force| *force == 0.0));
        assert_eq!((live.presence(1), live.seat_stats(1).unwrap().joined), (Some(Presence::Absent), 0));
    }
}

/// Homed at 300 ms, 5 cm off; pulled out at 1000 ms; back 5 cm on the other side at 1200 ms, when its weight is 1 − 101/250; gone again at 1900 ms.
#[test]
fn a_device_takes_hold_and_lets_go_little_by_little() {
    let (forces, held, live) = run(|t| match t {
        300..1000 => Some(0.05),
        1200..1900 => Some(-0.05),
        _ => None,
    });
    for (tick, pair) in forces.0.windows(2).enumerate() {
        let ((_, f0, x0), (at, f, x)) = (pair[0], pair[1]);
        // No damping in this coupling: what fades is KC·(w's part + the way from one place to the other), the rest is the copy's motion.
        let bound = COUPLING * ((0.05 + x0.abs().max(x.abs()) + 0.1) / 250.0 + (x - x0).abs());
        assert!((f - f0).abs() <= bound + 1e-9, "tick {tick}, at {at}: from {f0} N to {f} N");
    }
    // The hand feels the force that was computed, at the same tick, as far as the gate admits the force. A hand without a device feels nothing.
    let there = |t: u64| (300..1000).contains(&t) || (1200..1900).contains(&t);
    felt(&held, |t| there(t).then(|| forces.computed(t)));
    assert!(held.iter().any(|(_, [x, ..])| (x - FORCE).abs() < 1e-9) && held.iter().any(|(_, [x, ..])| (x + FORCE).abs() < 1e-9));
    let stats = live.gate_stats(1).unwrap();
    let absent = stats.zeroed[ZeroCause::NotReady.index()];
    assert_eq!((absent, stats.zeroed.iter().sum::<u64>()), (2501 - 1400, absent));
    assert!(stats.limited > 100 && live.gate_stats(0).is_none());
    let at = |t: usize| forces.0[t];
    assert_eq!(at(299).1, 0.0);
    assert_eq!(at(300).1, 0.0);
    // Half of the pull after half of the time.
    assert!((at(425).1 - 0.5 * COUPLING * (0.05 - at(425).2)).abs() < 1e-9);
    assert!((at(800).1 - COUPLING * (0.05 - at(800).2)).abs() < 1e-9);
    // Last read at 999 ms; falling from 1099 ms; at 1200 ms it has 1 − 101/250 and has not moved from where it was.
    assert!((at(1200).1 - (1.0 - 101.0 / 250.0) * COUPLING * (0.05 - at(1200).2)).abs() < 1e-9);
    assert!((at(1800).1 - COUPLING * (-0.05 - at(1800).2)).abs() < 1e-9);
    assert_eq!(at(2400).1, 0.0);
    assert_eq!(live.seat_stats(1).unwrap().joined, 2);
    assert_eq!(live.presence(1), Some(Presence::Stale(millis(1999))));
}

/// Position of a hand that moves on by 1 mm every 4 ms \[m\].
fn read_at(millisecond: u64) -> f64 {
    0.001 * f64::from(u32::try_from(millisecond / 4).unwrap())
}

/// Exchanges every 4 ms, with readings of the exchange before. The device has a new force at each exchange, which is FC of this tick. FC acts on the copy at
/// each tick.
#[test]
fn a_slow_device_is_told_a_new_force_at_its_exchanges_alone() {
    let (forces, held, _) = run_of(&duo_with(", exchange-every = 4, exchange-age = 1"), |t| Some(read_at(t)));
    let at_exchange = |tick: u64| forces.computed(tick / 4 * 4);
    felt(&held, |tick| Some(at_exchange(tick)));
    let mut changes = 0;
    for (tick, (_, computed, x)) in (0_u64..).zip(&forces.0) {
        // The pull of a hand that has just taken hold is whole after a quarter of a second.
        if tick >= 300 {
            assert!((computed - COUPLING * (read_at(tick - 4) - x)).abs() < 1e-9, "tick {tick}: {computed} N");
            changes += usize::from(computed.to_bits() != at_exchange(tick).to_bits());
        }
    }
    assert!(changes > 1000, "{changes}");
}

/// Position of a hand that goes to and fro between two places, each for 100 ms \[m\].
fn to_and_fro(millisecond: u64) -> f64 {
    if (millisecond / 100).is_multiple_of(2) { 0.05 } else { -0.05 }
}

#[test]
fn a_session_that_ends_lets_go_of_every_device() {
    let stopper = Stopper::default();
    let (_, held, mut live) = run(|_| Some(0.05));
    assert!(held.last().unwrap().1[0].abs() > 0.0);
    let Written { scene, .. } = duo();
    let held = Arc::new(Mutex::new(Vec::new()));
    let Ok(()) = live.stop(millis(2600), &mut NoObserver);
    let mut live = LiveScene::new(&scene, |_| Some(Box::new(Told { shows: |_| Some(0.05), held: Arc::clone(&held), stopper: stopper.clone() })));
    let Ok(()) = live.stop(millis(900), &mut NoObserver);
    assert_eq!(held.lock().unwrap().last(), Some(&(millis(900), [0.0; 3])));
    assert!(stopper.is_stopped());
    let stopper = Stopper::default();
    let mut live =
        LiveScene::new(&scene, |_| Some(Box::new(Told { shows: |t| Some(to_and_fro(t)), held: Arc::clone(&held), stopper: stopper.clone() })));
    let Ok(()) = live.handle_timeout(millis(2999), &mut NoObserver);
    assert!(!stopper.is_stopped());
    assert!(held.lock().unwrap().last().unwrap().1[0].abs() > 0.0, "{:?}", held.lock().unwrap().last());
    let Ok(()) = live.handle_timeout(millis(3000), &mut NoObserver);
    assert_eq!(held.lock().unwrap().last().unwrap().1, [0.0; 3]);
    assert!(stopper.is_stopped());
}

/// The program of the session stops the device from another thread, and a panic of the loop drops the scene.
#[test]
fn stoppers_and_panics_stop_a_device() {
    let Written { scene, .. } = duo();
    let (held, stopper) = (Arc::new(Mutex::new(Vec::new())), Stopper::default());
    let mut live = LiveScene::new(&scene, |_| Some(Box::new(Told { shows: |_| Some(0.05), held: Arc::clone(&held), stopper: stopper.clone() })));
    let Ok(()) = live.handle_timeout(millis(900), &mut NoObserver);
    let theirs = stopper.clone();
    std::thread::spawn(move || theirs.stop()).join().unwrap();
    let before = held.lock().unwrap().len();
    let Ok(()) = live.handle_timeout(millis(1000), &mut NoObserver);
    assert!(held.lock().unwrap()[before..].iter().all(|(_, force)| *force == [0.0; 3]));
    assert_eq!(live.gate_stats(1).unwrap().zeroed[ZeroCause::Stopped.index()], 100);

    let stopper = Stopper::default();
    let mut live = LiveScene::new(&scene, |_| Some(Box::new(Told { shows: |_| Some(0.05), held: Arc::clone(&held), stopper: stopper.clone() })));
    let panicked = std::panic::catch_unwind(std::panic::AssertUnwindSafe(move || {
        let Ok(()) = live.handle_timeout(millis(100), &mut NoObserver);
        panic!("in the loop");
    }));
    assert!(panicked.is_err() && stopper.is_stopped());
}

/// Ticks that come late are computed in quick succession. The hand feels the changes by the clock: zero after a pause of more than 20 ms, and no change while
/// the clock stands.
#[test]
fn late_ticks_raise_the_force_by_the_clock() {
    let Written { scene, .. } = duo();
    let held: HeldForces = Arc::default();
    let mut live =
        LiveScene::new(&scene, |_| Some(Box::new(Told { shows: |t| Some(to_and_fro(t)), held: Arc::clone(&held), stopper: Stopper::default() })));
    let last = || held.lock().unwrap().last().unwrap().1[0].abs();
    for tick in 0..=510 {
        live.set_clock(millis(tick));
        let Ok(()) = live.handle_timeout(millis(tick), &mut NoObserver);
    }
    assert!((last() - FORCE).abs() < 1e-9, "{}", last());
    // 20 ms late: the force stays.
    live.set_clock(millis(530));
    let Ok(()) = live.handle_timeout(millis(530), &mut NoObserver);
    assert!((last() - FORCE).abs() < 1e-9, "{}", last());
    // 30 ms late: 30 ticks by a clock that stands.
    let before = held.lock().unwrap().len();
    live.set_clock(millis(560));
    let Ok(()) = live.handle_timeout(millis(560), &mut NoObserver);
    assert_eq!(held.lock().unwrap()[before..].iter().filter(|(_, force)| *force == [0.0; 3]).count(), 30);
    assert_eq!(live.gate_stats(1).unwrap().zeroed[ZeroCause::LoopLate.index()], 1);
    live.set_clock(Instant::from_nanos(562_500_000));
    let Ok(()) = live.handle_timeout(millis(562), &mut NoObserver);
    assert!((last() - 2.5).abs() < 1e-9, "{}", last());
}
