//! One emulated link.

use std::convert::Infallible;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use cohaptic_answers::library::of_profile;
use cohaptic_answers::link::{Meter, document, too_long};
use cohaptic_linkfile::library::{NameError, ProfileName};
use cohaptic_linkfile::link_from_keys;
use cohaptic_measure::asked::Asked;
use cohaptic_measure::steady::SteadyStream;
use cohaptic_units::{Bytes, Ecn, Instant};
use cohaptic_wan::{DropCause, Fate, Link as Emulated, LinkModel, LinkName, PacketInfo, PacketRecord};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::errors::of_scene;
use crate::interrupt::{Stop, interruptible};
use crate::scene::json;

/// Link: the model, and a link of this model that runs step by step.
#[pyclass(frozen, module = "cohaptic._native")]
#[derive(Debug)]
pub(crate) struct Link {
    model: LinkModel,
    seed: u64,
    name: LinkName,
    live: Mutex<Emulated<Arc<Py<PyAny>>>>,
}

/// Returns the names of the causes of drops, indexed by code. Code 0 stands for no cause.
#[pyfunction]
pub(crate) fn causes() -> Vec<&'static str> {
    std::iter::once("").chain(DropCause::ALL.map(DropCause::name)).collect()
}

/// Returns the document of a link of the library, such as `starlink` or `starlink@1`.
#[pyfunction]
pub(crate) fn profile(name: &str) -> PyResult<String> {
    let name: ProfileName = name.parse().map_err(|error: NameError| PyValueError::new_err(error.to_string()))?;
    Ok(json(&of_profile(&name.profile)))
}

/// Returns whether a word names a link of the library, such as `starlink/down`.
#[pyfunction]
pub(crate) fn is_profile(word: &str) -> bool {
    word.parse::<ProfileName>().is_ok()
}

/// Code of a packet that never comes out of the link.
const ON_THE_WAY: u8 = u8::MAX;

const fn cause(fate: Fate) -> u8 {
    match fate {
        Fate::Dropped(cause) => cause as u8 + 1,
        Fate::Delivered(_) | Fate::Duplicated => 0,
    }
}

/// Fates of packets, indexed by packet, and fates of the copies that the link made.
#[derive(Debug)]
struct Fates {
    arrived: Vec<f64>,
    cause: Vec<u8>,
    marked: Vec<bool>,
    damaged: Vec<bool>,
    copies: Vec<PacketRecord>,
}

impl Fates {
    fn of(packets: usize) -> Self {
        let (arrived, cause) = (vec![f64::NAN; packets], vec![ON_THE_WAY; packets]);
        Self { arrived, cause, marked: vec![false; packets], damaged: vec![false; packets], copies: Vec::new() }
    }

    #[inline]
    fn take(&mut self, record: &PacketRecord) {
        if !record.fate.is_end() {
            return;
        }
        if record.copy != 0 {
            self.copies.push(*record);
            return;
        }
        // The number of a packet is its place.
        let Some(place) = usize::try_from(record.sequence).ok().filter(|place| *place < self.cause.len()) else { return };
        if let Fate::Delivered(at) = record.fate {
            self.arrived[place] = at.as_secs_f64();
        }
        self.cause[place] = cause(record.fate);
        if record.marked || record.damaged {
            (self.marked[place], self.damaged[place]) = (record.marked, record.damaged);
        }
    }
}

/// Returns the instant of a number of seconds, to the nearest nanosecond; `None` below zero and beyond the last instant.
#[inline]
fn instant(seconds: f64) -> Option<Instant> {
    // 2^64 ns and everything above it is no instant, and a comparison with NaN is false.
    if !(0.0..18_446_744_073.709_551_616).contains(&seconds) {
        return None;
    }
    // The product of seconds since 1970 with 10⁹ would be rounded to 256 ns; whole seconds and the rest are exact.
    let whole = seconds as u64;
    let rest = (seconds - seconds.trunc()) * 1e9;
    Some(Instant::from_nanos(whole.checked_mul(1_000_000_000)?.checked_add((rest + 0.5) as u64)?))
}

/// Returns the number of seconds nearest to an instant. If the [`instant`] of this number is before `at`, returns the next number: as floating-point
/// numbers, seconds since 1970 are 238 ns apart. `None` for the last microseconds of time, which no number reaches.
fn seconds(at: Instant) -> Option<f64> {
    let nearest = at.as_secs_f64();
    [nearest, nearest.next_up()].into_iter().find(|seconds| instant(*seconds).is_some_and(|reached| reached >= at))
}

fn no_instant(seconds: f64) -> PyErr {
    PyValueError::new_err(format!("{seconds} s is not an instant: expected seconds from 0 to 1.8e10"))
}

fn gone_back(at: f64) -> PyErr {
    PyValueError::new_err(format!("time goes back at {at} s: expected no instant before an earlier one"))
}

/// Number of packets between two checks for an end of the computation.
const BETWEEN: usize = 1 << 16;

/// Arrivals, causes, marks and damages of packets, and the packets, numbers, arrivals and causes of copies.
type Sent<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<u8>>,
    Bound<'py, PyArray1<bool>>,
    Bound<'py, PyArray1<bool>>,
    (Bound<'py, PyArray1<u64>>, Bound<'py, PyArray1<u8>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<u8>>),
);

/// Event: payload, number, copy, instant of the offer \[s\], instant of the fate \[s\], fate, size, marked, damaged.
type Event = (Py<PyAny>, u64, u8, f64, f64, &'static str, u64, bool, bool);

#[pymethods]
impl Link {
    /// Returns a link of keys, each `KEY=VALUE`. The seed and the names of both ends are the address of the random numbers.
    #[new]
    fn new(py: Python<'_>, keys: Vec<String>, seed: u64, sender: &str, receiver: &str) -> PyResult<Self> {
        let model = link_from_keys(&keys).map_err(|error| of_scene(py, &error))?;
        let name = LinkName::between(sender, receiver);
        let live = Mutex::new(Emulated::new(seed, &name, model.clone()));
        Ok(Self { model, seed, name, live })
    }

    /// Sends a packet at each of the times \[s\] over a new link, and returns the fates after the last arrival.
    #[pyo3(signature = (times: "numpy.ndarray", sizes: "numpy.ndarray", ecn: "bool") -> "tuple[typing.Any, ...]")]
    fn send<'py>(&self, py: Python<'py>, times: PyReadonlyArray1<'py, f64>, sizes: PyReadonlyArray1<'py, u64>, ecn: bool) -> PyResult<Sent<'py>> {
        let (times, sizes) = (times.as_slice()?, sizes.as_slice()?);
        if !(sizes.len() == 1 || sizes.len() == times.len()) {
            return Err(PyValueError::new_err(format!("{} sizes of {} packets: expected one of all, or one of each", sizes.len(), times.len())));
        }
        let sent = interruptible(py, |stop: &Stop| self.sent(times, sizes, ecn, stop))?;
        let Fates { arrived, cause, marked, damaged, copies } = sent?;
        let at = |record: &PacketRecord| if let Fate::Delivered(at) = record.fate { at.as_secs_f64() } else { f64::NAN };
        let copies = (
            copies.iter().map(|record| record.sequence).collect::<Vec<_>>().into_pyarray(py),
            copies.iter().map(|record| record.copy).collect::<Vec<_>>().into_pyarray(py),
            copies.iter().map(at).collect::<Vec<_>>().into_pyarray(py),
            copies.iter().map(|record| self::cause(record.fate)).collect::<Vec<_>>().into_pyarray(py),
        );
        Ok((arrived.into_pyarray(py), cause.into_pyarray(py), marked.into_pyarray(py), damaged.into_pyarray(py), copies))
    }

    /// Sends a steady stream over a new link, a packet each `every` \[s\], and returns the document of `cohaptic link --json`. `said`: the link as the
    /// user wrote it.
    fn measure(&self, py: Python<'_>, said: String, packets: u64, every: f64, size: u64, ecn: bool) -> PyResult<String> {
        if packets == 0 {
            return Err(PyValueError::new_err("0 packets: expected at least 1"));
        }
        let no_time = |_| PyValueError::new_err(format!("{every} s is not a time between packets: expected seconds, from 0 on"));
        let every = Duration::try_from_secs_f64(every).map_err(no_time)?;
        let stream =
            SteadyStream { packets, every, info: PacketInfo { size: Bytes::new(size), ecn: if ecn { Ecn::Capable0 } else { Ecn::NotCapable } } };
        if let Some(why) = too_long(&stream) {
            return Err(PyValueError::new_err(why));
        }
        interruptible(py, |stop: &Stop| {
            let mut meter = Meter::default();
            let mut link = Emulated::new(self.seed, &self.name, self.model.clone());
            let record = |record: &PacketRecord| {
                meter.record(record);
                Ok::<(), Infallible>(())
            };
            let Ok(sent) = stream.over(&mut link, record, |_, _| !stop.is_asked());
            let asked = Asked::of(&self.model, every, stream.info.size);
            json(&document(&meter.finish(said, asked, [sent, packets], link.stats().cross_traffic()), None))
        })
    }

    /// Offers a packet at the instant `now` \[s\].
    fn handle_packet(&self, now: f64, size: u64, payload: Py<PyAny>, ecn: bool) -> PyResult<()> {
        let at = instant(now).ok_or_else(|| no_instant(now))?;
        let info = PacketInfo { size: Bytes::new(size), ecn: if ecn { Ecn::Capable0 } else { Ecn::NotCapable } };
        self.live().handle_packet(at, info, Arc::new(payload)).map_err(|_| gone_back(now))
    }

    /// Lets time pass until `now` \[s\], and returns the events since the last call.
    #[pyo3(signature = (now: "float") -> "list[tuple[typing.Any, int, int, float, float, str, int, bool, bool]]")]
    fn poll(&self, py: Python<'_>, now: f64) -> PyResult<Vec<Event>> {
        let at = instant(now).ok_or_else(|| no_instant(now))?;
        let mut live = self.live();
        live.handle_timeout(at).map_err(|_| gone_back(now))?;
        let mut happened = Vec::new();
        while let Some(event) = live.poll_event() {
            let record = event.record;
            happened.push((
                event.payload.clone_ref(py),
                record.sequence,
                record.copy,
                record.offered.as_secs_f64(),
                record.at.as_secs_f64(),
                record.fate.name(),
                record.size.get(),
                record.marked,
                record.damaged,
            ));
        }
        Ok(happened)
    }

    /// Instant of the next event \[s\]: `poll` with this number returns the event. `None` if no packet is on the way.
    #[getter]
    fn next(&self) -> Option<f64> {
        self.live().poll_timeout().and_then(seconds)
    }

    /// Replaces the model from the instant `now` \[s\] on. Packets on the way stay on the way.
    fn change(&self, py: Python<'_>, now: f64, keys: Vec<String>) -> PyResult<()> {
        let at = instant(now).ok_or_else(|| no_instant(now))?;
        let model = link_from_keys(&keys).map_err(|error| of_scene(py, &error))?;
        self.live().set_model(at, model).map_err(|_| gone_back(now))
    }
}

impl Link {
    fn live(&self) -> std::sync::MutexGuard<'_, Emulated<Arc<Py<PyAny>>>> {
        self.live.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn sent(&self, times: &[f64], sizes: &[u64], ecn: bool, stop: &Stop) -> PyResult<Fates> {
        let mut link = Emulated::new(self.seed, &self.name, self.model.clone());
        let mut fates = Fates::of(times.len());
        for (chunk, place) in times.chunks(BETWEEN).zip((0..).step_by(BETWEEN)) {
            if stop.is_asked() {
                break;
            }
            for (now, place) in chunk.iter().zip(place..) {
                let size = if let [size] = sizes { *size } else { sizes[place] };
                let info = PacketInfo { size: Bytes::new(size), ecn: if ecn { Ecn::Capable0 } else { Ecn::NotCapable } };
                let at = instant(*now).ok_or_else(|| no_instant(*now))?;
                link.handle_packet(at, info, ()).map_err(|_| gone_back(*now))?;
                while let Some(event) = link.poll_event() {
                    fates.take(&event.record);
                }
            }
        }
        // It is the last instant of all.
        let _ = link.handle_timeout(Instant::MAX);
        while let Some(event) = link.poll_event() {
            fates.take(&event.record);
        }
        Ok(fates)
    }
}
