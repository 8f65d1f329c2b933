//! `cohaptic router`: forwards IP packets between two network devices over emulated links.

mod answer;

use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::Duration;

use cohaptic_control::{Description, Kind, LinkCounters, LinkName, Snapshot};
use cohaptic_linkfile::router::{RouterFile, Side};
use cohaptic_realtime::{Prepared, Validity, prepare_thread};
use cohaptic_router::{LaneSnapshot, Report, Router, RunError, Written};
use cohaptic_units::Instant;

use crate::arguments::RouterArguments;
use crate::document_schema::DocumentSchema;
use crate::failure::{Failure, INTERRUPTED};
use crate::progress::Progress;
use crate::realtime::{self, ConfiguredDelay, ControlFiles, Edit, KeyedLinks, LiveControl, Publisher, counters, quantiles, say, some_length};
use crate::{input, interrupt, output};

/// Runs a router between two devices and prints its report.
pub(crate) fn router(arguments: &RouterArguments) -> Result<ExitCode, Failure> {
    let until = some_length(arguments.length)?.map(|length| Instant::ZERO.saturating_add(length));
    let file = input::with(&arguments.file, |text, file| RouterFile::parse(text, file, &arguments.set))?;
    let real_time = &arguments.real_time;
    let mut router = Router::open(&file, real_time.pace.pacing()).map_err(|error| Failure::System(error.to_string()))?;
    say(&format!("between {} and {}", attached(&file, Side::Left), attached(&file, Side::Right)));
    let (changes, wanted) = channel();
    // Each direction of a link has keys of its own, because live control can change one direction alone. Lanes 2 n and 2 n + 1 are the directions of link n.
    let keys = file.links.iter().flat_map(|link| [link.keys.clone(), link.keys.clone()]).collect();
    let folder = arguments.file.parent().map(Path::to_path_buf).unwrap_or_default();
    let editor = KeyedLinks { keys, folder, files: ControlFiles::of(&arguments.files)?, changes };
    let control = LiveControl::open(real_time, description(&file), Box::new(editor))?;
    let ran = conduct(&mut router, &file, arguments, until, &control, wanted)?;
    if arguments.json {
        output::json(DocumentSchema::ROUTER, &answer::document(&file, &ran))?;
    } else {
        output::text(&answer::describe(&file, &ran))?;
    }
    match ran {
        RouterRun { ending: Ending::Failed(error), .. } => Err(Failure::System(error.to_string())),
        RouterRun { ending: Ending::Complete | Ending::Interrupted, .. } => {
            Ok(if interrupt::requested() { ExitCode::from(INTERRUPTED) } else { ExitCode::SUCCESS })
        }
    }
}

/// Describes the device of a side: `left (tun left0 in the namespace lab)`.
fn attached(file: &RouterFile, side: Side) -> String {
    use cohaptic_linkfile::router::Attachment;
    let attachment = match side {
        Side::Left => &file.left,
        Side::Right => &file.right,
    };
    let kind = match attachment {
        Attachment::Tun(_) => "tun",
        Attachment::Interface(_) => "interface",
    };
    let within = attachment.namespace().map_or_else(String::new, |namespace| format!(" in the namespace {namespace}"));
    format!("{} ({kind} {}{within})", side.name(), attachment.device())
}

/// Results of the run of a router.
struct RouterRun {
    report: Report,
    prepared: Prepared,
    validity: Validity,
    /// Configured delays, indexed by lane: for each link the direction from the left, then the direction from the right.
    asked: Vec<ConfiguredDelay>,
    ending: Ending,
}

/// Cause of the end of a run.
#[derive(Debug)]
enum Ending {
    Complete,
    Interrupted,
    /// A device failed or vanished.
    Failed(RunError),
}

/// Runs the router on a thread of its own until its end, or until the user asks for the end. The calling thread shows the progress.
fn conduct(
    router: &mut Router,
    file: &RouterFile,
    arguments: &RouterArguments,
    until: Option<Instant>,
    control: &LiveControl,
    wanted: Receiver<Edit>,
) -> Result<RouterRun, Failure> {
    const GLANCE: Duration = Duration::from_millis(50);
    // The counters are a report from the first moment on, and the router checks `stop` all the time. A signal therefore ends the run in order.
    interrupt::has_results();
    let stop = AtomicBool::new(false);
    let progress = Progress::of_traffic(&input::named(&arguments.file).display().to_string());
    let publisher = Publisher::new(control.look(), Duration::from_millis(100));
    let ran = thread::scope(|scope| {
        let running = thread::Builder::new()
            .name("router".to_owned())
            .spawn_scoped(scope, || route(router, file, arguments, until, &stop, wanted, publisher))
            .map_err(|error| Failure::System(format!("the system gives the router no thread: {error}")))?;
        // The calling thread has nothing with a deadline, so a glance now and then is enough.
        while !running.is_finished() {
            thread::sleep(GLANCE);
            stop.store(interrupt::requested(), Ordering::Relaxed);
            progress.note(realtime::status(&control.latest()));
        }
        Ok(running.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    });
    progress.clear();
    ran
}

/// Runs the router on the current thread, which has to be on time: applies changes of links and publishes snapshots between packets.
fn route(
    router: &mut Router,
    file: &RouterFile,
    arguments: &RouterArguments,
    until: Option<Instant>,
    stop: &AtomicBool,
    wanted: Receiver<Edit>,
    mut publisher: Publisher,
) -> RouterRun {
    /// Longest time until the router takes up a change.
    const LOOK: Duration = Duration::from_millis(20);
    let prepared = prepare_thread(&arguments.real_time.pace.wishes());
    let tolerance = arguments.real_time.pace.tolerance();
    let judged = |router: &Router| tolerance.judge(router.lateness(), "packets");
    let mut asked: Vec<ConfiguredDelay> = file.links.iter().flat_map(|link| [ConfiguredDelay::of(&link.model); 2]).collect();
    let ended = router.route(stop, until, LOOK, &mut |router| {
        for Edit { link: lane, model, .. } in wanted.try_iter() {
            // Each link has two lanes in the description: `lane / 2` is the link, `lane % 2` is the side that packets come from.
            let (Some(link), Some(asked)) = (file.links.get(lane / 2), asked.get_mut(lane)) else { continue };
            let changed = router.set_link(&link.name, Some(Side::BOTH[lane % 2]), &model);
            asked.changes += u64::from(changed.is_ok());
        }
        publisher.offer(|| {
            let validity = judged(router);
            snapshot(&router.report(), validity)
        });
    });
    let ending = match ended {
        Err(error) => Ending::Failed(error),
        Ok(()) if interrupt::requested() => Ending::Interrupted,
        Ok(()) => Ending::Complete,
    };
    // Judged again after the end: the last packets may have been late.
    RouterRun { report: router.report(), prepared, validity: judged(router), asked, ending }
}

/// Returns the description of the router, in which every link stands twice: from the left and from the right.
fn description(file: &RouterFile) -> Description {
    let lanes = file.links.iter().flat_map(|link| {
        Side::BOTH.map(|from| {
            let (from, to) = (from.name(), from.opposite().name());
            // The name equals the name of the random streams of this direction.
            LinkName { name: format!("{0}.{from}->{0}.{to}", link.name), from: from.to_owned(), to: to.to_owned() }
        })
    });
    let clocks = vec!["release".to_owned()];
    Description {
        kind: Kind::Router,
        title: output::path(&file.file),
        links: lanes.collect(),
        peers: Vec::new(),
        clocks,
        measures: Vec::new(),
        body: None,
    }
}

fn snapshot(report: &Report, validity: Validity) -> Snapshot {
    Snapshot {
        elapsed: elapsed(report),
        invalid: validity.reason(),
        lateness: vec![quantiles(&report.release)],
        links: report.counters.lanes.iter().map(link).collect(),
        peers: Vec::new(),
        refused: refused(report).into_iter().filter(|(_, count)| *count > 0).collect(),
        measures: Vec::new(),
    }
}

fn elapsed(report: &Report) -> Duration {
    report.elapsed.saturating_duration_since(Instant::ZERO)
}

fn link(lane: &LaneSnapshot) -> LinkCounters {
    LinkCounters { delivered_bytes: lane.delivered_bytes, recent_delay: quantiles(&lane.recent_delay), ..counters(&lane.stats) }
}

/// Returns the numbers of packets that were dropped outside of links, by cause.
fn refused(report: &Report) -> [(&'static str, u64); 6] {
    let [left, right] = &report.counters.received;
    let written = |count: fn(&Written) -> u64| report.written.iter().map(count).sum();
    [
        ("malformed", left.malformed + right.malformed),
        ("rule", left.dropped + right.dropped),
        ("overload", report.counters.lanes.iter().map(|lane| lane.overload).sum()),
        ("full", written(|written| written.full)),
        ("too-long", written(|written| written.too_long)),
        ("refused", written(|written| written.refused)),
    ]
}
