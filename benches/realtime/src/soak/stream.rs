//! The relay of a soak, a proxy, with a generator before it and a sink behind.

use std::error::Error;
use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::os::fd::AsFd as _;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::channel;
use std::thread::JoinHandle;
use std::time::Duration;

use cohaptic_realtime::udp::{EndpointConfig, ReceiveBuffers, UdpEndpoint};
use cohaptic_realtime::{Clock as _, LatenessSummary, MonotonicClock, Pacer, Pacing, Wishes, prepare_thread};
use cohaptic_relay::{Form, IntakeCounts, Limits, Proxy, Relay, RelayConfig, RelayError, Report, RunOptions, View};
use cohaptic_wan::LinkModel;

use super::probe::{Probe, probe};
use super::verdict::Account;

/// Packets a second.
const RATE: u64 = 1000;

/// The size of a datagram \[byte\].
const SIZE: usize = 64;

/// The most datagrams that leave the relay before it looks up.
const AT_ONCE: u64 = 1024;

/// The relay at one moment.
#[derive(Clone, Copy, Debug)]
pub(super) struct StreamLook {
    pub(super) intake: IntakeCounts,
    pub(super) release: LatenessSummary,
    /// Packets on their way.
    pub(super) held: u64,
    pub(super) delivered: u64,
    pub(super) dropped: u64,
}

/// The threads.
#[derive(Debug)]
pub(super) struct Stream {
    pub(super) probe: Probe<StreamLook>,
    generator: Worker<()>,
    sink: Worker<(u64, Option<u64>)>,
    relay: JoinHandle<Result<Report, RelayError>>,
    stop: Arc<AtomicBool>,
    sent: Arc<AtomicU64>,
    /// Of the generator: open as long as all the others, so that open files can be compared to the end.
    _source: Arc<UdpSocket>,
}

/// What came of it.
#[derive(Debug)]
pub(super) struct StreamEnd {
    pub(super) report: Report,
    sent: u64,
    received: u64,
    sink_drops: Option<u64>,
}

/// A thread that ends when it is told to.
#[derive(Debug)]
struct Worker<T> {
    end: Arc<AtomicBool>,
    thread: JoinHandle<io::Result<T>>,
}

impl<T: Send + 'static> Worker<T> {
    fn start(work: impl FnOnce(&AtomicBool) -> io::Result<T> + Send + 'static) -> Self {
        let end = Arc::new(AtomicBool::new(false));
        let told = Arc::clone(&end);
        Self { end, thread: std::thread::spawn(move || work(&told)) }
    }

    fn end(self) -> Result<T, Box<dyn Error>> {
        self.end.store(true, Ordering::Release);
        Ok(self.thread.join().map_err(|_| "a thread of the stream panicked")??)
    }
}

impl Stream {
    pub(super) fn start(link: &LinkModel, wishes: Wishes) -> Result<Self, Box<dyn Error>> {
        let any = SocketAddr::from(([127, 0, 0, 1], 0));
        let behind = UdpEndpoint::bind(any, EndpointConfig::default())?;
        let proxy = Proxy { listen: any, to: behind.local_address(), forth: link.clone(), back: link.clone(), most_clients: Proxy::MOST_CLIENTS };
        let config = RelayConfig { seed: 12, form: Form::Proxy(proxy), limits: Limits::default(), changes: Vec::new() };
        let mut relay = Relay::bind(config, EndpointConfig::default())?;
        let to = relay.ports().next().map(|(_, address)| address).ok_or("the relay has no port")?;
        let source = Arc::new(UdpSocket::bind(any)?);
        let stop = Arc::new(AtomicBool::new(false));
        let (is_over, (probe, asked)) = (Arc::clone(&stop), probe());
        let relay = std::thread::spawn(move || {
            let (_control, changes) = channel();
            let options = RunOptions { wishes, ..RunOptions::default() };
            relay.run(&options, &changes, &is_over, |view| asked.answer(|| look(view)))
        });
        let sent = Arc::new(AtomicU64::new(0));
        let count = Arc::clone(&sent);
        let sink = Worker::start(move |end| drain(behind, end));
        let socket = Arc::clone(&source);
        let generator = Worker::start(move |end| generate(&socket, to, &count, end));
        Ok(Self { probe, generator, sink, relay, stop, sent, _source: source })
    }

    /// Ends the generator.
    pub(super) fn hush(&self) {
        self.generator.end.store(true, Ordering::Release);
    }

    /// Datagrams that it has sent so far.
    pub(super) fn sent(&self) -> u64 {
        self.sent.load(Ordering::Acquire)
    }

    pub(super) fn end(self) -> Result<StreamEnd, Box<dyn Error>> {
        self.generator.end()?;
        self.stop.store(true, Ordering::Release);
        let report = self.relay.join().map_err(|_| "the relay panicked")??;
        // What the relay has sent is in the socket of the sink.
        let (received, sink_drops) = self.sink.end()?;
        Ok(StreamEnd { report, sent: self.sent.load(Ordering::Acquire), received, sink_drops })
    }
}

fn look(view: &View<'_>) -> StreamLook {
    let links = view.links();
    StreamLook {
        intake: *view.intake(),
        release: view.release().summary(),
        held: view.held().0,
        delivered: links.iter().map(|link| link.stats.delivered()).sum(),
        dropped: links.iter().map(|link| link.stats.dropped_in_all()).sum(),
    }
}

/// Sends numbered datagrams, each at its time; those that are late are sent at once.
fn generate(socket: &UdpSocket, to: SocketAddr, count: &AtomicU64, end: &AtomicBool) -> io::Result<()> {
    let _ = prepare_thread(&Wishes::NONE);
    let (clock, mut pacer) = (MonotonicClock::start(), Pacer::new(Pacing::Sleep));
    let (mut due, period, mut bytes, mut number) = (clock.now(), Duration::from_nanos(1_000_000_000 / RATE), [0; SIZE], 0_u64);
    while !end.load(Ordering::Acquire) {
        pacer.wait(&clock, Some(due), &[])?;
        due += period;
        bytes[..8].copy_from_slice(&number.to_le_bytes());
        number += 1;
        if socket.send_to(&bytes, to).is_ok() {
            count.fetch_add(1, Ordering::AcqRel);
        }
    }
    Ok(())
}

/// Receives until it is told to end, and then what has come until then; counts it and what the kernel dropped.
fn drain(mut socket: UdpEndpoint, end: &AtomicBool) -> io::Result<(u64, Option<u64>)> {
    let (clock, mut pacer, mut buffers) = (MonotonicClock::start(), Pacer::new(Pacing::Sleep), ReceiveBuffers::new());
    loop {
        let is_over = end.load(Ordering::Acquire);
        while socket.receive(&mut buffers, &clock, |_| ())? > 0 {}
        if is_over {
            return Ok((socket.counts().received + socket.counts().oversized, socket.kernel_drops()?));
        }
        pacer.wait(&clock, Some(clock.now() + Duration::from_millis(50)), &[socket.as_fd()])?;
    }
}

/// What must be equal in a relay at any moment.
pub(super) fn accounts(look: &StreamLook) -> Vec<Account> {
    let inside = look.intake.offered.saturating_sub(look.delivered + look.dropped);
    // Of more than it sends at once, some have left their link and wait for their turn. As many only gather when the machine pauses for a second.
    let open = (look.held > AT_ONCE).then_some("some wait to be sent after a pause of the machine");
    vec![Account { open, ..Account::of("packets that the relay holds, and those inside its links", look.held, inside) }]
}

/// What must be equal at the end, when nothing is on its way any more.
pub(super) fn last_accounts(end: &StreamEnd) -> Vec<Account> {
    let StreamEnd { report, sent, received, sink_drops } = end;
    let port = |name: &str| report.ports.iter().find(|port| port.name == name).map(|port| (port.counts, port.kernel_drops));
    let (listen, listen_drops) = port("listen").unwrap_or_default();
    let (clients, _) = port("clients").unwrap_or_default();
    let intake = report.intake;
    let came = listen.received + clients.received;
    let settled = intake.offered + intake.overload + intake.strangers + intake.to_itself + intake.no_room;
    let offered: u64 = report.links.iter().map(|link| link.stats.offered()).sum();
    let ended: u64 = report.links.iter().map(|link| link.stats.delivered() + link.stats.dropped_in_all()).sum();
    let delivered: u64 = report.links.iter().map(|link| link.stats.delivered()).sum();
    let undeliverable: u64 = report.links.iter().map(|link| link.counts.undeliverable).sum();
    let tried = listen.sent + listen.failures.in_all() + clients.sent + clients.failures.in_all();
    vec![
        Account::with_drops("sent to the relay, and received or dropped by the kernel", *sent, listen.received + listen.oversized, listen_drops),
        Account::of("received by the relay, and offered or refused", came, settled),
        Account::of("offered by the relay, and offered to its links", intake.offered, offered),
        Account::of("offered to the links of the relay, and delivered, dropped or held", offered, ended + report.held.0),
        Account::of("held by the relay when all is over, and nothing", report.held.0, 0),
        Account::of("delivered by the links of the relay, and sent, failed or undeliverable", delivered, tried + undeliverable),
        Account::with_drops("sent by the relay, and received by the sink or dropped by the kernel", clients.sent, *received, *sink_drops),
        Account::of("sent by the relay, and release errors recorded", tried, report.release.count()),
    ]
}
