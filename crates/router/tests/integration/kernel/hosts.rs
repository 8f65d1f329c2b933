//! Hosts, each a thread in a network namespace of its own, and a router that runs between them.

use std::net::{IpAddr, SocketAddr, UdpSocket};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use cohaptic_linkfile::router::{RouterFile, Side};
use cohaptic_realtime::{Pacing, Wishes, prepare_thread};
use cohaptic_router::{Report, Router};
use nix::sched::{CloneFlags, unshare};
use nix::unistd::gettid;

/// Bound of every wait. The waits take milliseconds; the rest is for a machine with other work.
pub(super) const PATIENCE: Duration = Duration::from_secs(60);

/// Thread in a network namespace of its own. Sockets opened by the thread belong to this namespace, even if another thread uses them.
pub(super) struct Host {
    work: Sender<Box<dyn FnOnce() + Send>>,
    /// Path of the namespace.
    pub(super) namespace: String,
}

impl Host {
    pub(super) fn new() -> Self {
        let (work, todo) = channel::<Box<dyn FnOnce() + Send>>();
        let (ready, is_ready) = channel();
        thread::spawn(move || {
            unshare(CloneFlags::CLONE_NEWNET).unwrap();
            ready.send(format!("/proc/{}/task/{}/ns/net", std::process::id(), gettid())).unwrap();
            todo.into_iter().for_each(|work| work());
        });
        Self { work, namespace: is_ready.recv_timeout(PATIENCE).unwrap() }
    }

    /// Runs `work` on this host, and returns the result.
    pub(super) fn does<T: Send + 'static>(&self, work: impl FnOnce() -> T + Send + 'static) -> T {
        let (done, is_done) = channel();
        self.work.send(Box::new(move || drop(done.send(work())))).unwrap();
        is_done.recv_timeout(PATIENCE).unwrap()
    }

    /// Waits until the host has an address. An IPv6 address appears only some time after the device is up, when the kernel has noticed.
    pub(super) fn has(&self, address: IpAddr) {
        self.does(move || {
            let begin = Instant::now();
            while UdpSocket::bind(SocketAddr::new(address, 0)).is_err() && begin.elapsed() < PATIENCE {
                thread::sleep(Duration::from_millis(1));
            }
        });
    }

    pub(super) fn udp(&self, address: IpAddr, port: u16) -> UdpSocket {
        let socket = self.does(move || UdpSocket::bind(SocketAddr::new(address, port)).unwrap());
        socket.set_read_timeout(Some(PATIENCE)).unwrap();
        socket
    }
}

/// Router that runs until it is stopped.
pub(super) struct Running {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<Report>>,
}

impl Running {
    pub(super) fn begin(text: &str) -> Self {
        Self::begin_with(text, Pacing::Sleep, &Wishes::NONE)
    }

    /// Starts a router with the given pacing, on a thread that makes the given requests to the system.
    pub(super) fn begin_with(text: &str, pacing: Pacing, wishes: &Wishes) -> Self {
        let wishes = *wishes;
        let file = RouterFile::parse(text, Path::new("router.toml"), &[]).unwrap_or_else(|error| panic!("{error}"));
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let (ready, is_ready) = channel();
        let thread = thread::spawn(move || {
            let mut router = Router::open(&file, pacing).unwrap_or_else(|error| panic!("{error}"));
            prepare_thread(&wishes).refused.iter().for_each(|refused| println!("{refused}"));
            ready.send(()).unwrap();
            router.run(&stopped, None, Duration::from_millis(100), |_| ()).unwrap();
            router.report()
        });
        is_ready.recv_timeout(PATIENCE).unwrap();
        Self { stop, thread: Some(thread) }
    }

    /// Stops the router, checks that the counters account for every packet, and returns the report.
    pub(super) fn end(mut self) -> Report {
        self.stop.store(true, Ordering::Relaxed);
        let report = self.thread.take().unwrap().join().unwrap();
        for side in Side::BOTH {
            let received = report.counters.received[side.index()];
            let lanes = report.counters.lanes.iter().filter(|lane| lane.from == side);
            let into_links: u64 = lanes.clone().map(|lane| lane.stats.offered() + lane.overload).sum();
            assert_eq!(received.all.packets, received.not_ip + received.malformed + received.passed + received.dropped + into_links);
            let delivered: u64 = lanes.map(|lane| lane.stats.delivered()).sum();
            let written = report.written[side.opposite().index()];
            assert_eq!(written.packets + written.lost(), received.not_ip + received.passed + delivered);
        }
        let written: u64 = report.written.iter().map(|written| written.packets + written.lost()).sum();
        assert_eq!(report.release.count, written);
        report
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}
