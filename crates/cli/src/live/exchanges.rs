//! Exchanges of a session with devices that reply to messages: facts for the report, and the verdict on late replies.

use std::time::Duration;

use cohaptic_realtime::Validity;
use cohaptic_scene::Scene;

#[cfg(feature = "inverse3")]
use crate::inverse3::Exchanges;

/// Handles to facts about the devices of a session. The facts are whole once the session has dropped the devices.
#[derive(Debug, Default)]
pub(crate) struct DeviceFacts {
    /// Index of the peer, and facts of the device.
    #[cfg(feature = "inverse3")]
    pub(super) inverse3s: Vec<(usize, cohaptic_live::inverse3s::Facts)>,
}

/// Exchanges with the device of a peer.
pub(crate) struct DeviceReport {
    /// Index of the peer.
    pub(crate) peer: usize,
    pub(crate) exchanges: Exchanges,
    /// Replies that took longer than an exchange of the scene.
    late: u64,
    readings: u64,
    /// Error of the device, in words.
    pub(crate) error: Option<String>,
}

impl DeviceReport {
    /// Returns the lines of the report about the device of the peer `name`.
    pub(crate) fn lines(&self, name: &str) -> Vec<String> {
        let errors = self.error.iter().map(|error| format!("ERROR: {error}"));
        self.exchanges.lines().into_iter().chain(errors).map(|said| format!("device of {name}: {said}")).collect()
    }
}

impl DeviceFacts {
    /// Returns a report for each device that replies to messages.
    #[cfg(feature = "inverse3")]
    pub(crate) fn reports(&self, scene: &Scene) -> Vec<DeviceReport> {
        let report = |(peer, facts): &(usize, cohaptic_live::inverse3s::Facts)| {
            let summary = facts.summary();
            DeviceReport {
                peer: *peer,
                exchanges: Exchanges::of(&summary.report, scene.peers[*peer].clock.tick),
                late: summary.report.late,
                readings: summary.report.readings,
                error: summary.refusal.map(|refusal| refusal.to_string()).or(summary.error),
            }
        };
        self.inverse3s.iter().map(report).collect()
    }

    /// Returns no report: this program drives no device that replies to messages.
    #[cfg(not(feature = "inverse3"))]
    pub(crate) const fn reports(&self, _: &Scene) -> Vec<DeviceReport> {
        Vec::new()
    }
}

/// Returns the verdict on a session with devices: more than one late exchange in a thousand makes the session not valid, as late ticks do.
pub(crate) fn judge(validity: Validity, reports: &[DeviceReport]) -> Validity {
    let is_late = |report: &&DeviceReport| report.late > 1 && report.late > report.readings / 1000;
    match reports.iter().find(is_late).filter(|_| validity.is_valid()) {
        Some(report) => Validity::NotValid { late: report.late, of: report.readings, what: "exchanges with a device", limit: Duration::ZERO },
        None => validity,
    }
}

/// Exchanges of a program that drives no device with exchanges: there is no value.
#[cfg(not(feature = "inverse3"))]
#[derive(serde::Serialize)]
pub(crate) enum Exchanges {}

#[cfg(not(feature = "inverse3"))]
impl Exchanges {
    pub(crate) fn lines(&self) -> Vec<String> {
        match *self {}
    }
}
