//! What a link did, in figures and files, and what link would have done it.
//!
//! You need it if you compare a link with its configuration, or estimate a link from measured delays.
//!
//! | module | is |
//! | --- | --- |
//! | [`fates`] | the fate log as a file: a streaming writer and a reader |
//! | [`pcapng`] | the fates as a capture file that packet analysers open: the crate `cohaptic-capture` |
//! | [`achieved`] | figures of a link's delays, losses and order, each with its uncertainty, to be compared with those asked for |
//! | [`steady`] | a steady stream of packets over one link |
//! | [`asked`] | the figures that follow from the laws of a link |
//! | [`comparison`] | the achieved figures compared with the configured ones, and whether they are too far off |
//! | [`fit`](mod@fit) | an estimate of a link from measured one-way delays and losses, with its goodness |
//!
//! It knows packets ([`PacketRecord`]) and nothing of what they carry. Figures are computed with the
//! platform's mathematics, so that their last digits may differ between platforms; what a link does never does.
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
