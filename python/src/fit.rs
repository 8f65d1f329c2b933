//! Links that are estimated from measurements.

use std::path::{Path, PathBuf};
use std::time::Duration;

use cohaptic_answers::fit::{Corrections, Direction, FitFailure, ReadAs, Source, SourceError, Tick, document};
use cohaptic_files::{LimitedFile, MOST_BYTES, MOST_CAPTURE_BYTES};
use cohaptic_measure::fit::{Measurement, Measurements};
use cohaptic_scene::SceneError;
use cohaptic_units::Bytes;
use numpy::PyReadonlyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::errors::{of_fault, of_scene, of_value};
use crate::interrupt::{Stop, interruptible};
use crate::scene::json;

/// Name that `cohaptic fit` gives to the file with the link.
const FILE: &str = "link.toml";

fn unreadable(py: Python<'_>, path: &Path, source: std::io::Error) -> PyErr {
    of_scene(py, &SceneError::Read { path: path.to_path_buf(), source, place: None })
}

fn named(py: Python<'_>, path: &Path, why: &dyn std::fmt::Display) -> PyErr {
    of_fault(py, &format!("{}: {why}", path.display()))
}

fn open(py: Python<'_>, path: &Path) -> PyResult<LimitedFile> {
    LimitedFile::open(path, MOST_CAPTURE_BYTES).map_err(|error| unreadable(py, path, error))
}

/// Measurements from files or arrays.
#[pyclass(frozen, module = "cohaptic._native")]
#[derive(Debug)]
pub(crate) struct Delays {
    source: Source,
}

#[pymethods]
impl Delays {
    /// Reads a table of delays, a log of fates, a file of another program, or the captures of both ends. `direction` is `up`, `down` or `rtt`. `split` is the
    /// share of the round trip that is the delay. `instant_bytes` is the number of bytes that leave at each instant of a line. `walk` asks for a walk of the
    /// rate.
    #[staticmethod]
    #[pyo3(signature = (file, receiver = None, port = None, direction = None, split = None, instant_bytes = None, walk = false))]
    #[expect(clippy::too_many_arguments, reason = "the options of `cohaptic fit`")]
    fn read(
        py: Python<'_>,
        file: PathBuf,
        receiver: Option<PathBuf>,
        port: Option<u16>,
        direction: Option<&str>,
        split: Option<f64>,
        instant_bytes: Option<u64>,
        walk: bool,
    ) -> PyResult<Self> {
        let from = open(py, &file)?;
        let direction = match direction {
            None => None,
            Some("up") => Some(Direction::Up),
            Some("down") => Some(Direction::Down),
            Some("rtt") => Some(Direction::Rtt),
            Some(other) => return Err(of_value(&format!("direction: found {other:?}, expected \"up\", \"down\" or \"rtt\""))),
        };
        let read_as = ReadAs { direction, split, bytes: instant_bytes.map(Bytes::new), walk };
        let Some(receiver) = receiver else {
            let source = interruptible(py, |_: &Stop| Source::read(from, |rest| rest.limited_to(MOST_BYTES), &read_as))?;
            let source = source.map_err(|error| match error {
                SourceError::Io(error) => unreadable(py, &file, error),
                SourceError::NotText { .. } | SourceError::OneEnd | SourceError::Content(_) => named(py, &file, &error),
            })?;
            return Ok(Self { source });
        };
        let to = open(py, &receiver)?;
        let source = interruptible(py, |_: &Stop| Source::between(from, to, port))?;
        let refused = |error| of_fault(py, &format!("{}, {}: {error}", file.display(), receiver.display()));
        Ok(Self { source: source.map_err(refused)? })
    }

    /// Returns measurements from arrays: the instant of sending \[s\] and the delay \[s\] of each packet. The delay of a lost packet is NaN.
    #[staticmethod]
    #[pyo3(signature = (sent: "numpy.ndarray", delays: "numpy.ndarray") -> "Delays")]
    fn of<'py>(py: Python<'py>, sent: PyReadonlyArray1<'py, f64>, delays: PyReadonlyArray1<'py, f64>) -> PyResult<Self> {
        let (sent, delays) = (sent.as_slice()?, delays.as_slice()?);
        if sent.len() != delays.len() {
            return Err(PyValueError::new_err(format!("{} instants and {} delays: expected one delay of each packet", sent.len(), delays.len())));
        }
        let packet = |(sent_s, delay_s): (&f64, &f64)| Measurement { sent_s: *sent_s, delay_s: Some(*delay_s).filter(|delay| !delay.is_nan()) };
        let measurements = Measurements::new(sent.iter().zip(delays).map(packet).collect()).map_err(|error| of_fault(py, &error.to_string()))?;
        Ok(Self { source: Source::of(measurements) })
    }

    /// Estimates the link, and returns the document of `cohaptic fit --json`. `offset`, `least` and `tick` are in seconds.
    #[pyo3(signature = (offset, least, skew, tick, cut, hold_out))]
    #[expect(clippy::too_many_arguments, reason = "the options of `cohaptic fit`")]
    fn fit(
        &self,
        py: Python<'_>,
        offset: Option<f64>,
        least: Option<f64>,
        skew: bool,
        tick: Option<f64>,
        cut: bool,
        hold_out: Option<f64>,
    ) -> PyResult<String> {
        if hold_out.is_some_and(|share| !(share > 0.0 && share < 1.0)) {
            return Err(PyValueError::new_err("hold_out: expected a part above 0 and below 1"));
        }
        let span = |name: &str, seconds: Option<f64>| {
            seconds.map(Duration::try_from_secs_f64).transpose().map_err(|error| of_value(&format!("{name}: {error}")))
        };
        let least = span("least", least)?;
        let tick = span("tick", tick)?.map(|tick| if cut { Tick::Cut(tick) } else { Tick::Rounded(tick) });
        if offset.is_some_and(|offset| !offset.is_finite()) {
            return Err(PyValueError::new_err("offset: expected a finite number of seconds"));
        }
        let corrections = Corrections { offset_s: offset, least, skew, tick, hold_out };
        let answered = interruptible(py, |_: &Stop| self.source.fit(&corrections, Path::new(FILE)))?;
        match answered {
            Ok(answered) => Ok(json(&document(&answered))),
            Err(FitFailure::Scene(error)) => Err(of_scene(py, &error)),
            Err(error @ FitFailure::LongDelays { .. }) => {
                Err(of_fault(py, &format!("{error} offset and least are for clocks that are; with offset=0.0 the delays are taken as they are")))
            }
            Err(error @ (FitFailure::Measurements(_) | FitFailure::Fit(_) | FitFailure::Unheld(_))) => Err(of_fault(py, &error.to_string())),
        }
    }
}
