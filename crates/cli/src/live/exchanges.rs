//! Exchanges of a session with devices that reply to messages: facts for the report, and the verdict on late replies.

use std::time::Duration;

use cohaptic_realtime::{Prepared, Validity};
use cohaptic_scene::Scene;
use serde::Serialize;

use crate::document_schema::document;
#[cfg(feature = "inverse3")]
use crate::inverse3::Exchanges;
use crate::realtime;

/// Name of late events in the verdict.
const EXCHANGES: &str = "exchanges with a device";

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
    /// Returns the keys of the document of the peer.
    pub(crate) fn document(&self) -> impl Serialize {
        document! { exchanges: &self.exchanges, device_error: self.error.as_deref() }
    }

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
        Some(report) => Validity::NotValid { late: report.late, of: report.readings, what: EXCHANGES, limit: Duration::ZERO },
        None => validity,
    }
}

/// Returns the notes below the report of a run with devices. `--tolerance` does not count for exchanges: the scene says how long a reply may take.
pub(crate) fn notes(prepared: &Prepared, validity: Validity) -> String {
    if !matches!(validity, Validity::NotValid { what: EXCHANGES, .. }) {
        return realtime::notes(prepared, validity);
    }
    let advice = "  what to do: give the device the exchange-every (device.exchange-every) that 99 of 100 replies fit in, or end other programs\n";
    realtime::notes(prepared, Validity::Valid) + advice
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

#[cfg(all(test, feature = "inverse3"))]
mod tests {
    use cohaptic_inverse3::client::Report;

    use super::*;

    fn judged(late: u64, readings: u64) -> Validity {
        let exchanges = Exchanges::of(&Report::default(), Duration::from_millis(1));
        judge(Validity::Valid, &[DeviceReport { peer: 0, exchanges, late, readings, error: None }])
    }

    #[test]
    fn more_than_one_late_exchange_in_a_thousand_is_not_valid_and_the_advice_is_a_key_of_the_scene() {
        assert_eq!([judged(1, 10), judged(2, 2000)], [Validity::Valid; 2]);
        let late = judged(3, 2000);
        assert_eq!(late.to_string(), "not valid: 3 of 2000 exchanges with a device were late, and at most one in a thousand may be");
        let prepared = Prepared::default();
        let advice = notes(&prepared, late);
        assert!(advice.contains("device.exchange-every") && !advice.contains("--tolerance"), "{advice}");
        let ticks = Validity::NotValid { late: 3, of: 9, what: "ticks", limit: Duration::from_millis(1) };
        assert!(notes(&prepared, ticks).contains("--tolerance") && notes(&prepared, Validity::Valid).is_empty());
        // Late ticks come first: a machine that is too busy makes replies late, too.
        let exchanges = Exchanges::of(&Report::default(), Duration::from_millis(1));
        assert_eq!(judge(ticks, &[DeviceReport { peer: 0, exchanges, late: 9, readings: 9, error: None }]), ticks);
    }
}
