//! The answers of the estimate of a link: reading measurements, correcting the clocks, fitting the link, and document and words of the link.

mod clocks;
mod document;
mod ends;
mod hold_out;
mod milliseconds;
mod probed;
mod recorded;
mod scene_link;
mod source;
mod words;

use std::path::{Path, PathBuf};
use std::time::Duration;

pub use cohaptic_measure::fit::readers::Direction;
use cohaptic_measure::fit::readers::Recording;
use cohaptic_measure::fit::{self, FitError, Fitted, Measurements, MeasurementsError, Skew};
use cohaptic_scene::SceneError;

use clocks::Clocks;
pub use document::document;
use ends::Ends;
use probed::Probed;
use scene_link::read_again;
use source::Found;
pub use source::{ReadAs, Source, SourceError};
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
    /// Tick of the clock that showed the delays; `None` if the delays themselves tell the tick.
    pub tick: Option<Tick>,
    /// Share of the time, above 0 and below 1, whose packets are held out from the fit and judge the link. `None` to fit all packets.
    pub hold_out: Option<f64>,
}

/// Tick of a clock.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Tick {
    /// The clock rounds to multiples of this time.
    Rounded(Duration),
    /// The clock cuts to multiples of this time.
    Cut(Duration),
}

impl Tick {
    /// Returns the measurements of a clock with this tick, of which the delays are the share `share`.
    fn of(self, measurements: Measurements, share: f64) -> Result<Measurements, MeasurementsError> {
        match self {
            Self::Rounded(tick) => measurements.rounded_to(tick.as_secs_f64() * share),
            Self::Cut(tick) => measurements.cut_to(tick.as_secs_f64() * share),
        }
    }
}

/// A link with its origin.
#[derive(Clone, PartialEq, Debug)]
pub struct Answered {
    /// The link as keys of a scene.
    pub scene: String,
    /// The file that the link names; `None` if the link needs no file.
    pub beside: Option<Beside>,
    /// `false` if no law fits the delays, or if the held-out packets refuse the link.
    pub has_law: bool,
    kind: Kind,
}

/// File named by a key of a link, such as a table of delays.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Beside {
    /// Path of the file, in the folder of the file with the link.
    pub path: PathBuf,
    /// Content of the file.
    pub content: String,
}

/// Origin of a link.
#[derive(Clone, PartialEq, Debug)]
enum Kind {
    Estimated(Box<Estimate>),
    Recorded(Box<Recording>),
}

/// An estimated link.
#[derive(Clone, PartialEq, Debug)]
struct Estimate {
    /// The link and its goodness of fit.
    fitted: Fitted,
    /// The fitted packets.
    measurements: Measurements,
    clocks: Clocks,
    skew: Option<Skew>,
    matched: Option<Ends>,
    probed: Option<Probed>,
    held_out: Option<hold_out::Judged>,
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
    /// Estimates the link, or takes the link that the source records, and reads the link back as a scene does. `file`: path of the file with the link. A file
    /// that the link names lies beside it. Neither file needs to exist.
    ///
    /// # Errors
    ///
    /// [`FitFailure`] if no link can be fitted, or if a scene cannot hold the link.
    pub fn fit(&self, corrections: &Corrections, file: &Path) -> Result<Answered, FitFailure> {
        let measured = match &self.found {
            Found::Measured(measured) => measured,
            Found::Recorded(recording) => return recorded::answer(recording, corrections, file),
        };
        // Clocks are corrected before the packets are divided, so that both parts have the same correction.
        let (measurements, clocks, skew) = clocks::settled(corrections, measured)?;
        let parts = corrections.hold_out.map(|share| measurements.hold_out(share)).transpose();
        let parts = parts.map_err(|error| FitFailure::Measurements(format!("hold-out: {error}")))?;
        let (measurements, rest) = match parts {
            Some((first, rest)) => (first, Some(rest)),
            None => (measurements, None),
        };
        let fitted = fit::fit(&measurements)?;
        let beside = fitted.delays_csv().map(|content| Beside::new(file, "delays.csv", content));
        let scene = fitted.link.to_scene_toml(&beside.as_ref().map_or_else(String::new, Beside::name));
        let config = read_again(&scene, Some(&fitted.link), file, beside.as_ref())?;
        // The link is judged as a scene reads it, with rounded numbers, because users run that link.
        let held_out = rest.zip(config).map(|(rest, config)| hold_out::judge(&fitted, config, &measurements, &rest));
        let has_law = beside.is_none() && held_out.as_ref().is_none_or(|judged| judged.held_out.refused.is_empty());
        let estimate = Estimate { fitted, measurements, clocks, skew, matched: measured.matched.clone(), probed: measured.probed.clone(), held_out };
        Ok(Answered { scene, beside, has_law, kind: Kind::Estimated(Box::new(estimate)) })
    }
}

impl Beside {
    fn new(file: &Path, extension: &str, content: String) -> Self {
        Self { path: file.with_extension(extension), content }
    }

    /// Returns the name of the file as the value of the link's key: the file without its folder, because the file of the link lies in the same folder.
    fn name(&self) -> String {
        self.path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
    }
}
