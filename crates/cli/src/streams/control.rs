//! Live control of a relay of TCP: changes of streams by keys, and snapshots of the lines.

use std::path::Path;
use std::sync::mpsc::Sender;

use cohaptic_control::{Description, Kind, LinkCounters, LinkEditor, LinkName, Snapshot};
use cohaptic_linkfile::LinkKeys;
use cohaptic_linkfile::reading::FileReader;
use cohaptic_linkfile::stream::stream_of_keys;
use cohaptic_realtime::Tolerance;
use cohaptic_streams::{Control, View};
use cohaptic_units::Instant;
use cohaptic_units::print::Counted;

use super::setup::Setup;
use crate::document_schema::micros;
use crate::realtime::{counters, quantiles, quantiles_of};

/// Editor of the streams of a run. Checks each change of keys and sends valid changes to the run.
#[derive(Debug)]
pub(super) struct StreamKeys {
    /// Keys of each line.
    pub(super) keys: Vec<LinkKeys>,
    pub(super) changes: Sender<Control>,
}

impl LinkEditor for StreamKeys {
    fn keys(&self, line: usize) -> Vec<(String, String)> {
        self.keys.get(line).map_or_else(Vec::new, |keys| keys.iter().map(|(key, value)| (key.to_owned(), value.to_owned())).collect())
    }

    fn change(&mut self, lines: &[usize], keys: &[(String, String)]) -> Result<(), String> {
        // All changes are checked before the first is applied, so that a change of several lines applies to all lines or to no line.
        let changed = lines.iter().map(|line| {
            let old = self.keys.get(*line).ok_or_else(|| format!("there is no link {line}"))?;
            let new = keys.iter().fold(old.clone(), |laid, (key, value)| laid.with(key, value));
            let refuse = |_: &Path| Err(std::io::Error::other("live control of relay --tcp reads no files"));
            let stream = stream_of_keys(&new, Path::new(""), FileReader(&refuse)).map_err(|error| {
                let at = error.diagnostic().map_or("", |diagnostic| diagnostic.override_text().unwrap_or_else(|| diagnostic.key()));
                format!("{}: {}", at.strip_prefix("link.").unwrap_or(at), error.bare_message())
            })?;
            Ok((new, Control { line: *line, stream: Box::new(stream) }))
        });
        let changed: Vec<_> = changed.collect::<Result<_, String>>()?;
        for (keys, change) in changed {
            // The index is valid, because `get` found keys for each of `lines` above.
            self.keys[change.line] = keys;
            self.changes.send(change).map_err(|_| "the run has ended".to_owned())?;
        }
        Ok(())
    }
}

pub(super) fn description(setup: &Setup) -> Description {
    let links = setup.config.proxies.iter().flat_map(|proxy| {
        let [client, server] = setup.ends(&proxy.name);
        let link = |from: &str, to: &str| LinkName { name: format!("{from}->{to}"), from: from.to_owned(), to: to.to_owned() };
        [link(&client, &server), link(&server, &client)]
    });
    Description {
        kind: Kind::Relay,
        title: setup.title.clone(),
        links: links.collect(),
        peers: Vec::new(),
        clocks: vec!["release".to_owned()],
        measures: Vec::new(),
        body: None,
    }
}

/// Takes a snapshot of the relay. Packets of a line are its pieces.
pub(super) fn snapshot(view: &View<'_>, setup: &Setup, tolerance: Tolerance) -> Snapshot {
    let proxies = setup.config.proxies.len();
    let link = |line: usize| {
        let report = view.line(line)?;
        let recent_delay = quantiles_of(view.recent_delays(line));
        Some(LinkCounters { delivered_bytes: report.bytes.sent, recent_delay, ..counters(&report.pieces) })
    };
    let refused: u64 = (0..proxies).filter_map(|proxy| view.counts(proxy)).map(|counts| counts.refused).sum();
    Snapshot {
        elapsed: view.now().saturating_duration_since(Instant::ZERO),
        invalid: tolerance.judge(view.release(), "writes").reason(),
        lateness: vec![quantiles(&view.release().summary())],
        links: (0..2 * proxies).filter_map(link).collect(),
        peers: Vec::new(),
        refused: (refused > 0).then_some(("refused", refused)).into_iter().collect(),
        measures: Vec::new(),
    }
}

/// Formats a snapshot as one line for a terminal.
pub(super) fn status(snapshot: &Snapshot) -> String {
    let bytes: u64 = snapshot.links.iter().map(|link| link.delivered_bytes).sum();
    let p99 = snapshot.lateness.first().map_or(0.0, |lateness| micros(lateness.p99));
    format!("{} passed on, release error p99 {p99:.0} µs", Counted(bytes, "byte"))
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_change_of_several_lines_is_made_whole_or_not_at_all() {
        let (changes, made) = channel();
        let keys = vec![LinkKeys::default().with("delay", "8ms"), LinkKeys::default().with("netem", "delay 3ms")];
        let mut lines = StreamKeys { keys, changes };
        let pair = |key: &str, value: &str| vec![(key.to_owned(), value.to_owned())];
        // Words of tc say everything about the second line's delay.
        assert!(lines.change(&[0, 1], &pair("delay", "9ms")).unwrap_err().contains("netem"));
        assert!(made.try_recv().is_err());
        assert!(lines.change(&[0], &pair("loss", "1%")).unwrap_err().contains("cohaptic exec"));
        assert!(lines.change(&[7], &pair("stall", "1s")).is_err());
        lines.change(&[0, 1], &pair("stall", "1s")).unwrap();
        let change = made.try_recv().unwrap();
        assert_eq!((change.line, change.stream.faults.stall.unwrap().fault.after), (0, Duration::from_secs(1)));
        assert_eq!(made.try_recv().unwrap().line, 1);
        assert_eq!(lines.keys(0).len(), 2);
    }
}
