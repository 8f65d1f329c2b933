//! A device of your own: a lever with one motor, at a board that answers each packet. The board is simulated here, and its exchange takes 1 ms, as over USB.
//!
//! A hand wants to push the lever to −20 mm, and a wall at 0 pushes back. Then the loop that makes the wall falls silent.
#![allow(clippy::print_stdout, clippy::disallowed_methods, reason = "the example prints, and a thread of a driver keeps time by a clock")]

use std::sync::{Arc, Mutex, PoisonError, TryLockError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant as Clock};

use cohaptic_device::{Description, Device, Gate, GatedForce, Limits, LimitsError, Moment, Reading, Stopper};
use cohaptic_units::Instant;

const MILLISECOND: Duration = Duration::from_millis(1);

/// Board of the lever, with the lever and a hand. Replace this part by the packets of your device.
struct Board {
    position: f64,
    velocity: f64,
}

impl Board {
    /// Sends a force \[N\], waits 1 ms for the answer, and returns position \[m\] and velocity \[m/s\].
    fn exchange(&mut self, force: f64) -> (f64, f64) {
        thread::sleep(MILLISECOND);
        // Hand: a spring of 200 N/m to −20 mm, and a damper of 5 N·s/m. Lever and hand have a mass of 0.2 kg.
        let hand = 200.0 * (-0.02 - self.position) - 5.0 * self.velocity;
        self.velocity += (force + hand) / 0.2 * MILLISECOND.as_secs_f64();
        self.position += self.velocity * MILLISECOND.as_secs_f64();
        (self.position, self.velocity)
    }
}

/// Data that the loop and the driver's thread share.
#[derive(Default)]
struct Shared {
    /// Newest force of the loop, and the time at which the force was asked for.
    asked: Mutex<Option<(GatedForce, Instant)>>,
    /// Newest answer of the board, and its time.
    answer: Mutex<Option<(Reading, Instant)>>,
}

/// Driver of the lever.
struct Lever {
    shared: Arc<Shared>,
    /// Newest answer that the loop has seen, and its time.
    latest: Option<(Reading, Instant)>,
    begun: Clock,
    stopper: Stopper,
    thread: Option<JoinHandle<()>>,
}

impl Lever {
    fn start(mut board: Board, limits: Limits) -> Result<Self, LimitsError> {
        let (shared, begun, stopper) = (Arc::new(Shared::default()), Clock::now(), Stopper::default());
        let (theirs, mut gate) = (Arc::clone(&shared), Gate::new(limits, stopper.clone())?);
        let thread = thread::spawn(move || {
            let mut reading_at = None;
            while !gate.is_stopped() {
                let asked = *theirs.asked.lock().unwrap_or_else(PoisonError::into_inner);
                // A lever has no homing, and its user needs no switch: ready and armed with the first answer.
                let setpoint_at = asked.map(|(_, at)| at);
                let moment = Moment { now: since(begun), ready: true, armed: true, reading_at, setpoint_at };
                let admitted = gate.admit(asked.map_or([0.0; 3], |(force, _)| force.newtons()), &moment);
                let (x, v) = board.exchange(admitted.force.newtons()[0]);
                reading_at = Some(since(begun));
                let reading = Reading { position: [x, 0.0, 0.0], velocity: [v, 0.0, 0.0] };
                *theirs.answer.lock().unwrap_or_else(PoisonError::into_inner) = Some((reading, since(begun)));
            }
            board.exchange(0.0);
        });
        Ok(Self { shared, latest: None, begun, stopper, thread: Some(thread) })
    }
}

/// Returns the time since `begun`, on the clock of the driver.
fn since(begun: Clock) -> Instant {
    Instant::ZERO + begun.elapsed()
}

/// Returns the guarded value without waiting; `None` while the other thread uses the value.
fn now_or_never<T: Copy>(mutex: &Mutex<T>) -> Option<T> {
    match mutex.try_lock() {
        Ok(value) => Some(*value),
        Err(TryLockError::Poisoned(poisoned)) => Some(*poisoned.into_inner()),
        Err(TryLockError::WouldBlock) => None,
    }
}

impl Device for Lever {
    fn description(&self) -> Description {
        Description { name: "lever".to_owned(), motions: 1, force: 4.0, period: MILLISECOND }
    }

    fn stopper(&self) -> Stopper {
        self.stopper.clone()
    }

    fn read(&mut self, _now: Instant) -> Option<Reading> {
        // While the thread writes an answer, the one before is new enough.
        self.latest = now_or_never(&self.shared.answer).flatten().or(self.latest);
        let (reading, at) = self.latest?;
        // A lever whose board has not answered for 20 ms is absent.
        (since(self.begun).saturating_duration_since(at) <= Duration::from_millis(20)).then_some(reading)
    }

    fn hold(&mut self, _now: Instant, _span: Duration, force: GatedForce) {
        // While the thread copies the force, the force of the next tick is soon enough.
        if let Ok(mut asked) = self.shared.asked.try_lock() {
            *asked = Some((force, since(self.begun)));
        }
    }
}

impl Drop for Lever {
    fn drop(&mut self) {
        self.stop();
        if let Some(thread) = self.thread.take() {
            // The panic hook has printed the message of a panic in the thread.
            let _ = thread.join();
        }
    }
}

fn run() -> Result<String, LimitsError> {
    let mut lever = Lever::start(Board { position: 0.0, velocity: 0.0 }, Limits::DEFAULT)?;
    // The loop has a gate of its own, with the greatest force of the device.
    let mut gate = Gate::new(Limits { force: lever.description().force, ..Limits::DEFAULT }, lever.stopper())?;
    let begun = Clock::now();
    let held = loop {
        let now = since(begun);
        let reading = lever.read(now);
        // A wall of 600 N/m at 0.
        let wall = reading.map_or(0.0, |reading| -600.0 * reading.position[0].min(0.0));
        let moment = Moment { now, ready: reading.is_some(), armed: true, reading_at: reading.map(|_| now), setpoint_at: Some(now) };
        let force = gate.admit([wall, 0.0, 0.0], &moment).force;
        lever.hold(now, MILLISECOND, force);
        // At rest, 200 N/m over 15 mm and 600 N/m over 5 mm are equal.
        match reading {
            Some(Reading { position: [x, ..], velocity: [v, ..] }) if (x + 0.005).abs() < 1e-5 && v.abs() < 1e-3 => break (x, force.newtons()[0]),
            _ => thread::sleep(MILLISECOND),
        }
    };
    let mut told = format!("the wall holds the hand at {:.1} mm with {:.1} N\n", held.0 * 1e3, held.1);
    // From here on nobody asks for force. The gate of the driver's thread ends the force, and the hand goes where it wants.
    let through = loop {
        match lever.read(since(begun)) {
            Some(Reading { position: [x, ..], velocity: [v, ..] }) if (x + 0.02).abs() < 1e-5 && v.abs() < 1e-3 => break x,
            _ => thread::sleep(MILLISECOND),
        }
    };
    told += &format!("the loop is silent: the hand is at {:.1} mm\n", through * 1e3);
    lever.stop();
    Ok(told)
}

fn main() -> Result<(), LimitsError> {
    print!("{}", run()?);
    Ok(())
}

/// The README shows what the example prints.
#[test]
fn the_readme_shows_the_output() {
    let told = run().unwrap();
    assert!(include_str!("../README.md").contains(&told), "{told}");
}
