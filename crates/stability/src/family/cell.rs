//! The radius at one point of a family of scenes, with a mark that tells whether the radius is nominal.

use crate::Radius;

/// The radius of a family of scenes for one set of key values.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Cell<R = Radius> {
    /// Radius by the criterion of the family; below 1 the scene is stable.
    pub radius: R,
    /// `true` if the radius leaves out random parts of the links, because the second moment of this scene cannot be followed. A nominal radius is the square
    /// of the spectral radius of the scene in which every delay is its mean and no packet is lost.
    pub is_nominal: bool,
}

impl<R> Cell<R> {
    /// Returns a cell whose radius leaves out no random part of the links.
    pub const fn certain(radius: R) -> Self {
        Self { radius, is_nominal: false }
    }
}
