//! Typed quantities of networks and time, and their text forms in scenes and messages.
//!
//! Use this crate if your program reads or writes quantities with units: durations, rates, sizes and probabilities.
//!
//! Quantities with exact arithmetic are integers in newtypes: an [`Instant`] counts nanoseconds since the scene began, a [`Rate`] bits per second, a
//! [`Bytes`] bytes. [`Probability`] is a checked `f64`. [`Hertz`] and [`RadPerSec`] keep the factor 2π in a single place. Mechanical quantities (masses,
//! stiffnesses, forces) are plain `f64` in SI units in the other crates, because matrices are made of them.
//!
//! An [`Ecn`] is no quantity, but the codepoint of a packet that the emulator, TCP and the router have in common.
//!
//! This crate does not know the use of the quantities. Read [`Instant`] first.
//!
//! ```
//! use cohaptic_units::{Bytes, Instant, Rate, parse};
//!
//! let rate: Rate = parse::rate("1Mbit")?;
//! let size: Bytes = parse::size("64B")?;
//! let departure = Instant::ZERO + rate.serialisation_time(size);
//! assert_eq!(departure.as_nanos(), 512_000);
//! # Ok::<(), parse::ParseError>(())
//! ```
#![cfg_attr(not(test), no_std)]
#![cfg_attr(test, allow(clippy::float_cmp, clippy::cast_precision_loss, reason = "tests compare exact values and count samples"))]

extern crate alloc;

mod ecn;
mod excerpt;
mod frequency;
mod instant;
pub mod parse;
pub mod print;
mod probability;
mod rate;
mod size;
mod visible;

pub use ecn::Ecn;
pub use excerpt::{Excerpt, Spot};
pub use frequency::{Hertz, RadPerSec};
pub use instant::Instant;
pub use probability::{Probability, ProbabilityError};
pub use rate::Rate;
pub use size::Bytes;
pub use visible::{Visible, visible_lines};
