//! A stand-in for a run: publishes numbers that follow formulas, and records changes.

use core::time::Duration;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Instant;

use cohaptic_control::{
    Board, Body, Description, Kind, LinkCounters, LinkEditor, LinkName, MeasureLabel, PeerName, PeerView, Presence, Quantiles, Server, ServerConfig,
    Snapshot, TurnView, serve,
};

pub(crate) const TOKEN: &str = "a-token-of-more-than-22-characters";

/// Keys with values, indexed by link.
type Keys = Vec<Vec<(String, String)>>;

/// Changes in order: links and keys.
pub(crate) type Told = Arc<Mutex<Vec<(Vec<usize>, Vec<(String, String)>)>>>;

struct Editor {
    keys: Keys,
    told: Told,
}

impl LinkEditor for Editor {
    fn keys(&self, link: usize) -> Vec<(String, String)> {
        self.keys[link].clone()
    }

    fn change(&mut self, links: &[usize], keys: &[(String, String)]) -> Result<(), String> {
        if let Some((key, _)) = keys.iter().find(|(key, _)| key == "dlay") {
            return Err(format!("link.{key}: unknown key; did you mean \"delay\"?"));
        }
        for link in links {
            let now = &mut self.keys[*link];
            for (key, value) in keys {
                now.retain(|(name, _)| name != key);
                now.push((key.clone(), value.clone()));
            }
        }
        self.told.lock().unwrap().push((links.to_vec(), keys.to_vec()));
        Ok(())
    }
}

/// A server and its run with given numbers of links and peers.
pub(crate) struct Run {
    pub(crate) server: Option<Server>,
    pub(crate) board: Arc<Board>,
    pub(crate) told: Told,
    ended: Arc<AtomicBool>,
    publisher: Option<JoinHandle<()>>,
}

impl Run {
    /// Starts a run that publishes nothing by itself.
    pub(crate) fn still(links: usize, peers: usize) -> Self {
        Self::of(description(links, peers), 0)
    }

    /// Starts a run with a single peer, whose plate of 0.4 m × 0.3 m at the origin keeps the given orientation.
    pub(crate) fn turned(orientation: [f64; 4]) -> Self {
        let body = Some(Body { edges: [0.4, 0.3, 0.0], grasps: vec![[0.2, 0.15, 0.0]] });
        let run = Self::of(Description { body, ..description(1, 1) }, 0);
        let turn = Some(TurnView { orientation, device: None, device_orientation: None });
        let mut snapshot = snapshot(Duration::from_secs(3), 1, 1, 3);
        snapshot.peers[0] = PeerView { position: vec![0.0; 3], turn, ..snapshot.peers[0].clone() };
        run.board.publish(Arc::new(snapshot)).unwrap();
        run
    }

    fn of(description: Description, port: u16) -> Self {
        let links = description.links.len();
        let board = Arc::new(Board::new(description));
        let told = Told::default();
        let keys =
            (0..links).map(|link| vec![("delay".to_owned(), format!("\"{}ms\"", 24 + link)), ("loss".to_owned(), "\"1%\"".to_owned())]).collect();
        let editor = Editor { keys, told: Arc::clone(&told) };
        let config = ServerConfig { token: Some(TOKEN.parse().unwrap()), ..ServerConfig::new(([127, 0, 0, 1], port).into()) };
        let server = serve(config, Arc::clone(&board), Box::new(editor)).unwrap();
        Self { server: Some(server), board, told, ended: Arc::default(), publisher: None }
    }

    /// Starts a run that publishes 20 times per second. Port 0 takes any free port.
    pub(crate) fn moving(links: usize, peers: usize, axes: usize, port: u16) -> Self {
        let mut run = Self::of(description(links, peers), port);
        let (board, ended) = (Arc::clone(&run.board), Arc::clone(&run.ended));
        run.publisher = Some(std::thread::spawn(move || {
            let begin = Instant::now();
            while !ended.load(Ordering::Relaxed) {
                // A snapshot refused by the board is followed by the next.
                let _taken = board.publish(Arc::new(snapshot(begin.elapsed(), links, peers, axes)));
                std::thread::sleep(Duration::from_millis(50));
            }
        }));
        run
    }

    pub(crate) fn server(&self) -> &Server {
        self.server.as_ref().unwrap()
    }

    /// Stops the server and returns its port, which is free again.
    pub(crate) fn stop(mut self) -> u16 {
        let port = self.server().address().port();
        self.server.take().unwrap().stop();
        port
    }
}

impl Drop for Run {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Relaxed);
        if let Some(publisher) = self.publisher.take() {
            // A panic of the publisher is not repeated, because the test would abort without its message. The test fails anyway without the numbers.
            let _ended = publisher.join();
        }
    }
}

/// An editor for a run without links.
pub(crate) struct NoLinks;

impl LinkEditor for NoLinks {
    fn keys(&self, _link: usize) -> Vec<(String, String)> {
        Vec::new()
    }

    fn change(&mut self, _links: &[usize], _keys: &[(String, String)]) -> Result<(), String> {
        Err("there is nothing to change".to_owned())
    }
}

/// Returns the board of a run without links, peers, clocks and measures.
pub(crate) fn empty_board() -> Arc<Board> {
    let description = Description {
        kind: Kind::Router,
        title: String::new(),
        links: Vec::new(),
        peers: Vec::new(),
        clocks: Vec::new(),
        measures: Vec::new(),
        body: None,
    };
    Arc::new(Board::new(description))
}

fn measure(name: &str) -> MeasureLabel {
    let unit = if name.ends_with("_j") { "J" } else { "s" };
    MeasureLabel { name: name.to_owned(), unit, about: "A <measure>" }
}

fn description(links: usize, peers: usize) -> Description {
    const NAMES: [&str; 4] = ["left", "right", "far", "robot"];
    let name = |number: usize| NAMES.get(number).map_or_else(|| format!("peer {number}"), |name| (*name).to_owned());
    let nodes = (2..).find(|nodes| nodes * (nodes - 1) >= links).unwrap();
    let pairs = (0..nodes).flat_map(|from| (0..nodes).filter(move |to| *to != from).map(move |to| (from, to))).take(links);
    Description {
        kind: Kind::Live,
        title: "three people lift a <b>cube</b>".to_owned(),
        links: pairs.map(|(from, to)| LinkName { name: format!("{}->{}", name(from), name(to)), from: name(from), to: name(to) }).collect(),
        peers: (0..peers).map(|number| PeerName { name: name(number), kind: "simulated Falcon".to_owned() }).collect(),
        clocks: vec!["tick".to_owned(), "release".to_owned()],
        measures: ["energy_j", "travel_s"].map(measure).to_vec(),
        body: None,
    }
}

/// Returns the whole part of a count.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "counts of a made-up run, far below 2^53")]
fn whole(number: f64) -> u64 {
    number as u64
}

#[expect(clippy::cast_precision_loss, reason = "small numbers of links and peers")]
fn snapshot(elapsed: Duration, links: usize, peers: usize, axes: usize) -> Snapshot {
    let t = elapsed.as_secs_f64();
    let link = |number: usize| {
        let phase = number as f64;
        let offered = whole(1000.0 * t);
        let lost = whole(10.0 * t + 8.0 * (1.0 - (t * 0.7 + phase).cos()));
        let waited = whole(3.0 * t);
        let delay = 0.024 + 0.001 * phase + 0.004 * (0.9 * t + phase).sin();
        let out = offered.saturating_sub(lost + waited);
        let in_flight = out.min(24);
        LinkCounters {
            offered,
            delivered: out - in_flight,
            delivered_bytes: whole(64_000.0 * t + 3000.0 * (t + phase).sin() + 3000.0),
            dropped: vec![("loss", lost), ("queue-full", waited)],
            in_flight,
            mean_delay: Some(Duration::from_secs_f64(0.024)),
            recent_delay: spans(delay, 1.3),
            ..LinkCounters::default()
        }
    };
    let peer = |number: usize| {
        let phase = 0.15 * number as f64;
        let place = |axis: usize| 0.04 * ((1.1 + 0.6 * axis as f64) * (t - phase)).sin() + 0.02 * axis as f64;
        let stale = number == 2;
        PeerView {
            status: match number {
                0 => Presence::Here,
                2 => Presence::Stale,
                _ => Presence::Present,
            },
            age: (number > 0).then(|| Duration::from_secs_f64(if stale { 2.3 } else { 0.012 })),
            position: (0..axes).map(place).collect(),
            turn: None,
            joined: None,
            force: (0..axes).map(|axis| 2.0 * (t + axis as f64).cos()).collect(),
        }
    };
    Snapshot {
        elapsed,
        invalid: None,
        lateness: vec![spans(9e-6, 4.0), spans(22e-6, 3.0)],
        links: (0..links).map(link).collect(),
        peers: (0..peers).map(peer).collect(),
        refused: vec![("wrong-magic", whole(t)), ("too-short", whole(t / 3.0))],
        measures: vec![Some(0.25), None],
    }
}

fn spans(middle: f64, spread: f64) -> Quantiles {
    let at = |power: i32| Duration::from_secs_f64(middle * spread.powi(power));
    Quantiles { count: 1000, sum: at(0) * 1000, p50: at(0), p99: at(1), p999: at(2), max: at(3) }
}
