//! The watcher of the work.

/// Sees how far the work is, and may end it.
pub trait Watch: Sync {
    /// One of the [`crate::steps`] is done.
    fn one_more(&self);

    /// Whether the work is to be given up.
    fn stops(&self) -> bool;
}

/// Nobody watches.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Unwatched;

impl Watch for Unwatched {
    fn one_more(&self) {}

    fn stops(&self) -> bool {
        false
    }
}
