//! Figures of a link from its packets, files of its packets, and estimates of a link from measurements.
//!
//! Use this crate if you compare a link with its configuration, or estimate a link from measured delays.
//!
//! | module | content |
//! | --- | --- |
//! | [`fates`] | the fate log as a file: a streaming writer and a reader |
//! | [`pcapng`] | fates as capture files for packet analysers: the crate `cohaptic-capture` |
//! | [`achieved`] | achieved figures of delay, loss and order, each with its uncertainty |
//! | [`steady`] | a steady stream of packets over a link |
//! | [`asked`] | figures that follow from the laws of a link |
//! | [`comparison`] | comparison of achieved and asked figures, with a judgement of the difference |
//! | [`fit`](mod@fit) | estimate of a link from measured one-way delays and losses, with its goodness |
//!
//! The crate knows packets ([`PacketRecord`]) and nothing of their contents. Figures use the mathematical functions of the platform, so last digits may
//! differ between platforms. The fates of packets never differ.
//!
//! ```
//! use cohaptic_measure::achieved::Achieved;
//! use cohaptic_wan::FateLog;
//!
//! let log = FateLog::parse(
//!     "sequence,copy,offered_ns,size,at_ns,fate,marked,damaged\n\
//!      0,0,0,64,24000000,delivered,0,0\n\
//!      1,0,8000000,64,8000000,loss,0,0\n\
//!      2,0,16000000,64,42000000,delivered,0,0\n",
//! )?;
//! let achieved = Achieved::of(log.records());
//! assert_eq!(achieved.loss.value, Some(1.0 / 3.0));
//! assert_eq!(achieved.delay.unwrap().mean_s, 0.025);
//! # Ok::<(), cohaptic_wan::FateLogError>(())
//! ```
//!
//! [`PacketRecord`]: cohaptic_wan::PacketRecord
#![cfg_attr(test, allow(clippy::float_cmp, clippy::cast_precision_loss, reason = "tests compare exact values and count samples"))]

pub mod achieved;
pub mod asked;
mod batches;
pub mod comparison;
pub mod fates;
pub mod fit;
mod series;
pub mod steady;
#[cfg(test)]
mod tests;

pub use cohaptic_capture as pcapng;
