//! The lifted system: nodes of one axis, coupled by weights over the samples they send, and one frame of it as a matrix.
//!
//! Lifting turns a system with two rates into one with the slow rate, without approximation (Araki & Yamamoto 1986). A node is a peer, or what a class of
//! equal peers has in common or apart; the weights are the averaging matrix, or one of its eigenvalues.

mod delayed;
pub(crate) mod frame;
pub(crate) mod majorant;
pub(crate) mod node;
mod rounding;
mod sampling;
mod system;

pub use frame::{Autonomous, FrameMap, Instrument};
pub use node::{Body, Node};
pub(crate) use rounding::{Rounding, closer_of};
pub use sampling::Sampling;
pub use system::Lifted;
pub(crate) use system::Sizes;
