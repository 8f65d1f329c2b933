//! Halves of streams.

pub(super) mod owned;
mod split;

pub use owned::{OwnedReadHalf, OwnedWriteHalf, ReuniteError};
pub use split::{ReadHalf, WriteHalf};
