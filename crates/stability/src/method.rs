//! The methods by which a verdict can be reached.

/// Method by which a verdict is reached.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Method {
    /// Peers that are equal are treated together: see [`Part`](crate::Part). For scenes with the strategies of this workspace.
    #[default]
    Reduced,
    /// Like [`Method::Reduced`], but finds the roots of a small determinant instead of the eigenvalues of a large matrix where samples are in flight for
    /// several frames. [`Method::Reduced`] switches to this method where the matrix would be large.
    Determinant,
    /// Unit vectors of the whole state are pushed through the code that simulates. For any linear strategy.
    Full,
}

impl Method {
    /// Returns the name of the method in JSON.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Reduced => "reduced",
            Self::Determinant => "determinant",
            Self::Full => "full",
        }
    }
}
