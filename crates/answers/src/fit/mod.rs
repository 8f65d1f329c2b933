//! What an estimate of a link answers: measurements of any kind, their clocks, the link, as a document and in words.

mod clocks;
mod document;
mod ends;
mod scene_link;
mod source;
mod words;

use std::path::Path;
use std::time::Duration;

use cohaptic_measure::fit::{self, FitError, Fitted, Measurements, Skew};
use cohaptic_scene::SceneError;

use clocks::Clocks;
pub use document::document;
use ends::Ends;
use scene_link::read_again;
pub use source::{Source, SourceError};
pub use words::words;

/// Corrections of the clocks of the two ends.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Corrections {
    /// Time that is added to the clock of the receiver, and so to every delay \[s\].
    pub offset_s: Option<f64>,
    /// The least delay, where it is known: one time is added to every delay, so that the least of them is this one.
    pub least: Option<Duration>,
    /// Whether the linear drift of one clock against the other is removed, where it is significant.
    pub skew: bool,
}

/// A link that was estimated.
#[derive(Clone, PartialEq, Debug)]
pub struct Answered {
    /// The link and its goodness.
    pub fitted: Fitted,
    /// The link as keys of a scene.
    pub scene: String,
    /// The content of the file of delays that the link names; `None` if a law fits.
    pub delays: Option<String>,
    /// The packets that were fitted.
    measurements: Measurements,
    clocks: Clocks,
    skew: Option<Skew>,
    matched: Option<Ends>,
}

/// Why no link is estimated.
#[derive(Debug, thiserror::Error)]
pub enum FitFailure {
    /// The corrections cannot be made.
    #[error("{0}")]
    Measurements(String),
    /// The delays are so long that the two clocks are more likely apart, and no time is added to them.
    #[error("the mean delay is {mean_s:.6} s: are the two clocks apart?")]
    LongDelays {
        /// The mean delay \[s\].
        mean_s: f64,
    },
    /// The measurements have no link.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// A scene would refuse the link.
    #[error(transparent)]
    Scene(Box<SceneError>),
    /// A scene would have another link.
    #[error("{0}")]
    Unheld(String),
}

impl Source {
    /// Estimates the link, and reads it as a scene reads it. `file` is the name of the file with the link. `delays_file` is that of the file of delays beside
    /// it, which the link names where no law fits. Neither of the files need exist.
    ///
    /// # Errors
    ///
    /// [`FitFailure`] if the measurements have no link, or none that a scene can hold.
    pub fn fit(&self, corrections: &Corrections, file: &Path, delays_file: &str) -> Result<Answered, FitFailure> {
        let (measurements, clocks, skew) = clocks::settled(corrections, &self.measurements, self.has_one_clock)?;
        let fitted = fit::fit(&measurements)?;
        let (scene, delays) = (fitted.link.to_scene_toml(delays_file), fitted.delays_csv());
        read_again(&scene, &fitted.link, file, delays.as_deref())?;
        Ok(Answered { fitted, scene, delays, measurements, clocks, skew, matched: self.matched.clone() })
    }
}
