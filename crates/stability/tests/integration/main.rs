//! The analysis of whole scenes.
#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests may fail as tests do")]
#![allow(clippy::float_cmp, clippy::cast_precision_loss, reason = "what must agree to the bit is compared so, and counts are small")]
#![allow(clippy::needless_range_loop, reason = "axes and peers are indices of several arrays at once")]

mod admittance;
mod anchors;
mod bursts;
mod cases;
mod client_server;
mod crossover;
mod ends;
mod exchange;
mod graphs;
mod laws;
mod mean_square;
mod random;
mod reduction;
mod reference;
mod reference_file;
mod rotation;
mod strategies;
mod turned_admittance;
mod watch;
mod wave;
