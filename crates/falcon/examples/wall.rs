//! A wall in the air: a Novint Falcon pushes back where its grip enters a plane, as if something solid stood there.
//!
//! The device is a simulated one, down to the bytes on its wire, and so is the hand that homes it, pushes the grip into the wall and pulls it out. With
//! `UsbTransport::open` in place of `SimulatedTransport` the loop drives a real one. Nothing here was tried on hardware yet.
//!
//! ```text
//! cargo run -p cohaptic-falcon --example wall
//! ```
#![allow(clippy::print_stdout, reason = "an example prints")]

use std::error::Error;
use std::fmt::Write as _;
use std::time::Duration;

use cohaptic_falcon::driver::{Driver, DriverConfig, DriverError, Setpoint, Status};
use cohaptic_falcon::simulator::{SimulatedTransport, Simulator, SimulatorConfig, Waypoints};

/// Where the wall begins, seen from the middle of the workspace \[m\]: nearer to the base is inside.
const WALL: f64 = -0.010;
/// \[N/m\] and \[N·s/m\]
const STIFFNESS: f64 = 400.0;
const DAMPING: f64 = 2.0;

/// Returns the force of the wall on the grip \[N\]: away from the base, never towards it.
fn wall(status: &Status) -> f64 {
    let Some(reading) = status.reading else { return 0.0 };
    let depth = WALL - reading.position[2];
    if depth > 0.0 { (STIFFNESS * depth - DAMPING * reading.velocity[2]).max(0.0) } else { 0.0 }
}

/// Pulls the grip out, which homes the device and switches forces on, pushes it 20 mm beyond the surface of the wall, and lets it come back. Returns the
/// status at every millisecond.
fn touch() -> Result<Vec<Status>, DriverError> {
    // Distances from the base; the middle of the workspace is 125 mm from it.
    let (out, middle, inside) = (0.176, 0.125, 0.125 + WALL - 0.020);
    let path = [(0, 0.100), (1000, out), (1500, out), (2500, middle), (3500, inside), (4000, inside), (5000, middle)];
    let hand = Waypoints::new(path.map(|(millis, z)| (Duration::from_millis(millis), [0.0, 0.0, z])));
    let simulator = Simulator::new(SimulatorConfig { running: true, ..SimulatorConfig::default() }, hand);
    let mut driver = Driver::open(SimulatedTransport::in_virtual_time(simulator), DriverConfig::DEFAULT)?;
    let (begin, mut rows) = (driver.now(), Vec::new());
    for millis in 0..=5000 {
        driver.sleep_until(begin + Duration::from_millis(millis));
        let setpoint = Setpoint { force: [0.0, 0.0, wall(driver.status())], at: driver.now() };
        rows.push(*driver.exchange(Some(setpoint))?);
    }
    Ok(rows)
}

/// Returns the table of the README.
fn table() -> Result<String, Box<dyn Error>> {
    let mut text = format!("{:>9} {:>8} {:>12} {:>10}\n", "time [ms]", "phase", "grip z [mm]", "force [N]");
    for (millis, status) in touch()?.iter().enumerate().step_by(250) {
        let z = status.reading.map_or_else(|| "not known".to_owned(), |reading| format!("{:.1}", reading.position[2] * 1e3));
        writeln!(text, "{millis:>9} {:>8} {z:>12} {:>10.2}", status.phase.name(), status.force[2])?;
    }
    Ok(text)
}

fn main() -> Result<(), Box<dyn Error>> {
    print!("{}", table()?);
    Ok(())
}

#[test]
fn the_readme_shows_the_table() -> Result<(), Box<dyn Error>> {
    assert!(include_str!("../README.md").contains(&table()?), "{}", table()?);
    Ok(())
}
