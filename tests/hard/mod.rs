//! Hard cases: what is long, far, large, small, many, at the edge, or all at once.
//!
//! Each asserts a bound that is derived beside it; `docs/hard-cases.md` is the table. In all derivations u is 2⁻⁵³, the largest relative error of one rounding.
#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests may fail as tests do")]
#![allow(clippy::float_cmp, reason = "what must be the same to the bit")]
#![allow(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_sign_loss,
    reason = "ticks, packets, peers and exponents, far below 2^53"
)]
#![allow(clippy::wildcard_enum_match_arm, reason = "a kind of state that is not listed ends the test")]

mod denormals;
mod edge_of_stability;
mod end_of_time;
mod end_of_time_on_links;
mod exact_sum;
mod far_from_the_origin;
mod gain;
mod long_motion;
mod long_time;
mod many_peers;
mod million_in_flight;
mod orders_of_magnitude;
mod simultaneous;
mod total_loss;
mod watch;
mod zero_delay;

/// u, half the distance from 1 to the next double: the largest relative error of one rounding.
const ROUNDING: f64 = f64::EPSILON / 2.0;
