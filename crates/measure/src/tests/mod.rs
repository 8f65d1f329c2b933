//! Tests of statements of several modules, and random numbers for all tests.

mod bursts;
mod calibration;
mod rng;

pub(crate) use rng::{TestRng, autoregressive};
