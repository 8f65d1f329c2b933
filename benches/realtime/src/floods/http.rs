//! Live control and the page of `cohaptic play`: how long the host waits for its page while others flood the server.

use std::error::Error;
use std::fs;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use cohaptic_control::{
    Board, Description, Hands, Kind, LinkCounters, LinkEditor, LinkName, PeerName, PeerView, Role, ServerConfig, Snapshot, Stage, StageFile,
    serve_stage,
};
use serde_json::{Value, json};

use crate::visits::{Answers, Flood, Offered, Then, ask};

/// As `cohaptic play` begins: each of them has a link to each other one.
const PEERS: usize = 3;
const LINKS: usize = PEERS * (PEERS - 1);

/// The name of the thread that answers, as the system knows it.
const THREAD: &str = "live-control";

/// Prints the section.
pub(crate) fn section(span: Duration) -> Result<(), Box<dyn Error>> {
    let board = Arc::new(Board::new(description()));
    let server = serve_stage(ServerConfig::new(([127, 0, 0, 1], 0).into()), Arc::clone(&board), Box::new(NoKeys), Arc::new(Onlookers))?;
    let join = server.join_url().ok_or("a stage has a link for guests")?;
    let guest = join.split_once('?').ok_or("a link shows a token")?.1.to_owned();
    let host = format!("GET /?token={} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n", server.token().secret());
    println!("## The page of the host\n");
    println!(
        "The server of [live control](live-control.md) and of [`cohaptic play`](play.md), with {PEERS} peers and a snapshot every 50 ms. The host asks for its page 50 times a second, each"
    );
    println!(
        "time over a new connection, from the first byte that it sends to the last one of the answer. *Again*: connections of the host that were ended before, to make room for newer ones, so that it asked"
    );
    println!(
        "again, which counts as waiting. *Core*: the processor time of the server's thread, as a share of one core. A connection that the server ends is opened again at once. Asked for: the page within 1 s.\n"
    );
    println!("| flood | connections at once | connections/s | kB/s | pages | p50 \\[ms\\] | p99 \\[ms\\] | worst \\[ms\\] | again | core |");
    println!("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |");
    let mut elapsed = Duration::ZERO;
    for flood in floods(&guest) {
        let run = run(&flood, server.address(), &host, span, || {
            elapsed += Duration::from_millis(50);
            // A snapshot that somebody just reads is followed by another one.
            let _ = board.publish(Arc::new(snapshot(elapsed)));
        });
        row(&flood, run, span);
    }
    println!();
    server.stop();
    Ok(())
}

/// Every flood; `guest` is the query that shows the token of guests.
fn floods(guest: &str) -> Vec<Flood> {
    let get = |path: &str, more: &str| format!("GET {path}?{guest} HTTP/1.1\r\nHost: localhost\r\n{more}\r\n");
    let upgrade = "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    let looks_on = get("/api/hand", upgrade).replace("/api/hand?", "/api/hand?hand=none&");
    let flood = |name, connections, opening: String, then| Flood { name, connections, opening: opening.into_bytes(), then };
    // Parts of a message of a WebSocket that goes on, with a mask of zeros.
    let empty_parts = [0x00, 0x80, 0, 0, 0, 0].repeat(4096);
    vec![
        flood("none", 0, String::new(), Then::Listen),
        flood("strangers: silence", 300, String::new(), Then::Listen),
        flood("strangers: half a request", 300, "GET / HTTP/1.1\r\nHost: local".to_owned(), Then::Listen),
        flood("strangers: half a body", 300, "POST /api/play HTTP/1.1\r\nHost: localhost\r\nContent-Length: 4000\r\n\r\n{".to_owned(), Then::Listen),
        flood("strangers: requests without a token", 64, "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n".to_owned(), Then::Listen),
        flood("guests: events", 64, get("/api/events", ""), Then::Listen),
        flood("guests: requests as fast as they are taken", 16, get("/api/state", ""), Then::Repeat(get("/api/state", "").into_bytes())),
        flood("guests: answers that nobody reads", 64, get("/", "").repeat(200), Then::Ignore),
        flood("guests: hands that look on", 64, looks_on.clone(), Then::Listen),
        flood("guests: a message in empty parts without end", 4, looks_on, Then::Repeat(empty_parts)),
    ]
}

struct Run {
    offered: Offered,
    answers: Answers,
    processor: Duration,
}

fn run(flood: &Flood, address: SocketAddr, host: &str, span: Duration, mut publish: impl FnMut()) -> Run {
    let stop = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let flooding = scope.spawn(|| flood.run(address, &stop));
        let before = server_time();
        let asking = scope.spawn(|| ask(address, host, span));
        let begun = Instant::now();
        while begun.elapsed() < span {
            publish();
            std::thread::sleep(Duration::from_millis(50));
        }
        let answers = asking.join().unwrap_or_default();
        let processor = server_time().saturating_sub(before);
        stop.store(true, Ordering::Relaxed);
        Run { offered: flooding.join().unwrap_or_default(), answers, processor }
    })
}

#[allow(clippy::cast_precision_loss, reason = "counts of connections and of bytes")]
fn row(flood: &Flood, run: Run, span: Duration) {
    let Run { offered, answers: Answers { mut waited, again }, processor } = run;
    waited.sort_unstable();
    let at = |share: usize| waited.get((waited.len() * share).div_ceil(100).saturating_sub(1)).copied().unwrap_or_default().as_secs_f64() * 1e3;
    let seconds = span.as_secs_f64();
    println!(
        "| {} | {} | {:.0} | {:.0} | {} | {:.2} | {:.2} | {:.2} | {again} | {:.0} % |",
        flood.name,
        flood.connections,
        offered.connections as f64 / seconds,
        offered.bytes as f64 / seconds / 1e3,
        waited.len(),
        at(50),
        at(99),
        at(100),
        processor.as_secs_f64() / seconds * 100.0
    );
}

/// The processor time of the thread that answers, so far.
fn server_time() -> Duration {
    let tasks = fs::read_dir("/proc/self/task").into_iter().flatten().filter_map(Result::ok).map(|task| task.path());
    let read = |task: &std::path::Path, file: &str| fs::read_to_string(task.join(file)).unwrap_or_default();
    let ours = tasks.filter(|task| read(task, "comm").trim() == THREAD);
    // The first number is the time on a processor \[ns\].
    ours.filter_map(|task| read(&task, "schedstat").split(' ').next()?.parse().ok().map(Duration::from_nanos)).sum()
}

fn description() -> Description {
    let name = |peer: usize| format!("peer {peer}");
    let pairs = (0..PEERS).flat_map(|from| (0..PEERS).filter(move |to| *to != from).map(move |to| (from, to)));
    Description {
        kind: Kind::Live,
        title: "a flood".to_owned(),
        links: pairs.map(|(from, to)| LinkName { name: format!("{from}->{to}"), from: name(from), to: name(to) }).collect(),
        peers: (0..PEERS).map(|peer| PeerName { name: name(peer), kind: "simulated".to_owned() }).collect(),
        clocks: vec!["tick".to_owned(), "release".to_owned()],
        measures: Vec::new(),
        body: None,
    }
}

fn snapshot(elapsed: Duration) -> Snapshot {
    let link = LinkCounters { dropped: vec![("loss", 1), ("queue-full", 0)], ..LinkCounters::default() };
    Snapshot { elapsed, links: vec![link; LINKS], peers: vec![PeerView::default(); PEERS], ..Snapshot::default() }
}

struct NoKeys;

impl LinkEditor for NoKeys {
    fn keys(&self, _: usize) -> Vec<(String, String)> {
        Vec::new()
    }

    fn change(&mut self, _: &[usize], _: &[(String, String)]) -> Result<(), String> {
        Err("nothing is changed in a flood".to_owned())
    }
}

/// A run on whose page everybody looks on.
struct Onlookers;

impl Hands for Onlookers {
    fn frame(&self, _: Option<usize>) -> (u64, Arc<str>) {
        (0, Arc::from("{}"))
    }

    fn take_hand(&self, _: Option<usize>) -> Result<usize, String> {
        Err("every hand is taken".to_owned())
    }

    fn move_hand(&self, _: usize, _: Option<[f64; 3]>) -> Result<(), String> {
        Ok(())
    }

    fn leave_hand(&self, _: usize) {}
}

impl Stage for Onlookers {
    fn facts(&self, _: Role) -> Value {
        json!({ "part": 1 })
    }

    fn begin_anew(&self, _: &Value) -> Result<(), String> {
        Err("a flood is one part".to_owned())
    }

    fn compare(&self) -> Result<Value, String> {
        Err("a flood has no other ways".to_owned())
    }

    fn file(&self, _: &str) -> Option<StageFile> {
        None
    }
}
