//! The connections of the kernel, between two network namespaces with the router between them.

use std::error::Error;
use std::fs;
use std::io::{self, Read as _, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;
use std::time::{Duration, Instant};

use cohaptic_linkfile::router::RouterFile;
use cohaptic_realtime::{Pacing, Wishes, prepare_thread};
use cohaptic_router::Router;
use nix::sched::{CloneFlags, unshare};
use nix::sys::socket::setsockopt;
use nix::sys::socket::sockopt::TcpCongestion;
use nix::unistd::gettid;

use crate::{QUESTION, Times, Work};

/// Whether the kernel keeps what it learned of a host for its next connection there.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Tcp {
    Fresh,
    Kept,
}

const SERVER: ([u8; 4], u16) = ([10, 1, 0, 2], 80);

/// A connection that stands for longer has failed.
const LONGEST: Duration = Duration::from_secs(600);

/// What the router needs: the namespaces of client and server, by their places.
type Named = (usize, String);

type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;

/// Fails if there can be no namespaces.
pub(crate) fn check() -> Result<(), Box<dyn Error>> {
    match thread::spawn(|| unshare(CloneFlags::CLONE_NEWNET)).join() {
        Ok(Ok(())) => Ok(()),
        Ok(Err(error)) => Err(format!("no network namespace can be made ({error}): run it as root, or as `unshare -Urn PROGRAM`").into()),
        Err(_) => Err("a thread has panicked".into()),
    }
}

/// The times of connections between two hosts: their number, and how many stand at once. Of [`Tcp::Kept`] as many are made before, of which the kernel keeps what it learned.
pub(crate) fn times(words: &str, work: Work, connections: (u32, u32), tcp: Tcp) -> Result<Times, Box<dyn Error>> {
    let rounds = if tcp == Tcp::Kept { 2 } else { 1 };
    let stop = &AtomicBool::new(false);
    let outcome = thread::scope(|scope| -> Outcome<Times> {
        let (named, names) = channel();
        let (named_too, (client_runs, at_client)) = (named.clone(), channel());
        let ((server_runs, at_server), (listens, is_listening)) = (channel(), channel());
        let (serves, is_served) = channel();
        // If a client fails, it waits for ever: not within the scope.
        let server = move || drop(serves.send(enter(1, &named, &at_server, tcp).and_then(|()| serve(&listens, work, rounds * connections.0))));
        thread::spawn(server);
        let client = scope.spawn(move || {
            enter(0, &named_too, &at_client, tcp)?;
            is_listening.recv()?;
            for _ in 1..rounds {
                ask(work, connections)?;
            }
            ask(work, connections)
        });
        let router = scope.spawn(move || route(&names, words, stop, &[client_runs, server_runs]));
        let times = client.join().unwrap_or_else(|_| Err("the thread of the clients has panicked".into()));
        // The last acknowledgements are on their way still.
        let served = if times.is_ok() { is_served.recv_timeout(LONGEST) } else { Ok(Ok(())) };
        stop.store(true, Ordering::Relaxed);
        router.join().map_err(|_| "the thread of the router has panicked")??;
        served??;
        times
    });
    outcome.map_err(|error| format!("`{words}`: {error}").into())
}

/// The thread is in a network of its own from now on. It goes on once the router runs.
fn enter(place: usize, named: &Sender<Named>, runs: &Receiver<()>, tcp: Tcp) -> Outcome<()> {
    unshare(CloneFlags::CLONE_NEWNET)?;
    if tcp == Tcp::Fresh {
        fs::write("/proc/sys/net/ipv4/tcp_no_metrics_save", "1")?;
    }
    named.send((place, format!("/proc/{}/task/{}/ns/net", std::process::id(), gettid())))?;
    Ok(runs.recv()?)
}

/// Routes between the namespaces until it is stopped.
fn route(names: &Receiver<Named>, words: &str, stop: &AtomicBool, runs: &[Sender<()>]) -> Outcome<()> {
    let mut paths = [String::new(), String::new()];
    for _ in 0..paths.len() {
        let (place, path) = names.recv()?;
        paths[place] = path;
    }
    let [left, right] = paths;
    let text = format!(
        "left = {{ tun = \"left0\", addresses = [\"10.1.0.1/24\"], namespace = \"{left}\" }}
right = {{ tun = \"right0\", addresses = [\"10.1.0.2/24\"], namespace = \"{right}\" }}
router = {{ default = \"x\" }}
links = {{ x = {{ netem = \"{words}\" }} }}"
    );
    let file = RouterFile::parse(&text, Path::new("router.toml"), &[])?;
    let mut router = Router::open(&file, Pacing::Sleep)?;
    // Without the right to a priority the thread stays as it is.
    let _ = prepare_thread(&Wishes { lock_memory: false, ..Wishes::default() });
    for run in runs {
        run.send(())?;
    }
    Ok(router.run(stop, None, Duration::from_millis(100), |_| ())?)
}

fn serve(listens: &Sender<()>, work: Work, connections: u32) -> Outcome<()> {
    let listener = TcpListener::bind(SocketAddr::from(SERVER))?;
    // Systems differ in their default. Connections take it over from the listener.
    setsockopt(&listener, TcpCongestion, &"cubic".into())?;
    listens.send(())?;
    // Threads are in the network of the one that starts them.
    thread::scope(|scope| {
        for _ in 0..connections {
            let (stream, _) = listener.accept()?;
            scope.spawn(move || answer(stream, work));
        }
        Ok(())
    })
}

fn answer(mut stream: TcpStream, work: Work) -> io::Result<()> {
    match work {
        Work::Gives(octets) => stream.write_all(&vec![7; octets])?,
        Work::Answers(questions) => {
            for _ in 0..questions {
                stream.read_exact(&mut [0; QUESTION])?;
                stream.write_all(&[7; QUESTION])?;
            }
        }
    }
    stream.read(&mut [0]).map(drop)
}

/// `count` connections, of which `at_once` stand at a time.
fn ask(work: Work, (count, at_once): (u32, u32)) -> Outcome<Times> {
    let mut times = Times::new();
    while let left @ 1.. = count as usize - times.len() {
        let all: Outcome<Times> = thread::scope(|scope| {
            let all: Vec<_> = (0..left.min(at_once as usize)).map(|_| scope.spawn(move || one(work))).collect();
            all.into_iter().map(|one| Ok(one.join().map_err(|_| "the thread of a client has panicked")??)).collect()
        });
        times.extend(all?);
    }
    Ok(times)
}

fn one(work: Work) -> io::Result<Duration> {
    let mut begin = Instant::now();
    let mut stream = TcpStream::connect(SocketAddr::from(SERVER))?;
    stream.set_read_timeout(Some(LONGEST))?;
    setsockopt(&stream, TcpCongestion, &"cubic".into())?;
    match work {
        Work::Gives(octets) => {
            let mut chunk = vec![0; 65_536];
            let mut left = octets;
            while left > 0 {
                match stream.read(&mut chunk)? {
                    0 => return Err(io::ErrorKind::UnexpectedEof.into()),
                    count => left -= count,
                }
            }
        }
        Work::Answers(questions) => {
            begin = Instant::now();
            for _ in 0..questions {
                stream.write_all(&[7; QUESTION])?;
                stream.read_exact(&mut [0; QUESTION])?;
            }
        }
    }
    Ok(begin.elapsed())
}
