//! The methods that a scene can choose between, each with its cost and its error on this scene.
//!
//! A [`Method`] is data: its kind, the words that choose it on the command line, and the work that shows what it costs. [`methods`] lists them, and [`measure`]
//! does the work. Methods of one [`Kind`] do the same work, so that their costs and errors can be compared. No clock is read here: [`measure`] is given one.

mod document;
mod list;
mod measurement;
mod picture;
mod runs;

#[cfg(test)]
mod tests;

pub use document::explanation_with_costs;
pub use list::methods;
pub use measurement::{Measured, MeasuredMethod, MeasurementWatch, measure};
pub use picture::{cost_picture, error_in_words};

use std::time::Duration;

use cohaptic_harness::Model;
use cohaptic_scene::Scene;

/// Purpose of a method.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Kind {
    /// Engine of runs. All engines have the same answer, to the bit.
    Engine,
    /// Number of simulated axes.
    Axes,
    /// Motion of bodies from tick to tick.
    Integrator,
    /// Source of random delays and losses.
    Sampling,
    /// Analysis that decides on stability.
    Analysis,
}

impl Kind {
    /// Every kind, in the order in which they are shown.
    pub const ALL: [Self; 5] = [Self::Engine, Self::Axes, Self::Integrator, Self::Sampling, Self::Analysis];

    /// The word in JSON.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Engine => "engine",
            Self::Axes => "axes",
            Self::Integrator => "integrator",
            Self::Sampling => "sampling",
            Self::Analysis => "analysis",
        }
    }

    /// The heading for people.
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

    /// The unit of the cost, with what it is for.
    #[must_use]
    pub const fn cost_unit(self) -> &'static str {
        match self {
            Self::Engine | Self::Axes | Self::Integrator | Self::Sampling => "ms a simulated second",
            Self::Analysis => "ms an analysis",
        }
    }

    /// Unit of work that the cost is for.
    #[must_use]
    pub const fn cost_of(self) -> &'static str {
        match self {
            Self::Engine | Self::Axes | Self::Integrator | Self::Sampling => "simulated second",
            Self::Analysis => "analysis",
        }
    }

    /// Quantity that the error is of.
    #[must_use]
    pub const fn error_of(self) -> &'static str {
        match self {
            Self::Engine | Self::Axes | Self::Integrator | Self::Sampling => "position of a copy",
            Self::Analysis => "spectral radius",
        }
    }

    /// The unit of the error.
    #[must_use]
    pub const fn error_unit(self) -> &'static str {
        match self {
            Self::Engine | Self::Axes | Self::Integrator | Self::Sampling => "m",
            Self::Analysis => "1",
        }
    }
}

/// A method that the scene could choose.
#[derive(Clone, Debug)]
pub struct Method {
    /// Purpose of the method.
    pub kind: Kind,
    /// Name of the method, unique within its kind.
    pub name: String,
    /// The words that choose it on the command line; empty for the default.
    pub option: String,
    /// `true` if the scene as it stands is computed by this method.
    pub chosen: bool,
    /// `true` for the reference of its kind, which the errors of the other methods are against.
    pub(crate) is_reference: bool,
    /// The work that shows its cost and its error, or why it does not apply to the scene.
    pub(crate) work: Result<Work, String>,
}

impl Method {
    /// Returns whether the object turns in the run of the method.
    fn turns(&self) -> bool {
        matches!(&self.work, Ok(Work::Run(run)) if run.scene.rotation.is_some())
    }
}

/// Work that shows the cost and the error of a method.
#[derive(Clone, Debug)]
pub(crate) enum Work {
    Run(Run),
    Analysis { scene: Box<Scene>, method: cohaptic_stability::Method },
}

/// A run of a scene, or of its beginning.
#[derive(Clone, Debug)]
pub(crate) struct Run {
    /// The scene, no longer than the span that is simulated.
    pub(crate) scene: Box<Scene>,
    pub(crate) model: Model,
    /// `true` if packets are watched, for which a run has events.
    pub(crate) watches_packets: bool,
    /// The axes whose positions are compared: those of the scene as it stands.
    pub(crate) compared_axes: usize,
}

impl Run {
    fn span(&self) -> Duration {
        self.scene.duration
    }
}
