//! Assignment of the device's axes to the axes of a peer.

use thiserror::Error;

use crate::kinematics::Triple;

/// An axis of the device.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Axis {
    /// To the right of the user.
    X,
    /// Up.
    Y,
    /// Out of the device, towards the user.
    Z,
}

impl Axis {
    /// Returns the index of the axis in a triple: 0 for x, 1 for y, 2 for z.
    #[must_use]
    pub(crate) const fn index(self) -> usize {
        self as usize
    }
}

/// Axes of the device, indexed by the peer's axes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Axes<const A: usize>([Axis; A]);

impl<const A: usize> Axes<A> {
    /// Returns an assignment of these axes in this order.
    ///
    /// # Errors
    ///
    /// [`AxesError`] for an axis that is named twice, or for no axis.
    pub fn new(axes: [Axis; A]) -> Result<Self, AxesError> {
        // Each axis is compared with the axes before it, so the second of two equal axes is reported.
        let repeated = axes.iter().enumerate().find(|(place, axis)| axes[..*place].contains(axis));
        match repeated {
            Some((_, axis)) => Err(AxesError::Twice(*axis)),
            None if A == 0 => Err(AxesError::None),
            None => Ok(Self(axes)),
        }
    }

    /// Returns the components of a vector of the device along the peer's axes.
    #[must_use]
    pub(crate) fn of_device(&self, vector: Triple) -> [f64; A] {
        self.0.map(|axis| vector[axis.index()])
    }

    /// Returns a vector of the peer as a vector of the device, zero along the axes that the peer does not use.
    #[must_use]
    pub(crate) fn to_device(self, vector: [f64; A]) -> Triple {
        let mut spread = [0.0; 3];
        for (axis, part) in self.0.iter().zip(vector) {
            spread[axis.index()] = part;
        }
        spread
    }

    /// Returns, indexed by the device's axes, whether the peer does not use the axis.
    #[must_use]
    pub(crate) fn unused(&self) -> [bool; 3] {
        [Axis::X, Axis::Y, Axis::Z].map(|axis| !self.0.contains(&axis))
    }
}

/// Error of an assignment of axes.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Error)]
#[non_exhaustive]
pub enum AxesError {
    /// An axis is named twice.
    #[error("the axis {0:?} is named twice: each axis of the device can be one of the peer's")]
    Twice(Axis),
    /// No axis is named.
    #[error("no axis is named: a peer has one to three")]
    None,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_go_there_and_back() {
        let axes = Axes::new([Axis::Z, Axis::X]).unwrap();
        assert_eq!(axes.of_device([1.0, 2.0, 3.0]), [3.0, 1.0]);
        assert_eq!(axes.to_device([3.0, 1.0]), [1.0, 0.0, 3.0]);
        assert_eq!(axes.unused(), [false, true, false]);
        assert_eq!(Axes::new([Axis::X, Axis::X]), Err(AxesError::Twice(Axis::X)));
        assert_eq!(Axes::new([]), Err(AxesError::None));
    }
}
