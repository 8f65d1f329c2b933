//! `cohaptic run`.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant as Clock;

use cohaptic_harness::record::{Bands, RecordError, Recorder};
use cohaptic_harness::{Ending, Model, Observer, PacketRow, Simulation, Summary, TickRow};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;
use cohaptic_units::print::Span;
use cohaptic_wan::{DropCause, LinkStats};
use serde::Serialize;

use crate::arguments::RunArguments;
use crate::failure::{Failure, INTERRUPTED};
use crate::progress::Progress;
use crate::{failure, interrupt, output, terminal_plot};

/// Runs a scene, or a scene and a variant of it, and says what happened.
pub(crate) fn run(arguments: &RunArguments) -> Result<ExitCode, Failure> {
    let overrides = &arguments.scene.overrides.set;
    let scene = Scene::read(&arguments.scene.scene, overrides)?;
    // Both scenes are read before either runs: a mistake in the second is not found after a long first run.
    let variant = if arguments.against.is_empty() {
        None
    } else {
        let both: Vec<String> = overrides.iter().chain(&arguments.against).cloned().collect();
        let mut variant = Scene::read(&arguments.scene.scene, &both).map_err(|error| failure::of_variant(error, &arguments.against))?;
        variant.title = format!("{}, with {}", variant.title, arguments.against.join(", "));
        Some(variant)
    };
    let first = run_one(arguments, &scene, arguments.out.clone())?;
    let second = match &variant {
        Some(variant) if !interrupt::asked() => Some(run_one(arguments, variant, arguments.out.as_ref().map(|out| out.join("against")))?),
        _ => None,
    };
    if arguments.scene.json {
        let mut document = Document::new(&scene, &first);
        document.against = variant.as_ref().zip(second.as_ref()).map(|(variant, run)| Box::new(Document::new(variant, run)));
        output::json(&document)?;
    } else {
        let mut text = format!("{}\n{}", scene.title, describe(&scene, &first));
        if let Some((variant, run)) = variant.as_ref().zip(second.as_ref()) {
            let _ = write!(text, "\nAgainst {}:\n{}", arguments.against.join(", "), describe(variant, run));
        }
        output::text(&text)?;
    }
    Ok(if interrupt::asked() { ExitCode::from(INTERRUPTED) } else { ExitCode::SUCCESS })
}

/// A run and what it left behind.
struct Run {
    summary: Summary,
    wall_s: f64,
    positions: Option<Bands>,
    files: Vec<PathBuf>,
}

fn run_one(arguments: &RunArguments, scene: &Scene, out: Option<PathBuf>) -> Result<Run, Failure> {
    let model = if arguments.general { Model::General } else { Model::Least };
    let simulation = Simulation::new(scene, model);
    let shown = !arguments.scene.json && !arguments.no_plot;
    let mut watch = Watch {
        progress: Progress::through_scene(&scene.title, scene.duration),
        positions: shown.then(|| Bands::new(scene.duration, PLOT_SPANS, scene.peers.len())),
    };
    let start = Clock::now();
    let (summary, files) = match out.as_deref() {
        None => (simulation.run(&mut &mut watch)?, Vec::new()),
        Some(folder) => record(&simulation, scene, folder, &mut watch)?,
    };
    let wall_s = start.elapsed().as_secs_f64();
    watch.progress.clear();
    Ok(Run { summary, wall_s, positions: watch.positions, files })
}

fn record(simulation: &Simulation<'_>, scene: &Scene, folder: &Path, watch: &mut Watch) -> Result<(Summary, Vec<PathBuf>), Failure> {
    let mut observer = (Recorder::create(folder, scene)?, watch);
    let summary = simulation.run(&mut observer)?;
    let files = observer.0.finish(&summary)?;
    Ok((summary, files))
}

/// Twice the columns of the plot in the terminal: two dots a column.
const PLOT_SPANS: usize = 144;

/// Shows progress, collects what the terminal shows, and ends the run when the user asks for it.
struct Watch {
    progress: Progress,
    positions: Option<Bands>,
}

impl Observer for &mut Watch {
    type Error = RecordError;

    fn wants_ticks(&self) -> bool {
        self.positions.is_some()
    }

    fn wants_packets(&self) -> bool {
        false
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), RecordError> {
        if let Some(positions) = &mut self.positions {
            positions.add(row.peer, row.at, row.object.position[0]);
        }
        Ok(())
    }

    fn on_packet(&mut self, _row: &PacketRow) -> Result<(), RecordError> {
        Ok(())
    }

    fn keep_going(&mut self, now: Instant) -> bool {
        self.progress.reach(now);
        !interrupt::asked()
    }
}

/// The JSON document of a run.
#[derive(Serialize)]
struct Document {
    title: String,
    duration_s: f64,
    ticks: u64,
    ending: &'static str,
    wall_s: f64,
    realtime_factor: f64,
    peers: Vec<PeerDocument>,
    links: Vec<LinkDocument>,
    access_lines: Vec<AccessDocument>,
    max_discrepancy_m: f64,
    files: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    against: Option<Box<Self>>,
}

#[derive(Serialize)]
struct PeerDocument {
    name: String,
    position_m: Components,
    velocity_m_s: Components,
    stale_samples: u64,
}

/// A number in a scene of one axis, a list with more.
#[derive(Serialize)]
#[serde(untagged)]
enum Components {
    One(f64),
    More(Vec<f64>),
}

#[derive(Serialize)]
struct LinkDocument {
    from: String,
    to: String,
    #[serde(flatten)]
    counters: Counters,
}

#[derive(Serialize)]
struct AccessDocument {
    peer: String,
    line: &'static str,
    #[serde(flatten)]
    counters: Counters,
}

#[derive(Serialize)]
struct Counters {
    offered: u64,
    duplicated: u64,
    delivered: u64,
    dropped: std::collections::BTreeMap<&'static str, u64>,
    in_flight: u64,
    mean_delay_s: Option<f64>,
}

impl Document {
    fn new(scene: &Scene, run: &Run) -> Self {
        let summary = &run.summary;
        let name = |peer: usize| scene.peers[peer].name.clone();
        let duration_s = summary.duration.as_secs_f64();
        let link =
            |link: &cohaptic_harness::LinkSummary| LinkDocument { from: name(link.from), to: name(link.to), counters: Counters::new(&link.stats) };
        let line = |line: &cohaptic_harness::AccessSummary| AccessDocument {
            peer: name(line.peer),
            line: if line.uplink { "uplink" } else { "downlink" },
            counters: Counters::new(&line.stats),
        };
        let peer = |peer: &cohaptic_harness::PeerSummary| PeerDocument {
            name: peer.name.clone(),
            position_m: Components::new(&peer.position),
            velocity_m_s: Components::new(&peer.velocity),
            stale_samples: peer.stale_samples,
        };
        Self {
            title: scene.title.clone(),
            duration_s,
            ticks: summary.ticks,
            ending: ending_name(summary.ending),
            wall_s: run.wall_s,
            realtime_factor: duration_s / run.wall_s,
            peers: summary.peers.iter().map(peer).collect(),
            links: summary.links.iter().map(link).collect(),
            access_lines: summary.access_lines.iter().map(line).collect(),
            max_discrepancy_m: summary.max_discrepancy,
            files: run.files.iter().map(|file| output::path(file)).collect(),
            against: None,
        }
    }
}

impl Components {
    fn new(values: &[f64]) -> Self {
        match values {
            [value] => Self::One(*value),
            values => Self::More(values.to_vec()),
        }
    }
}

impl Counters {
    fn new(stats: &LinkStats) -> Self {
        Self {
            offered: stats.offered(),
            duplicated: stats.duplicated(),
            delivered: stats.delivered(),
            dropped: DropCause::ALL.into_iter().map(|cause| (cause.name(), stats.dropped(cause))).collect(),
            in_flight: stats.in_flight(),
            mean_delay_s: stats.mean_delay().map(|delay| delay.as_secs_f64()),
        }
    }
}

fn ending_name(ending: Ending) -> &'static str {
    match ending {
        Ending::Complete => "complete",
        Ending::Diverged(_) => "diverged",
        Ending::Interrupted(_) => "interrupted",
    }
}

/// A run in words.
fn describe(scene: &Scene, run: &Run) -> String {
    let mut text = String::new();
    let summary = &run.summary;
    // Writing to a string does not fail.
    let mut line = |line: String| {
        let _ = writeln!(text, "{line}");
    };
    if let Some(positions) = &run.positions {
        line(format!("position of each copy of the object{}", if scene.axes.count() > 1 { ", along x" } else { "" }));
        line(terminal_plot::draw(positions, 100.0, "cm").trim_end().to_owned());
    }
    let simulated = Span(summary.duration);
    match summary.ending {
        Ending::Complete => {}
        Ending::Diverged(at) => line(format!("  DIVERGED: at {at} a position or a velocity is no finite number any more")),
        Ending::Interrupted(_) => line(format!("  INTERRUPTED after {simulated} of {}", Span(scene.duration))),
    }
    let factor = summary.duration.as_secs_f64() / run.wall_s;
    line(format!("  {simulated} simulated, {} ticks, in {:.3} s: {factor:.0} times real time", summary.ticks, run.wall_s));
    line(format!("  largest discrepancy between two copies: {}", length(summary.max_discrepancy)));
    for peer in summary.peers.iter().take(MOST_PEERS) {
        let position: Vec<String> = peer.position.iter().map(|x| length(*x)).collect();
        line(format!("  {} ends at {}", peer.name, position.join(", ")));
    }
    if summary.peers.len() > MOST_PEERS {
        line(format!("  ... and {} more peers", summary.peers.len() - MOST_PEERS));
    }
    line(format!("  {}", packets(summary)));
    for file in run.files.iter().filter(|file| file.extension().is_some_and(|extension| extension == "svg")) {
        line(format!("  plot: {}", file.display()));
    }
    text
}

/// The summary for people names this many peers at most.
const MOST_PEERS: usize = 8;

fn length(metres: f64) -> String {
    if metres.abs() < 1e4 { format!("{:.3} mm", metres * 1e3) } else { format!("{metres:.3e} m") }
}

/// What became of all packets.
fn packets(summary: &Summary) -> String {
    let stats = || summary.links.iter().map(|link| &link.stats).chain(summary.access_lines.iter().map(|line| &line.stats));
    let entries: u64 = summary.links.iter().map(|link| link.stats.offered()).sum();
    let dropped = DropCause::ALL.into_iter().map(|cause| (cause, stats().map(|stats| stats.dropped(cause)).sum::<u64>()));
    let dropped: Vec<String> = dropped.filter(|(_, count)| *count > 0).map(|(cause, count)| format!("{count} dropped ({})", cause.name())).collect();
    let delivered: u64 = summary.links.iter().map(|link| link.stats.delivered()).sum();
    let stale: u64 = summary.peers.iter().map(|peer| peer.stale_samples).sum();
    let mut parts = vec![format!("{entries} packets offered to {} links", summary.links.len()), format!("{delivered} delivered")];
    parts.extend(dropped);
    if stale > 0 {
        parts.push(format!("{stale} too late to be used"));
    }
    parts.join(", ")
}
