//! Parts of the answers of `cohaptic falcon`: the structures in common to the JSON documents of several commands, and the same values as lines of text.

use std::collections::BTreeMap;
use std::time::Duration;

use cohaptic_falcon::driver::{Phase, Status};
use cohaptic_falcon::protocol::{Buttons, Leds};
use cohaptic_falcon::safety::ZeroCause;
use serde::Serialize;

use super::bench::{Bench, End};
use super::reach::{FirmwareState, Target};
pub(super) use crate::device_text::{block, length, place};
use crate::document_schema::micros;
use crate::realtime::counts;

/// Identity of the device in an answer. The optional fields are absent for a simulated device, and where the system does not give the string.
#[derive(Serialize)]
pub(super) struct Identity {
    pub(super) simulated: bool,
    serial: Option<String>,
    product: Option<String>,
    bus: Option<String>,
    address: Option<u8>,
}

impl Identity {
    pub(super) fn of(target: &Target) -> Self {
        // Only a listed device has a serial number and a place on a bus.
        let listed = target.listed().cloned();
        let (serial, product) = listed.as_ref().map_or((None, None), |listed| (listed.serial.clone(), listed.product.clone()));
        let (bus, address) = listed.map_or((None, None), |listed| (Some(listed.bus), Some(listed.address)));
        Self { simulated: target.is_simulated(), serial, product, bus, address }
    }
}

/// Statistics of the exchanges between host and device: counts since the driver was opened, except for the fields with a unit in their names.
#[derive(Clone, Serialize)]
pub(super) struct Traffic {
    pub(super) seconds: f64,
    pub(super) exchanges: u64,
    pub(super) reports: u64,
    pub(super) reports_per_s: f64,
    pub(super) timeouts: u64,
    pub(super) garbage_bytes: u64,
    pub(super) faults: u64,
    pub(super) implausible: u64,
    pub(super) unlocated: u64,
    pub(super) unhomed: u64,
    pub(super) late_turns: u64,
    pub(super) worst_late_us: f64,
    pub(super) farewells: u64,
}

impl Traffic {
    /// Reads the statistics of `bench`. `spent` is the time from the first exchange to the last, over which the rate of reports is averaged.
    pub(super) fn of(bench: &Bench, spent: Duration) -> Self {
        let statistics = bench.statistics();
        let (late_turns, worst) = bench.lateness();
        let seconds = spent.as_secs_f64();
        // An interruption before the first exchange leaves no time for a rate.
        #[expect(clippy::cast_precision_loss, reason = "a rate is shown to some digits")]
        let reports_per_s = if seconds > 0.0 { statistics.reports as f64 / seconds } else { 0.0 };
        Self {
            seconds,
            exchanges: statistics.exchanges,
            reports: statistics.reports,
            reports_per_s,
            timeouts: statistics.timeouts,
            garbage_bytes: statistics.garbage_bytes,
            faults: statistics.faults,
            implausible: statistics.implausible,
            unlocated: statistics.unlocated,
            unhomed: statistics.unhomed,
            late_turns,
            worst_late_us: micros(worst),
            farewells: statistics.farewells,
        }
    }
}

/// Statistics of the requested forces: the limit, the largest force, and the number of changes per kind of change.
#[derive(Serialize)]
pub(super) struct Forces {
    pub(super) limit_n: f64,
    pub(super) largest_n: f64,
    pub(super) limited: u64,
    pub(super) slewed: u64,
    pub(super) saturated: u64,
    pub(super) zeroed: BTreeMap<&'static str, u64>,
}

impl Forces {
    /// Reads the statistics of `bench`. Causes without a zeroed force are left out.
    pub(super) fn of(bench: &Bench, limit_n: f64, largest_n: f64) -> Self {
        let statistics = bench.statistics();
        let zeroed = ZeroCause::ALL.into_iter().map(|cause| (cause.name(), statistics.zeroed_by(cause))).filter(|(_, count)| *count > 0).collect();
        Self { limit_n, largest_n, limited: statistics.limited, slewed: statistics.slewed, saturated: statistics.saturated, zeroed }
    }
}

/// State of a device in the view of the driver. Triples of encoders are in the order top, right, left; position and velocity are `None` until homed.
#[derive(Clone, Serialize)]
pub(super) struct Seen {
    pub(super) phase: &'static str,
    pub(super) light: &'static str,
    pub(super) homed: [bool; 3],
    pub(super) encoders: [i16; 3],
    pub(super) buttons: Vec<&'static str>,
    pub(super) position_m: Option<[f64; 3]>,
    pub(super) velocity_m_s: Option<[f64; 3]>,
    pub(super) force_n: [f64; 3],
}

impl Seen {
    pub(super) fn of(status: &Status) -> Self {
        Self {
            phase: status.phase.name(),
            light: light(status.phase),
            homed: status.homed,
            encoders: status.encoders,
            buttons: buttons(status.buttons),
            position_m: status.reading.map(|reading| reading.position),
            velocity_m_s: status.reading.map(|reading| reading.velocity),
            force_n: status.force,
        }
    }
}

/// Returns the colour of the device's light in a phase.
pub(super) fn light(phase: Phase) -> &'static str {
    match phase.leds() {
        Leds::RED => "red",
        Leds::GREEN => "green",
        Leds::BLUE => "blue",
        Leds { .. } => "dark",
    }
}

/// Returns the names of the pressed buttons.
pub(super) fn buttons(pressed: Buttons) -> Vec<&'static str> {
    let names = [(Buttons::PLUS, "plus"), (Buttons::FORWARD, "forward"), (Buttons::CENTRE, "centre"), (Buttons::MINUS, "minus")];
    names.into_iter().filter(|(button, _)| pressed.contains(*button)).map(|(_, name)| name).collect()
}

impl FirmwareState {
    /// Returns the name of the state in JSON documents.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Running => "running",
            Self::Loaded => "loaded",
        }
    }
}

impl End {
    /// Returns the name of the end in JSON documents. A complete task and a passed time limit are both `complete`.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Enough | Self::Over => "complete",
            Self::Interrupted => "interrupted",
            Self::Failed(_) => "failed",
        }
    }
}

/// Returns the statistics of exchanges as two lines of text.
pub(super) fn traffic(traffic: &Traffic) -> [String; 2] {
    let Traffic { seconds, exchanges, reports_per_s, timeouts, garbage_bytes, faults, implausible, late_turns, worst_late_us, .. } = traffic;
    [
        format!(
            "{exchanges} exchanges in {seconds:.2} s, {reports_per_s:.0} reports per second; {late_turns} turns of the loop were late, the worst by {worst_late_us:.0} µs"
        ),
        format!("{timeouts} time-outs, {garbage_bytes} bytes of garbage, {faults} failed transfers, {implausible} impossible reports"),
    ]
}

/// Returns encoders and buttons as two lines of text.
pub(super) fn seen(seen: &Seen) -> [String; 2] {
    let homed = seen.homed.map(|homed| if homed { "homed" } else { "not homed" });
    let encoder = |place: usize| format!("{} ({})", seen.encoders[place], homed[place]);
    let buttons = if seen.buttons.is_empty() { "none".to_owned() } else { seen.buttons.join(", ") };
    [
        format!("encoders: top {}, right {}, left {}", encoder(0), encoder(1), encoder(2)),
        format!("buttons pressed: {buttons}; phase {}, light {}", seen.phase, seen.light),
    ]
}

/// Returns the statistics of forces as one line of text.
pub(super) fn forces(forces: &Forces) -> String {
    let Forces { limit_n, largest_n, limited, slewed, saturated, zeroed } = forces;
    let words = |all: &[(&str, u64)]| counts(all).unwrap_or_else(|| "none".to_owned());
    let changed = words(&[("limited", *limited), ("slowed", *slewed), ("more than a motor gives", *saturated)]);
    let zeroed = words(&zeroed.iter().map(|(cause, count)| (*cause, *count)).collect::<Vec<_>>());
    format!("largest force {largest_n:.3} N, limit {limit_n} N; forces changed: {changed}; set to zero: {zeroed}")
}
