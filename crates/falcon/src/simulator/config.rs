//! The unknowns of the device, and the settings of a simulation.

use core::time::Duration;

use super::Faults;
use crate::kinematics::Triple;

/// A simulated device.
#[derive(Clone, PartialEq, Debug)]
pub struct SimulatorConfig {
    /// Where its random numbers begin: offsets of encoders that are not homed, and faults.
    pub seed: u64,
    /// Whether firmware runs already when it begins.
    pub running: bool,
    /// The one image that its boot loader takes; `None` takes any of at least 1 KiB.
    pub image: Option<Vec<u8>>,
    /// Whether a zero byte precedes the answer to the greeting.
    pub leading_zero: bool,
    /// Greetings that the boot loader does not hear.
    pub deaf_greetings: u32,
    /// How long the motors hold a torque when no packet comes. Never measured on a device.
    pub torque_timeout: Duration,
    /// Counts that make a torque of 1 N·m at an arm: the truth, which a driver's calibration may miss.
    pub counts_per_newton_metre: f64,
    /// The count, from the home angle, at which the index of each encoder lies. Not known; arms pass −600 when the grip is pulled out and pushed in.
    pub index: f64,
    /// Where the grip is at the beginning, in the frame of the device \[m\].
    pub position: Triple,
    /// How it moves.
    pub mechanics: MechanicsConfig,
    /// How it fails.
    pub faults: Faults,
}

impl Default for SimulatorConfig {
    /// Just switched on, the grip at rest 100 mm from the base, a torque time-out of 10 ms, no faults.
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

/// Mass, friction and end stops.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MechanicsConfig {
    /// What the grip weighs in motion \[kg\].
    pub mass: f64,
    /// Viscous friction \[N·s/m\].
    pub damping: f64,
    /// Dry friction \[N\], against the motion; at rest it holds against any smaller force.
    pub coulomb: f64,
    /// How stiff the end stops of the arms are \[N·m/rad\].
    pub stop_stiffness: f64,
    /// How much they damp \[N·m·s/rad\].
    pub stop_damping: f64,
}

impl MechanicsConfig {
    /// 0.1 kg and 5 N·s/m, which Rakhsha and Constantinescu (2015) chose for the device, and 0.2 N of dry friction, which is a guess.
    pub const DEFAULT: Self = Self { mass: 0.1, damping: 5.0, coulomb: 0.2, stop_stiffness: 40.0, stop_damping: 0.2 };
}
