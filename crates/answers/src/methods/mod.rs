//! The methods selectable in a scene, with the cost and the error of each on this scene.
//!
//! A [`Method`] is data: kind, option on the command line, and the work for measuring the cost. [`methods`] lists the methods, and [`measure`] does the work.
//! The methods of a [`Kind`] do the same work, so that costs and errors are comparable. [`measure`] takes the clock as an argument.

mod list;
mod measurement;
mod picture;
mod runs;

#[cfg(test)]
mod tests;

pub use list::methods;
pub use measurement::{Measured, MeasuredMethod, MeasurementWatch, measure};
pub use picture::{cost_picture, error_in_words};

use std::time::Duration;

use cohaptic_harness::Model;
use cohaptic_scene::Scene;

/// Purpose of a method.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Kind {
    /// Engine of runs. All engines have the same results, to the last bit.
    Engine,
    /// Number of simulated axes.
    Axes,
    /// Motion of bodies from tick to tick.
    Integrator,
    /// Source of random delays and losses.
    Sampling,
    /// Analysis of stability.
    Analysis,
}

impl Kind {
    /// All kinds, in the order of display.
    pub const ALL: [Self; 5] = [Self::Engine, Self::Axes, Self::Integrator, Self::Sampling, Self::Analysis];

    /// Returns the word in JSON documents.
    #[must_use]
    pub(crate) const fn word(self) -> &'static str {
        match self {
            Self::Engine => "engine",
            Self::Axes => "axes",
            Self::Integrator => "integrator",
            Self::Sampling => "sampling",
            Self::Analysis => "analysis",
        }
    }

    /// Returns the heading for people.
    #[must_use]
    pub const fn heading(self) -> &'static str {
        match self {
            Self::Engine => "engine of runs",
            Self::Axes => "number of axes",
            Self::Integrator => "integrator",
            Self::Sampling => "sampling of random numbers",
            Self::Analysis => "analysis of stability",
        }
    }

    /// Returns the unit of the cost, with the unit of work.
    #[must_use]
    pub const fn cost_unit(self) -> &'static str {
        match self {
            // All methods of runs do the same work: a simulated second.
            Self::Engine | Self::Axes | Self::Integrator | Self::Sampling => "ms a simulated second",
            Self::Analysis => "ms an analysis",
        }
    }

    /// Returns the unit of work of the cost.
    #[must_use]
    pub(crate) const fn cost_of(self) -> &'static str {
        match self {
            Self::Engine | Self::Axes | Self::Integrator | Self::Sampling => "simulated second",
            Self::Analysis => "analysis",
        }
    }

    /// Returns the quantity of the error.
    #[must_use]
    pub const fn error_of(self) -> &'static str {
        match self {
            Self::Engine | Self::Axes | Self::Integrator | Self::Sampling => "position of a copy",
            Self::Analysis => "spectral radius",
        }
    }

    /// Returns the unit of the error.
    #[must_use]
    pub const fn error_unit(self) -> &'static str {
        match self {
            Self::Engine | Self::Axes | Self::Integrator | Self::Sampling => "m",
            Self::Analysis => "1",
        }
    }
}

/// A method selectable in the scene.
#[derive(Clone, Debug)]
pub struct Method {
    /// Purpose of the method.
    pub(crate) kind: Kind,
    /// Name of the method, unique within its kind.
    pub name: String,
    /// Option of the method on the command line; empty for the default.
    pub(crate) option: String,
    /// `true` if the scene as it stands uses this method.
    pub(crate) chosen: bool,
    /// `true` if the errors of the methods of this kind are measured against this method.
    pub(crate) is_reference: bool,
    /// Work for measuring cost and error, or the reason why the method does not apply to the scene.
    pub(crate) work: Result<Work, String>,
}

impl Method {
    /// Returns `true` if the object turns in the run of the method.
    fn turns(&self) -> bool {
        // A method without work does not apply, and an analysis has no run.
        matches!(&self.work, Ok(Work::Run(run)) if run.scene.rotation.is_some())
    }
}

/// Work for measuring cost and error of a method.
#[derive(Clone, Debug)]
pub(crate) enum Work {
    Run(Run),
    Analysis { scene: Box<Scene>, method: cohaptic_stability::Method },
}

/// A run of a scene, or of the beginning of a scene.
#[derive(Clone, Debug)]
pub(crate) struct Run {
    /// The scene, with the simulated span as its duration.
    pub(crate) scene: Box<Scene>,
    pub(crate) model: Model,
    /// `true` if packets are watched, which makes the run use events.
    pub(crate) watches_packets: bool,
    /// Number of compared axes: the axes of the scene as it stands.
    pub(crate) compared_axes: usize,
}

impl Run {
    fn span(&self) -> Duration {
        self.scene.duration
    }
}
