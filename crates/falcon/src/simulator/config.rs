//! Configuration of a simulation, with the unknown properties of a device.

use core::time::Duration;

use super::Faults;
use crate::kinematics::Triple;

/// Configuration of a simulated device.
#[derive(Clone, PartialEq, Debug)]
pub struct SimulatorConfig {
    /// Seed of the random numbers, for the offsets of encoders that are not homed, and for faults.
    pub seed: u64,
    /// `true` if firmware runs at the beginning.
    pub running: bool,
    /// The image that the boot loader accepts; `None` accepts every image of at least 1 KiB.
    pub image: Option<Vec<u8>>,
    /// `true` if a zero byte precedes the answer to the greeting.
    pub leading_zero: bool,
    /// Number of greetings that the boot loader ignores.
    pub deaf_greetings: u32,
    /// Time for which the motors hold a torque without a new packet. Never measured on a device.
    pub torque_timeout: Duration,
    /// Counts per N·m at an arm: the true value, which a driver's calibration may not have.
    pub counts_per_newton_metre: f64,
    /// Position of each encoder's index, in counts from the home angle. The true value is unknown; arms pass −600 when the grip is pulled out and pushed in.
    pub index: f64,
    /// Initial position of the grip in the frame of the device \[m\].
    pub position: Triple,
    /// Mass, friction and end stops.
    pub mechanics: MechanicsConfig,
    /// Faults of the connection and the boot loader.
    pub faults: Faults,
}

impl Default for SimulatorConfig {
    /// Returns a device that was just switched on, with the grip at rest 100 mm from the base, a torque time-out of 10 ms, and no faults.
    fn default() -> Self {
        Self {
            seed: 0,
            running: false,
            image: None,
            leading_zero: false,
            deaf_greetings: 0,
            torque_timeout: Duration::from_millis(10),
            counts_per_newton_metre: 10_000.0,
            index: -600.0,
            position: [0.0, 0.0, 0.100],
            mechanics: MechanicsConfig::DEFAULT,
            faults: Faults::NONE,
        }
    }
}

/// Mass, friction and end stops of the grip.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MechanicsConfig {
    /// Moving mass of the grip \[kg\].
    pub mass: f64,
    /// Viscous friction \[N·s/m\].
    pub damping: f64,
    /// Dry friction \[N\], against the motion. At rest the friction holds against any smaller force.
    pub coulomb: f64,
    /// Stiffness of the end stops of the arms \[N·m/rad\].
    pub stop_stiffness: f64,
    /// Damping of the end stops of the arms \[N·m·s/rad\].
    pub stop_damping: f64,
}

impl MechanicsConfig {
    /// Default values: 0.1 kg and 5 N·s/m, chosen by Rakhsha and Constantinescu (2015) for the device, and 0.2 N of dry friction, which is a guess.
    pub const DEFAULT: Self = Self { mass: 0.1, damping: 5.0, coulomb: 0.2, stop_stiffness: 40.0, stop_damping: 0.2 };
}
