//! Guarantees: verdicts that hold for sets of scenes, not for one.
//!
//! A frame of a lifted system is a product of steps ([`steps`]) whose entries are affine in each gain. Over a box of gains the frame is enclosed by a mean, a
//! slope along each gain and a small radius ([`span`]). The eigenvalues of the frame lie in discs that move with the gains ([`discs`]). A box is stable if all
//! discs lie inside the unit circle, and unstable if one disc lies outside. A box for which neither can be shown is halved along each key ([`halving`]).
//!
//! Equal peers on a graph are split into parts of one node, one part per interval that encloses eigenvalues of the averaging matrix. A server with its clients
//! ([`server`]) and copies that are tied by waves ([`waves`]) have steps of their own.
//!
//! The searches for coordinates, weights and second moments may be inexact: a verdict rests only on inequalities that are checked with bounds of all rounding
//! errors.

mod basis;
mod certificate;
mod corners;
mod delays;
mod discs;
mod error;
mod followed;
mod growing;
mod guarantee;
mod halving;
mod heard;
mod line;
mod mean_square;
#[cfg(test)]
mod mutation;
mod number;
#[cfg(test)]
mod points;
mod program;
mod pushed;
mod region;
mod server;
#[cfg(test)]
mod servers_and_graphs;
mod shared;
mod span;
mod steps;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod tests_of_matrices;
#[cfg(test)]
mod tests_of_waves;
mod waves;

pub(crate) use certificate::digits;
pub use certificate::{BoxCertificate, MomentCertificate, NumberCertificate, PartCertificate, TopologyCertificate};
pub use discs::FreeCircle;
pub(crate) use discs::stable_difference;
pub use error::ProofError;
pub use guarantee::Guarantee;
pub use halving::KnownPieces;
pub use line::{ProvenLine, ProvenStretch};
pub use number::{EveryNumber, MOST_FOLLOWED, Nearness, NumberProof, NumberSpan, Openness, prove_every_number};
pub use region::{MOST_HALVINGS, ProvenBox, ProvenRegion};
pub use shared::SharedProof;
pub use steps::FrameState;
