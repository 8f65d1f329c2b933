//! The peer in another program, played by a thread: it joins over loopback with the key, moves to and fro along x, leaves, and joins again from another port.

use std::error::Error;
use std::io;
use std::net::SocketAddr;
use std::os::fd::AsFd as _;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use cohaptic_live::client::{Client, ClientConfig, Heard};
use cohaptic_live::{EntropyError, MAX_DATAGRAM, Place, SessionKey, SystemEntropy};
use cohaptic_peer::State;
use cohaptic_peer::wire::{MAX_LEN, Sample};
use cohaptic_realtime::udp::{BindError, EndpointConfig, ReceiveBuffers, UdpEndpoint};
use cohaptic_realtime::{Clock as _, MonotonicClock, Pacer, Pacing, Wishes, prepare_thread};
use cohaptic_units::Instant;

/// How often it sends.
pub const UPDATE: Duration = Duration::from_millis(8);

/// The session to visit, and for how long.
#[derive(Clone, Debug)]
pub struct Invitation {
    /// Where the session listens.
    pub door: SocketAddr,
    /// Its number.
    pub session: u64,
    /// The place to take.
    pub place: u32,
    /// The key of the session.
    pub key: SessionKey,
    /// For how long to stay.
    pub stay: Duration,
    /// And for how long to be away after that.
    pub away: Duration,
}

/// What came of all visits.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Visits {
    /// How often it left and came again, the first time included.
    pub visits: u64,
    /// How many welcomes it took.
    pub joinings: u64,
    /// Datagrams that the kernel took.
    pub sent: u64,
    /// Datagrams that it did not.
    pub failures: u64,
    /// Datagrams that came, longer ones than a sealed sample among them.
    pub received: u64,
    /// What the kernel dropped because the thread did not read; `None`: not told.
    pub kernel_drops: Option<u64>,
    /// Samples of the others that were new.
    pub newest: u64,
    /// Samples that came late, or twice.
    pub late: u64,
    /// Datagrams that were nothing for it: of a joining that is over.
    pub ignored: u64,
}

/// The thread.
#[derive(Debug)]
pub struct Visitor {
    quiet: Arc<AtomicBool>,
    end: Arc<AtomicBool>,
    /// Datagrams that were sent.
    sent: Arc<AtomicU64>,
    thread: JoinHandle<Result<Visits, Failure>>,
}

/// Why there are no more visits.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// A socket.
    #[error(transparent)]
    Bind(#[from] BindError),
    /// Random bytes.
    #[error(transparent)]
    Entropy(#[from] EntropyError),
    /// The system does not let it wait or receive.
    #[error("the visitor cannot go on: {0}")]
    System(#[from] io::Error),
}

/// How far it moves, either way \[m\], and how fast.
const REACH: f64 = 0.01;
const TURNS_PER_SECOND: f64 = 0.5;

impl Visitor {
    /// Begins to visit.
    #[must_use]
    pub fn start(invitation: Invitation) -> Self {
        let [quiet, end] = [(); 2].map(|()| Arc::new(AtomicBool::new(false)));
        let sent = Arc::new(AtomicU64::new(0));
        let thread = {
            let (quiet, end, sent) = (Arc::clone(&quiet), Arc::clone(&end), Arc::clone(&sent));
            std::thread::spawn(move || Visiting::new(invitation)?.run(&quiet, &end, &sent))
        };
        Self { quiet, end, sent, thread }
    }

    /// Datagrams that it sent so far.
    #[must_use]
    pub fn sent(&self) -> u64 {
        self.sent.load(Ordering::Acquire)
    }

    /// It says nothing any more, but goes on listening.
    pub fn hush(&self) {
        self.quiet.store(true, Ordering::Release);
    }

    /// What came of it. The session should have ended before.
    ///
    /// # Errors
    ///
    /// If the thread had to give up.
    pub fn end(self) -> Result<Visits, Box<dyn Error>> {
        self.end.store(true, Ordering::Release);
        Ok(self.thread.join().map_err(|_| "the visitor panicked")??)
    }
}

/// A visitor at work.
struct Visiting {
    invitation: Invitation,
    clock: MonotonicClock,
    client: Client,
    sequence: u64,
    present: UdpEndpoint,
    /// The socket of the visit before stays open during the next one: what the session sent in the moment at which it was left is still counted.
    former: UdpEndpoint,
    buffers: ReceiveBuffers,
    /// What closed sockets did, and what was made of what came.
    visits: Visits,
}

impl Visiting {
    fn new(invitation: Invitation) -> Result<Self, Failure> {
        let clock = MonotonicClock::start();
        let client = client(&invitation, clock.now());
        let (present, former) = (socket()?, socket()?);
        let visits = Visits { visits: 1, kernel_drops: Some(0), ..Visits::default() };
        Ok(Self { invitation, clock, client, sequence: 0, present, former, buffers: ReceiveBuffers::new(), visits })
    }

    fn run(mut self, quiet: &AtomicBool, end: &AtomicBool, sent: &AtomicU64) -> Result<Visits, Failure> {
        let _ = prepare_thread(&Wishes::NONE);
        let mut pacer = Pacer::new(Pacing::Sleep);
        let (mut is_here, mut turn) = (true, self.clock.now() + self.invitation.stay);
        let mut next = self.clock.now();
        while !end.load(Ordering::Acquire) {
            let now = self.clock.now();
            if now >= turn {
                is_here = !is_here;
                turn = now + if is_here { self.invitation.stay } else { self.invitation.away };
                if is_here {
                    self.come_again()?;
                }
            }
            if now >= next {
                // What could not be sent in time is not sent.
                next = (next + UPDATE).max(now);
                if is_here && !quiet.load(Ordering::Acquire) {
                    self.speak(now)?;
                    let open = self.present.counts().sent + self.former.counts().sent;
                    sent.store(self.visits.sent + open, Ordering::Release);
                }
            }
            pacer.wait(&self.clock, Some(next), &[self.present.as_fd(), self.former.as_fd()])?;
            self.listen()?;
        }
        self.listen()?;
        self.come_again()?;
        self.come_again()?;
        Ok(Visits { visits: self.visits.visits - 2, ..self.visits })
    }

    /// Says hello, or sends a sample.
    fn speak(&mut self, now: Instant) -> Result<(), Failure> {
        if let Some(hello) = self.client.poll_hello(now, &mut SystemEntropy)? {
            self.present.queue(self.invitation.door, &hello, None);
        }
        let turn = core::f64::consts::TAU * TURNS_PER_SECOND;
        let (sine, cosine) = (turn * now.saturating_duration_since(Instant::ZERO).as_secs_f64()).sin_cos();
        let state = State { position: [REACH * sine, 0.0, 0.0], velocity: [REACH * turn * cosine, 0.0, 0.0] };
        let sample = Sample { session: self.invitation.session, sender: self.invitation.place, sequence: self.sequence, sent: now, state };
        let (mut plain, mut sealed) = ([0; MAX_LEN], [0; MAX_DATAGRAM]);
        let len = sample.encode(self.client.info().map_or(1, |info| info.axes), &mut plain);
        // Before the first welcome there is nothing to seal it with.
        if let Some(len) = self.client.seal(&plain[..len], &mut sealed) {
            self.present.queue(self.invitation.door, &sealed[..len], None);
            self.sequence += 1;
        }
        self.present.flush();
        Ok(())
    }

    fn listen(&mut self) -> Result<(), Failure> {
        let Self { clock, client, present, former, buffers, visits, .. } = self;
        for socket in [present, former] {
            while socket.receive(buffers, clock, |datagram| match client.handle_datagram(datagram.at, datagram.bytes) {
                Heard::Newest(_) => visits.newest += 1,
                Heard::Late(_) => visits.late += 1,
                Heard::Welcome => {}
                Heard::Taken | Heard::Ignored => visits.ignored += 1,
            })? > 0
            {}
        }
        Ok(())
    }

    /// As a program that is started again: another port, another nonce, numbers from 0.
    fn come_again(&mut self) -> Result<(), Failure> {
        let closed = core::mem::replace(&mut self.former, core::mem::replace(&mut self.present, socket()?));
        let (counts, drops) = (*closed.counts(), closed.kernel_drops()?);
        drop(closed);
        let visits = &mut self.visits;
        visits.visits += 1;
        visits.sent += counts.sent;
        visits.failures += counts.failures.in_all();
        visits.received += counts.received + counts.oversized;
        visits.kernel_drops = visits.kernel_drops.zip(drops).map(|(before, drops)| before + drops);
        visits.joinings += self.client.joinings();
        self.client = client(&self.invitation, self.clock.now());
        self.sequence = 0;
        Ok(())
    }
}

fn client(invitation: &Invitation, now: Instant) -> Client {
    Client::new(ClientConfig::Keyed { session: invitation.session, place: Place(invitation.place), key: invitation.key.clone() }, now)
}

fn socket() -> Result<UdpEndpoint, BindError> {
    UdpEndpoint::bind(
        SocketAddr::from(([127, 0, 0, 1], 0)),
        EndpointConfig { receive_buffer: 1 << 20, largest: MAX_DATAGRAM, ..EndpointConfig::default() },
    )
}
