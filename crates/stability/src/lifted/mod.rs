//! The lifted system: nodes of one axis, coupled by weights over the samples that the nodes send, and one frame of the system as a matrix.
//!
//! Lifting turns a system with two rates into a system with the slow rate, without approximation (Araki & Yamamoto 1986). A node is a peer, or the common
//! or relative motion of a class of equal peers; the weights are the averaging matrix, or one of its eigenvalues. The module does not know scenes.

mod delayed;
pub(crate) mod frame;
pub(crate) mod majorant;
pub(crate) mod node;
pub(crate) mod operator;
mod rounding;
mod sampling;
mod system;

pub use frame::{Autonomous, FrameMap, Instrument};
pub use node::{Body, Node};
pub use operator::{Operator, Seen};
pub(crate) use rounding::{Rounding, closer_of};
pub use sampling::Sampling;
pub use system::Lifted;
pub(crate) use system::Sizes;
