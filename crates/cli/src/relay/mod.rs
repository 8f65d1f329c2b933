//! `cohaptic relay`: forwards UDP datagrams between programs over emulated links.

mod answer;
mod setup;

use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use cohaptic_control::{Description, Kind, LinkCounters, LinkName, Snapshot};
use cohaptic_realtime::Tolerance;
use cohaptic_realtime::udp::EndpointConfig;
use cohaptic_relay::{Control, LinkReport, Relay, RelayError, Report, RunOptions, View};
use cohaptic_units::Instant;
use cohaptic_wan::NodeId;

use crate::arguments::RelayArguments;
use crate::document_schema::DocumentSchema;
use crate::failure::{Failure, INTERRUPTED};
use crate::progress::Progress;
use crate::realtime::{self, ControlFiles, Edit, KeyedLinks, LiveControl, Publisher, counters, quantiles, quantiles_of, say, some_length};
use crate::{interrupt, output};
use setup::Setup;

/// Runs a relay between programs and prints its report.
pub(crate) fn relay(arguments: &RelayArguments) -> Result<ExitCode, Failure> {
    let length = some_length(arguments.length)?;
    let mut setup = Setup::new(arguments)?;
    let mut relay = Relay::bind(setup.config.clone(), EndpointConfig::default()).map_err(failure)?;
    setup.opened(relay.ports()).iter().for_each(|line| say(line));
    let (changes, wanted) = channel();
    let files = ControlFiles::of(&arguments.files)?;
    let editor = KeyedLinks { keys: std::mem::take(&mut setup.keys), folder: setup.folder.clone(), files, changes };
    let control = LiveControl::open(&arguments.real_time, description(&setup), Box::new(editor))?;
    let options = RunOptions {
        pacing: arguments.real_time.pace.pacing(),
        wishes: arguments.real_time.pace.wishes(),
        tolerance: setup.tolerance,
        duration: length,
        ..RunOptions::default()
    };
    let (report, edits) = conduct(&mut relay, &setup, &options, &control, &wanted)?;
    let asked = setup.asked(&edits, report.elapsed);
    let is_interrupted = interrupt::requested();
    if arguments.json {
        output::json(DocumentSchema::RELAY, &answer::document(&setup, &report, &asked, is_interrupted))?;
    } else {
        output::text(&answer::describe(&setup, &report, &asked))?;
    }
    Ok(if is_interrupted { ExitCode::from(INTERRUPTED) } else { ExitCode::SUCCESS })
}

fn failure(error: RelayError) -> Failure {
    if matches!(error, RelayError::Config(_)) { Failure::Input(error.to_string()) } else { Failure::System(error.to_string()) }
}

/// Runs the relay until its end, or until the user asks for the end. Returns the report and the number of changes from outside, indexed by link.
fn conduct(
    relay: &mut Relay,
    setup: &Setup,
    options: &RunOptions,
    control: &LiveControl,
    wanted: &Receiver<Edit>,
) -> Result<(Report, Vec<u64>), Failure> {
    const GLANCE: Duration = Duration::from_millis(50);
    // The counters are a report from the first moment on, and the relay checks `stop` all the time. A signal therefore ends the run in order.
    interrupt::has_results();
    let mut publisher = Publisher::new(control.look(), publish_every(setup.pairs.len()));
    let (say, heard) = channel();
    let stop = AtomicBool::new(false);
    let mut edits = vec![0; setup.pairs.len()];
    let progress = Progress::of_traffic(&setup.title);
    let report = thread::scope(|scope| {
        let running = thread::Builder::new().name("relay".to_owned()).spawn_scoped(scope, || {
            // A receiver cannot be shared between threads, so the closure takes the receiver by value.
            let heard = heard;
            relay.run(options, &heard, &stop, |view| publisher.offer(|| snapshot(view, &setup.pairs, options.tolerance)))
        });
        let running = running.map_err(|error| Failure::System(format!("the system gives the relay no thread: {error}")))?;
        while !running.is_finished() {
            match wanted.recv_timeout(GLANCE) {
                Ok(Edit { link, model, .. }) => {
                    if let (Some((from, to)), Some(edits)) = (setup.pairs.get(link), edits.get_mut(link)) {
                        // A relay that has just ended no longer receives. Such a change is not counted.
                        let is_heard = say.send(Control::SetLink { from: *from, to: *to, model: Box::new(model) }).is_ok();
                        *edits += u64::from(is_heard);
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                // Without live control no change can come, and the receiver returns at once. The sleep keeps this loop from spinning.
                Err(RecvTimeoutError::Disconnected) => thread::sleep(GLANCE),
            }
            stop.store(interrupt::requested(), Ordering::Relaxed);
            progress.note(realtime::status(&control.latest()));
        }
        running.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)).map_err(failure)
    });
    progress.clear();
    Ok((report?, edits))
}

fn description(setup: &Setup) -> Description {
    let link = |(from, to)| {
        let (from, to) = (setup.name(from).to_owned(), setup.name(to).to_owned());
        LinkName { name: format!("{from}->{to}"), from, to }
    };
    Description {
        kind: Kind::Relay,
        title: setup.title.clone(),
        links: setup.pairs.iter().copied().map(link).collect(),
        peers: Vec::new(),
        clocks: vec!["release".to_owned()],
        measures: Vec::new(),
        body: None,
    }
}

/// Returns the interval between two snapshots of a relay with `links` links. A snapshot of a large mesh takes milliseconds, in which packets wait, so the
/// interval grows with the number of links.
fn publish_every(links: usize) -> Duration {
    const LINKS_IN_A_MOMENT: usize = 500;
    // 100 ms per 500 links, at most 5 s.
    let moments = u32::try_from(links.div_ceil(LINKS_IN_A_MOMENT)).unwrap_or(u32::MAX).clamp(1, 50);
    Duration::from_millis(100) * moments
}

/// Takes a snapshot of the relay. `pairs` holds sender and receiver of each link in the order of the description.
fn snapshot(view: &View<'_>, pairs: &[(NodeId, NodeId)], tolerance: Tolerance) -> Snapshot {
    let links = view.links();
    let validity = tolerance.judge(view.release(), "datagrams");
    Snapshot {
        elapsed: view.now().saturating_duration_since(Instant::ZERO),
        invalid: validity.reason(),
        lateness: vec![quantiles(&view.release().summary())],
        links: links.iter().zip(pairs).map(|(report, (from, to))| link(report, view.recent_delays(*from, *to))).collect(),
        peers: Vec::new(),
        refused: refused(view, &links),
        measures: Vec::new(),
    }
}

fn link(report: &LinkReport, recent: &[Duration]) -> LinkCounters {
    LinkCounters { delivered_bytes: report.counts.delivered_bytes, recent_delay: quantiles_of(recent), ..counters(&report.stats) }
}

fn refused(view: &View<'_>, links: &[LinkReport]) -> Vec<(&'static str, u64)> {
    let undeliverable = links.iter().map(|link| link.counts.undeliverable).sum();
    let all = answer::refused(view.intake()).into_iter().chain([("undeliverable", undeliverable)]);
    all.filter(|(_, count)| *count > 0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_large_mesh_is_looked_at_less_often() {
        assert_eq!([2, 500, 501, 65_280].map(publish_every), [100, 100, 200, 5000].map(Duration::from_millis));
    }
}
