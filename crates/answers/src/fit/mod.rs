//! The answers of the estimate of a link: reading measurements, correcting the clocks, fitting the link, and its document and words.

mod clocks;
mod document;
mod ends;
mod milliseconds;
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
    /// Time added to the clock of the receiver, and so to every delay \[s\].
    pub offset_s: Option<f64>,
    /// Known least delay: one common time is added to every delay, so that the smallest delay becomes this delay.
    pub least: Option<Duration>,
    /// `true` if a significant linear drift between the two clocks is removed.
    pub skew: bool,
}

/// An estimated link.
#[derive(Clone, PartialEq, Debug)]
pub struct Answered {
    /// The link and its goodness of fit.
    pub fitted: Fitted,
    /// The link as keys of a scene.
    pub scene: String,
    /// Content of the file of delays named by the link; `None` if a law fits.
    pub delays: Option<String>,
    /// The fitted packets.
    measurements: Measurements,
    clocks: Clocks,
    skew: Option<Skew>,
    matched: Option<Ends>,
}

/// Why no link is estimated.
#[derive(Debug, thiserror::Error)]
pub enum FitFailure {
    /// The clocks cannot be corrected as requested.
    #[error("{0}")]
    Measurements(String),
    /// The mean delay is so long that two clocks with an offset are the likely cause, and no correction was requested.
    #[error("the mean delay is {mean_s:.6} s: are the two clocks apart?")]
    LongDelays {
        /// Mean delay \[s\].
        mean_s: f64,
    },
    /// No link can be fitted to the measurements.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// A scene refuses the link.
    #[error(transparent)]
    Scene(Box<SceneError>),
    /// A scene reads the link with other moments of the delay.
    #[error("{0}")]
    Unheld(String),
}

impl Source {
    /// Estimates the link, and reads it back as a scene does. `file`: name of the file with the link. `delays_file`: name of the file of delays beside the
    /// link, named by the link if no law fits. Neither file needs to exist.
    ///
    /// # Errors
    ///
    /// [`FitFailure`] if no link can be fitted, or if a scene cannot hold the link.
    pub fn fit(&self, corrections: &Corrections, file: &Path, delays_file: &str) -> Result<Answered, FitFailure> {
        let (measurements, clocks, skew) = clocks::settled(corrections, &self.measurements, self.has_one_clock)?;
        let fitted = fit::fit(&measurements)?;
        let (scene, delays) = (fitted.link.to_scene_toml(delays_file), fitted.delays_csv());
        read_again(&scene, &fitted.link, file, delays.as_deref())?;
        Ok(Answered { fitted, scene, delays, measurements, clocks, skew, matched: self.matched.clone() })
    }
}
