//! By which radius the scenes of a family are judged.

use crate::{Radius, VerdictKind};

/// By which radius the scenes of a family are judged: one for all of them, so that their radii can be compared and drawn as one map.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Criterion {
    /// The spectral radius over a frame, of scenes that leave nothing to chance.
    SpectralRadius,
    /// The radius of the second moment over a frame: see [`mean_square`](crate::mean_square()). Chosen where any scene of the family leaves something to
    /// chance. A scene that leaves nothing to chance has the square of its spectral radius, which is the same number.
    MeanSquare,
}

impl Criterion {
    /// The word in JSON and CSV: `spectral-radius` or `mean-square`.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::SpectralRadius => "spectral-radius",
            Self::MeanSquare => "mean-square",
        }
    }

    /// Returns the question that a verdict by this criterion answers, which is another one where the radius is nominal.
    #[must_use]
    pub const fn kind(self, is_nominal: bool) -> VerdictKind {
        match (self, is_nominal) {
            (_, true) => VerdictKind::Nominal,
            (Self::SpectralRadius, false) => VerdictKind::Certain,
            (Self::MeanSquare, false) => VerdictKind::MeanSquare,
        }
    }
}

/// A radius of a family.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Cell<R = Radius> {
    /// By the criterion of the family.
    pub radius: R,
    /// Whether the links leave something to chance that the radius leaves out, because the second moment cannot be followed: it is then the square of
    /// the nominal spectral radius, the scene with every delay its mean and nothing lost.
    pub is_nominal: bool,
}

impl<R> Cell<R> {
    /// A radius that leaves nothing out.
    pub const fn certain(radius: R) -> Self {
        Self { radius, is_nominal: false }
    }
}
