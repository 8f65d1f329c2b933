//! The soak under floods: `cohaptic live` with two simulated Falcons and a keyed peer that comes through `cohaptic relay`, while each port of both programs is
//! flooded.
//!
//! The programs run as users start them, as processes of their own, so that the memory of each is known. What must not happen: memory or open files grow, the
//! peer is kept out, or a run is not valid.

mod connections;
mod process;
mod section;
mod verdict;

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use cohaptic_live::{SessionKey, SystemEntropy};
use cohaptic_units::print::Span;
use serde_json::Value;

pub use connections::Connected;
pub use section::{HEADING, section};
pub use verdict::{is_flat, judge};

use crate::datagrams::{Aim, Flood, Flooding, Sent};
use crate::machine;
use crate::visitor::{Invitation, Visitor, Visits};
use connections::Connections;
use process::Process;

/// The processes that are looked at, in the order of [`Row::processes`].
pub const PROCESSES: [&str; 3] = ["live", "relay", "peer and floods"];

/// Length, interval and programs of a soak under floods.
#[derive(Clone, Debug)]
pub struct FloodedPlan {
    /// For how long the session runs.
    pub duration: Duration,
    /// How often to look.
    pub every: Duration,
    /// The program `cohaptic`.
    pub program: PathBuf,
    /// Datagrams a second of the recorded hello; the other floods of datagrams have a quarter of it each.
    pub rate: u32,
    /// `true` if the programs ask for priority and locked memory, as they do unless told otherwise.
    pub priority: bool,
}

/// The scene: Falcons as people hold them, and the peer from outside, over links that it and its relay can stand.
const SCENE: &str = r#"
[scene]
title = "Two Falcons and a peer under floods"
duration = "1h"
axes = 3
seed = 17

[object]
mass = 0.45

[coordination]
strategy = "average-position"
stiffness = 30.0
damping = 2.0
update = "8ms"

[peer]
device = { mass = 0.1, damping = 5.0 }
coupling = { stiffness = 1000.0, damping = 2.0 }

[[peers]]
name = "left"
kind = "falcon"
falcon = { device = "simulated", force-limit = 4.0 }
hand = { arm = { mass = 0.3, damping = 10.0, stiffness = 100.0 }, follows = { position = [0.03, 0.0, -0.015] } }

[[peers]]
name = "right"
kind = "falcon"
falcon = { device = "simulated", force-limit = 4.0 }
hand = { arm = { mass = 0.3, damping = 10.0, stiffness = 100.0 } }

[[peers]]
name = "visitor"
kind = "udp"

[link]
delay = "24ms"
jitter = "2ms"
loss = "1%"
"#;

/// The seed of the scene.
const SESSION: u64 = 17;
/// The place of the visitor.
const VISITOR: u32 = 2;

/// A process at one moment.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Sample {
    /// Memory \[kB\].
    pub memory: u64,
    /// Open files.
    pub files: usize,
}

/// Samples of all processes at one instant.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Row {
    /// Since the floods began.
    pub at: Duration,
    /// Each process, in the order of [`PROCESSES`].
    pub processes: [Sample; PROCESSES.len()],
}

/// Outcome of a soak under floods.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Samples in the order of time.
    pub rows: Vec<Row>,
    /// The documents of `cohaptic live` and `cohaptic relay`.
    pub documents: [Value; 2],
    /// Figures of the peer from outside.
    pub visits: Visits,
    /// Each flood of datagrams, by where it went, and what it came to.
    pub floods: Vec<(String, Sent)>,
    /// The flood of connections.
    pub connections: Connected,
}

/// A folder that is gone when it is dropped.
struct Folder(PathBuf);

impl Folder {
    fn make() -> Result<Self, String> {
        let path = std::env::temp_dir().join(format!("cohaptic-soak-{}", std::process::id()));
        fs::create_dir(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        Ok(Self(path))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // Files that cannot be removed lie in a folder of temporary files.
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// The program beside this one.
///
/// # Errors
///
/// With the command that builds it, if it is not there.
pub fn program_beside_this_one() -> Result<PathBuf, String> {
    let here = std::env::current_exe().map_err(|error| format!("cannot tell where this program is: {error}"))?;
    let program = here.with_file_name("cohaptic");
    if program.exists() {
        Ok(program)
    } else {
        Err(format!("{} is missing: build it with cargo build -p cohaptic-cli and the same profile", program.display()))
    }
}

/// Runs it until the session has ended. `interrupted` gives up early; `show` is given each row when it is there.
///
/// # Errors
///
/// If a program cannot be run or does not say what it should, or if somebody gives up.
pub fn run(plan: &FloodedPlan, interrupted: &AtomicBool, mut show: impl FnMut(&Row)) -> Result<Outcome, Box<dyn Error>> {
    let folder = Folder::make()?;
    let (mut live, live_at) = start_live(plan, &folder.0)?;
    let relay = start_relay(plan, &folder.0, live_at)?;
    let relay_at = relay.address("listening on ", [' ', ' '])?;
    relay.address("live control: http://", ['/', ' '])?;
    let key = SessionKey::read_from(folder.0.join("key"))?;
    let (stay, away) = (Duration::from_secs(60).min(plan.duration / 4), Duration::from_secs(10).min(plan.duration / 10));
    let visitor = Visitor::start(Invitation { door: relay_at, session: SESSION, place: VISITOR, key: key.clone(), stay, away });
    let aim = Aim { session: SESSION, place: VISITOR, key };
    // The relay gives each address a client of its own, of which there are 256: floods from many addresses go to the session alone.
    let (rate, less) = (plan.rate, plan.rate / 4);
    let floods = [
        ("the session", Flood::Recorded, rate, vec![live_at]),
        ("the session", Flood::RecordedFromMany, less, vec![live_at]),
        ("the session", Flood::Guest, less, vec![live_at]),
        ("the relay, and through it the session", Flood::Recorded, less, vec![relay_at]),
        ("each UDP port of both", Flood::Noise, less, Vec::new()),
    ];
    let floods = floods.into_iter().map(|(to, flood, rate, targets)| Ok((to, flood, Flooding::start(flood, &aim, rate, targets)?)));
    let floods: Vec<_> = floods.collect::<Result<_, Box<dyn Error>>>()?;
    let connections = Connections::start([live.ports()?.tcp, relay.ports()?.tcp].concat(), 50);
    let (begin, mut rows) = (Instant::now(), Vec::new());
    while !live.has_ended()? {
        // Clients of the relay have ports of their own, which come and go.
        if let Some((.., noise)) = floods.last() {
            noise.aim([live.ports()?.udp, relay.ports()?.udp].concat());
        }
        std::thread::sleep(plan.every);
        let own = Sample { memory: machine::memory(), files: machine::open_files() };
        let row = Row { at: begin.elapsed(), processes: [live.sample(), relay.sample(), own] };
        // Nothing is known of a process that has ended meanwhile.
        if row.processes.iter().all(|process| process.memory > 0) {
            rows.push(row);
            show(&row);
        }
        if interrupted.load(Ordering::Relaxed) {
            return Err("somebody ended it".into());
        }
    }
    // Before the programs are waited for, so that no visit begins when the session has ended.
    let (visits, connections) = (visitor.end()?, connections.end()?);
    let floods = floods.into_iter().map(|(to, flood, flooding)| Ok((name(to, flood), flooding.end()?)));
    let floods = floods.collect::<Result<_, Box<dyn Error>>>()?;
    Ok(Outcome { rows, documents: [live.end()?, relay.end()?], visits, floods, connections })
}

/// Returns the name of a flood with its target.
fn name(to: &'static str, flood: Flood) -> String {
    format!("{}, to {to}", flood.name())
}

fn start_live(plan: &FloodedPlan, folder: &Path) -> Result<(Process, std::net::SocketAddr), Box<dyn Error>> {
    fs::write(folder.join("scene.toml"), SCENE)?;
    SessionKey::generate_to(folder.join("key"), &mut SystemEntropy)?;
    let line = format!("live scene.toml --for {} --listen 127.0.0.1:0 --key-file key --control --json{}", Span(plan.duration), unhurried(plan));
    let live = Process::start(&plan.program, folder, &line)?;
    let address = live.address("listening on ", [' ', ' '])?;
    live.address("live control: http://", ['/', ' '])?;
    Ok((live, address))
}

/// The relay ends by itself a little later than the session.
fn start_relay(plan: &FloodedPlan, folder: &Path, to: std::net::SocketAddr) -> Result<Process, String> {
    let length = Span(plan.duration + Duration::from_secs(3));
    let line = format!("relay --listen 127.0.0.1:0 --to {to} --control 127.0.0.1:0 --json --for {length}{} delay 5ms 1ms loss 1%", unhurried(plan));
    Process::start(&plan.program, folder, &line)
}

const fn unhurried(plan: &FloodedPlan) -> &'static str {
    if plan.priority { "" } else { " --no-priority" }
}
