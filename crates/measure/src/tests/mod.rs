//! Tests of what the figures of several modules state, and the random numbers of all tests.

mod bursts;
mod calibration;
mod rng;

pub(crate) use rng::{TestRng, autoregressive};
