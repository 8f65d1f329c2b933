//! Force gate, the only source of motor counts: a [`GatedForce`](cohaptic_device::GatedForce) and the torques that make the force.

mod counts;
mod gate;

pub use cohaptic_device::{Limits, LimitsError};
pub use counts::MotorCounts;
pub use gate::{Admitted, Changes, ForceGate, Moment, Verdict, ZeroCause};

#[cfg(test)]
mod tests;
