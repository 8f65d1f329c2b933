//! The subjects: the relay, a forwarder with a task a packet, and bare threads.

use std::error::Error;
use std::net::{SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::channel;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use cohaptic_realtime::udp::EndpointConfig;
use cohaptic_realtime::{Clock as _, Lateness, LatenessSummary, MonotonicClock, Pacing, Wishes, prepare_thread};
use cohaptic_relay::{Form, Limits, Mesh, Program, Relay, RelayConfig, RunOptions};
use cohaptic_scene::LinkTable;
use cohaptic_wan::{Delay, LinkConfig};

use crate::traffic::{Received, SIZE, Sent, Sink, generate, wide};
use cohaptic_benches_realtime::machine;
use cohaptic_benches_realtime::waiting::Waiting;

/// The delay of the link.
pub(crate) const DELAY: Duration = Duration::from_millis(24);

/// What came out of one run.
#[derive(Debug)]
pub(crate) struct Outcome {
    pub(crate) sent: Sent,
    pub(crate) received: Received,
    pub(crate) error: LatenessSummary,
    /// Dropped by the kernel at the forwarder's socket.
    pub(crate) at_socket: u64,
    pub(crate) overload: u64,
    /// Sent, and dropped by the kernel at the sink: no fault of the forwarder's.
    pub(crate) at_sink: u64,
    /// Offered to the link later than they came: how many, and the longest.
    pub(crate) clamped: (u64, Duration),
    /// Of all but generator and sink, a packet.
    pub(crate) processor: Duration,
    /// Before and after \[kB\].
    pub(crate) memory: (u64, u64),
    /// What the system refused the forwarder.
    pub(crate) refused: Vec<String>,
}

type Done = Result<Outcome, Box<dyn Error>>;

/// What a forwarder says of itself at its end.
#[derive(Debug, Default)]
struct Said {
    error: LatenessSummary,
    sent: u64,
    at_socket: u64,
    overload: u64,
    clamped: (u64, Duration),
    refused: Vec<String>,
}

/// Sends through something, and gathers what came of it.
fn measure(
    source: &UdpSocket,
    to: SocketAddr,
    rate: u64,
    span: Duration,
    sink: Sink,
    end: impl FnOnce(&Sent) -> Result<Said, Box<dyn Error>>,
) -> Done {
    let (memory, start) = (machine::memory(), machine::process_time());
    let sent = generate(source, to, rate, span);
    // Datagrams on their way arrive.
    std::thread::sleep(DELAY + Duration::from_millis(200));
    let after = machine::memory();
    let Said { error, sent: forwarded, at_socket, overload, clamped, refused } = end(&sent)?;
    let received = sink.end();
    let at_sink = forwarded.saturating_sub(received.count);
    let used = (machine::process_time() - start).saturating_sub(sent.processor + received.processor);
    let processor = used / u32::try_from(sent.count.max(1)).unwrap_or(u32::MAX);
    Ok(Outcome { sent, received, error, at_socket, overload, at_sink, clamped, processor, memory: (memory, after), refused })
}

pub(crate) fn relay(pacing: Pacing, rate: u64, span: Duration) -> Done {
    let (source, sink) = (wide("127.0.0.1:0")?, Sink::start()?);
    let free = "127.0.0.1:0".parse()?;
    let program = |name: &str, address| Program { name: name.to_owned(), port: free, address: Some(address) };
    let programs = vec![program("source", source.local_addr()?), program("sink", sink.address)];
    let link = LinkConfig { delay: Delay::constant(DELAY), ..LinkConfig::default() };
    let form = Form::Mesh(Mesh { programs, links: LinkTable::uniform(2, link) });
    let config = RelayConfig { seed: 1, form, limits: Limits::default(), changes: Vec::new() };
    let mut relay = Relay::bind(config, EndpointConfig::default())?;
    let to = relay.ports().nth(1).map(|(_, address)| address).ok_or("no port")?;
    let stop = Arc::new(AtomicBool::new(false));
    let is_over = Arc::clone(&stop);
    let thread = std::thread::spawn(move || {
        let (_control, changes) = channel();
        // Locked memory would stay with the process and count as memory of the others.
        let options = RunOptions { pacing, wishes: Wishes { lock_memory: false, ..Wishes::default() }, ..RunOptions::default() };
        relay.run(&options, &changes, &is_over, |_| ())
    });
    measure(&source, to, rate, span, sink, |_| {
        stop.store(true, Ordering::Relaxed);
        let report = thread.join().map_err(|_| "the relay panicked")??;
        let refused = report.prepared.refused.iter().map(ToString::to_string).collect();
        Ok(Said {
            error: report.release.summary(),
            sent: report.ports.iter().map(|port| port.counts.sent).sum(),
            at_socket: report.ports.iter().filter_map(|port| port.kernel_drops).sum(),
            overload: report.intake.overload,
            clamped: (report.intake.clamped, report.clamped.summary().max),
            refused,
        })
    })
}

/// What one writes in a quarter of an hour: a task for each packet, which sleeps until it is due.
pub(crate) fn tokio_forwarder(rate: u64, span: Duration) -> Done {
    let (source, sink) = (wide("127.0.0.1:0")?, Sink::start()?);
    let inside = wide("127.0.0.1:0")?;
    inside.set_nonblocking(true)?;
    let (to, target) = (inside.local_addr()?, sink.address);
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build()?;
    let (errors, taken, forwarded) = (Arc::new(Mutex::new(Lateness::new())), Arc::new(AtomicU64::new(0)), Arc::new(AtomicU64::new(0)));
    let (recorded, counted, passed) = (Arc::clone(&errors), Arc::clone(&taken), Arc::clone(&forwarded));
    runtime.spawn(async move {
        let Ok(socket) = tokio::net::UdpSocket::from_std(inside) else { return };
        let socket = Arc::new(socket);
        let mut bytes = [0; 2048];
        while let Ok((length, _)) = socket.recv_from(&mut bytes).await {
            let due = tokio::time::Instant::now() + DELAY;
            counted.fetch_add(1, Ordering::Relaxed);
            let (socket, packet) = (Arc::clone(&socket), bytes[..length].to_vec());
            let (recorded, passed) = (Arc::clone(&recorded), Arc::clone(&passed));
            tokio::spawn(async move {
                tokio::time::sleep_until(due).await;
                let late = due.elapsed();
                if socket.send_to(&packet, target).await.is_ok() {
                    passed.fetch_add(1, Ordering::Relaxed);
                }
                if let Ok(mut recorded) = recorded.lock() {
                    recorded.record(late);
                }
            });
        }
    });
    measure(&source, to, rate, span, sink, |sent| {
        runtime.shutdown_timeout(Duration::from_secs(1));
        let error = errors.lock().map_err(|_| "a task panicked")?.summary();
        // What the generator sent and no task ever saw.
        let at_socket = sent.count.saturating_sub(taken.load(Ordering::Relaxed));
        Ok(Said { error, sent: forwarded.load(Ordering::Relaxed), at_socket, ..Said::default() })
    })
}

/// A thread that does nothing but wait for each packet's time and send it: what the system gives at best. With it the processor time of a packet.
pub(crate) fn bare_thread(mut waiting: Waiting, rate: u64, span: Duration) -> Result<(LatenessSummary, Duration), Box<dyn Error>> {
    let (socket, sink) = (UdpSocket::bind("127.0.0.1:0")?, Sink::start()?);
    let target = sink.address;
    let thread = std::thread::spawn(move || -> std::io::Result<(LatenessSummary, Duration)> {
        let _ = prepare_thread(&Wishes { lock_memory: false, ..Wishes::default() });
        let clock = MonotonicClock::start();
        let mut errors = Lateness::new();
        let period = Duration::from_nanos(1_000_000_000 / rate);
        let (mut due, before) = (clock.now(), machine::thread_time());
        let end = due + span;
        while due < end {
            due += period;
            waiting.wait(&clock, due)?;
            errors.record(clock.now().saturating_duration_since(due));
            socket.send_to(&[0; SIZE], target)?;
        }
        let count = u32::try_from(errors.count().max(1)).unwrap_or(u32::MAX);
        Ok((errors.summary(), (machine::thread_time() - before) / count))
    });
    let done = thread.join().map_err(|_| "the thread panicked")??;
    sink.end();
    Ok(done)
}
