//! The subjects of the measurement.

/// Task of a group of methods.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Subject {
    /// Motion of masses from tick to tick.
    Motion,
    /// Rotation of bodies from tick to tick.
    Rotation,
    /// Representation of time: events in nanoseconds, or steps.
    Time,
    /// Random delays and losses on links.
    Network,
    /// Stability of a scene.
    Analysis,
    /// Release of packets by the wall clock.
    RealTime,
}

impl Subject {
    /// All subjects, in the order of measurement and presentation.
    pub const ALL: [Self; 6] = [Self::Motion, Self::Rotation, Self::Time, Self::Network, Self::Analysis, Self::RealTime];

    /// Returns the name, as on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Motion => "motion",
            Self::Rotation => "rotation",
            Self::Time => "time",
            Self::Network => "network",
            Self::Analysis => "analysis",
            Self::RealTime => "real-time",
        }
    }
}
