//! Configuration of a simulated service.

use core::time::Duration;

use super::Fault;
use crate::protocol::Format;

/// Configuration of a simulated service with one device.
#[derive(Clone, PartialEq, Debug)]
pub struct ServiceConfig {
    /// Seed of faults by chance.
    pub seed: u64,
    /// Words and abilities of the service: 3.5, or as before 3.5.
    pub format: Format,
    /// Id of the device.
    pub device: String,
    /// Time from a message to the reply. Never measured at a real service.
    pub reply_after: Duration,
    /// Mass of the grip \[kg\], above zero. Made up: no mass of the device is published.
    pub mass: f64,
    /// Damping of the grip \[N·s/m\], at least zero. Made up.
    pub damping: f64,
    /// Faults, in the order in which each reply draws its random numbers.
    pub faults: Vec<Fault>,
}

impl Default for ServiceConfig {
    /// A service of 3.5 without faults, replies after 200 µs, and a grip of 0.1 kg and 5 N·s/m.
    fn default() -> Self {
        Self {
            seed: 0,
            format: Format::V35,
            device: "04C3".to_owned(),
            reply_after: Duration::from_micros(200),
            mass: 0.1,
            damping: 5.0,
            faults: Vec::new(),
        }
    }
}
