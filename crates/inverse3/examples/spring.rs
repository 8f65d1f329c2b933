//! A spring to the origin, the first program that everybody writes for a haptic device. The hand arms the device by holding the cursor at the origin, and then
//! sways. After 2.5 s the connection to the service ends, and comes back.
//!
//! ```sh
//! cargo run -p cohaptic-inverse3 --example spring
//! ```

#![allow(clippy::print_stdout, reason = "an example prints")]

use std::fmt::Write as _;
use std::time::Duration;

use cohaptic_device::{Device as _, Gate, Limits, Moment};
use cohaptic_inverse3::client::{ClientConfig, ClientConfigError};
use cohaptic_inverse3::service::{Fault, FaultKind, Service, ServiceConfig, SwayingHand};
use cohaptic_inverse3::stepped::SteppedInverse3;
use cohaptic_units::Instant;

/// Stiffness of the spring \[N/m\].
const STIFFNESS: f64 = 100.0;
const TICK: Duration = Duration::from_millis(1);

fn main() -> Result<(), ClientConfigError> {
    print!("{}", table()?);
    Ok(())
}

/// Returns a row each quarter of a second.
fn table() -> Result<String, ClientConfigError> {
    let restart = Fault::during(FaultKind::Restart, Instant::from_nanos(2_500_000_000), Duration::from_millis(100));
    let service = ServiceConfig { faults: vec![restart], ..ServiceConfig::default() };
    let hand = SwayingHand { amplitude: [0.03, 0.0, 0.0], frequency: 0.5 };
    let mut device = SteppedInverse3::new(Service::new(service, hand), ClientConfig::DEFAULT)?;
    let mut gate = Gate::new(Limits { force: 2.0, ..Limits::DEFAULT }, device.stopper())?;
    let mut text = "time [ms]       phase  cursor x [mm]  force [N]\n".to_owned();
    for count in 0..=4000 {
        let now = Instant::ZERO + TICK * count;
        let reading = device.read(now);
        // Without a reading there is no force, and the gate says so too.
        let wanted = reading.map_or([0.0; 3], |reading| reading.position.map(|part| -STIFFNESS * part));
        let at = reading.map(|_| now);
        let admitted = gate.admit(wanted, &Moment { now, ready: at.is_some(), armed: at.is_some(), reading_at: at, setpoint_at: at });
        if count % 250 == 0 {
            let snapshot = device.snapshot();
            let x = snapshot.reading.map_or_else(|| "not known".to_owned(), |(reading, _)| format!("{:.1}", 1e3 * reading.position[0] + 0.0));
            let _ = writeln!(text, "{count:9}  {:>10}  {x:>13}  {:9.2}", snapshot.phase.name(), snapshot.force[0] + 0.0);
        }
        device.hold(now, TICK, admitted.force);
    }
    device.stop();
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_readme_shows_this_table() {
        let readme = include_str!("../README.md");
        let table = table().unwrap();
        assert!(readme.contains(&table), "expected in README.md:\n{table}");
    }
}
