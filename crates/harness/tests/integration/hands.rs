//! Live sessions with peers whose device is real and held by a person.

use std::convert::Infallible;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use cohaptic_harness::live::{LiveDevice, LiveScene, Presence};
use cohaptic_harness::{NoObserver, Observer, TickRow};
use cohaptic_peer::State;
use cohaptic_units::Instant;

use crate::remote::millis;
use crate::scenes::{Written, read};

const COUPLING: f64 = 900.0;

/// Forces \[N\] that a device was told to hold, with the instants.
type HeldForces = Arc<Mutex<Vec<(Instant, [f64; 3])>>>;

/// Device whose position follows a script, and which records the forces that it is told to hold.
struct Told {
    /// Position along x \[m\] at a millisecond; `None` while nobody holds the device.
    shows: fn(u64) -> Option<f64>,
    held: HeldForces,
}

impl LiveDevice for Told {
    fn read(&mut self, now: Instant) -> Option<State<3>> {
        (self.shows)(now.as_nanos() / 1_000_000).map(|x| State { position: [x, 99.0, 99.0], velocity: [0.0, 99.0, 99.0] })
    }

    fn hold(&mut self, now: Instant, _span: Duration, coupling_force: [f64; 3]) {
        self.held.lock().unwrap().push((now, coupling_force));
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
        Some(Box::new(Told { shows, held: Arc::clone(&device) }))
    });
    let mut forces = Forces::default();
    let Ok(()) = live.handle_timeout(millis(2500), &mut forces);
    let held = held.lock().unwrap().clone();
    (forces, held, live)
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
    // What is felt is what was computed, at the tick at which it was.
    assert!(held.iter().zip(&forces.0).all(|((at, force), (tick, computed, _))| at == tick && *force == [*computed, 0.0, 0.0]));
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
    let mut changes = 0;
    for (tick, ((at, force), (_, computed, x))) in (0_u64..).zip(held.iter().zip(&forces.0)) {
        let exchange = tick / 4 * 4;
        assert_eq!((*at, force[0]), (millis(tick), forces.0[usize::try_from(exchange).unwrap()].1), "tick {tick}");
        // The pull of a hand that has just taken hold is whole after a quarter of a second.
        if tick >= 300 {
            assert!((computed - COUPLING * (read_at(tick - 4) - x)).abs() < 1e-9, "tick {tick}: {computed} N");
            changes += usize::from(tick > exchange && computed.to_bits() != force[0].to_bits());
        }
    }
    assert!(changes > 1000, "{changes}");
}

#[test]
fn a_session_that_ends_lets_go_of_every_device() {
    let (_, held, mut live) = run(|_| Some(0.05));
    assert!(held.last().unwrap().1[0].abs() > 0.0);
    let Written { scene, .. } = duo();
    let held = Arc::new(Mutex::new(Vec::new()));
    let Ok(()) = live.stop(millis(2600), &mut NoObserver);
    let mut live = LiveScene::new(&scene, |_| Some(Box::new(Told { shows: |_| Some(0.05), held: Arc::clone(&held) })));
    let Ok(()) = live.stop(millis(900), &mut NoObserver);
    assert_eq!(held.lock().unwrap().last(), Some(&(millis(900), [0.0; 3])));
    let mut live = LiveScene::new(&scene, |_| Some(Box::new(Told { shows: |_| Some(0.05), held: Arc::clone(&held) })));
    let Ok(()) = live.handle_timeout(millis(3000), &mut NoObserver);
    assert_eq!(held.lock().unwrap().last().unwrap().1, [0.0; 3]);
}
