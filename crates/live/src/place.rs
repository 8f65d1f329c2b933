//! Name of a peer in datagrams: the place in the scene.

use core::fmt;

/// Index of a peer among all peers of the scene, from 0. Samples carry this index as their sender.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct Place(pub u32);

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}
