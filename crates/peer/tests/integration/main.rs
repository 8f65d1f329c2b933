//! Properties of a peer and its parts, against independent oracles.
#![allow(clippy::unwrap_used, reason = "helpers of tests may fail as tests do")]
#![allow(clippy::cast_precision_loss, reason = "a few hundred milliseconds are a number")]
#![allow(clippy::float_cmp, reason = "what must agree to the bit is compared so")]

mod ageing;
mod extrapolated;
mod increments;
mod late_samples;
mod laws;
mod local_lag;
mod own_parts;
mod rotation;
mod slow_device;
mod smoothed_average_position;
mod step_map;
mod turning_energy;
mod wire;

use cohaptic_tests_common::cases;
