//! Release error of the router, for `docs/measured-router.md`: `cargo test --release -p cohaptic-router -- --ignored --nocapture --test-threads=1 measure`. The
//! figures depend on the machine, so nothing is asserted about them.

use std::net::SocketAddr;
use std::thread;
use std::time::{Duration, Instant};

use cohaptic_realtime::{Pacing, Wishes};
use cohaptic_router::Report;

use super::hosts::{Host, PATIENCE, Running};
use super::sandbox::inside_as_root;
use super::tun::sides;

/// Sends a packet with `data` bytes of data from left to right `every` so often for some seconds. Returns the report, the number of packets sent, and the
/// number of packets that arrived.
fn measure(text: &str, pacing: Pacing, data: usize, every: Duration, seconds: u64) -> (Report, u64, u64) {
    let (left, right) = (Host::new(), Host::new());
    let running = Running::begin_with(&format!("{}{text}", sides(&left, &right)), pacing, &Wishes { lock_memory: false, ..Wishes::default() });
    let (from, to) = (left.udp([10, 1, 0, 1].into(), 0), right.udp([10, 1, 0, 2].into(), 7));
    from.connect(SocketAddr::from(([10, 1, 0, 2], 7))).unwrap();
    to.set_read_timeout(Some(Duration::from_millis(500))).unwrap();
    let sink = thread::spawn(move || {
        let mut buffer = [0; 2000];
        let mut count = 0_u64;
        let begin = Instant::now();
        while begin.elapsed() < PATIENCE && (to.recv(&mut buffer).is_ok() || count == 0) {
            count += 1;
        }
        count
    });
    let (begin, payload) = (Instant::now(), vec![7; data]);
    let mut sent = 0_u32;
    while begin.elapsed() < Duration::from_secs(seconds) {
        sent += u32::from(from.send(&payload).is_ok());
        thread::sleep((every * sent).saturating_sub(begin.elapsed()));
    }
    let arrived = sink.join().unwrap();
    (running.end(), sent.into(), arrived)
}

const WAN: &str = "router = { default = \"x\" }\nlinks = { x = { delay = \"24ms\" } }";

#[test]
#[ignore = "measures: see the head of the file"]
fn measure_the_release_error() {
    inside_as_root("kernel::measure::measure_the_release_error", || {
        for (name, pacing) in [("sleep", Pacing::Sleep), ("spin", Pacing::SPIN)] {
            let (report, sent, arrived) = measure(WAN, pacing, 36, Duration::from_micros(200), 5);
            println!("{name}: {sent} sent, {arrived} arrived, release error {:?}", report.release);
        }
    });
}
