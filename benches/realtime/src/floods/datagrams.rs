//! Floods of datagrams on loopback: their content, their source addresses, and their rate.

use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use cohaptic_live::client::Joining;
use cohaptic_live::handshake::HANDSHAKE_LEN;
use cohaptic_live::{Entropy as _, EntropyError, Nonce, Place, SessionKey, SystemEntropy};

/// Content and source addresses of a flood.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Flood {
    /// A recorded hello, always from the same address.
    Recorded,
    /// A recorded hello, from [`ADDRESSES`] addresses in turn.
    RecordedFromMany,
    /// Random bytes of random lengths, from one address.
    Noise,
    /// A new hello each time, made with the key of the session, from [`ADDRESSES`] addresses in turn.
    Guest,
}

/// The number of source addresses of a flood from many: 127.0.1.1 and those after it.
pub const ADDRESSES: u8 = 64;

/// The session that hellos are for.
#[derive(Clone, Debug)]
pub struct Aim {
    /// Its number.
    pub session: u64,
    /// Place of the seat that hellos ask for.
    pub place: u32,
    /// Its key.
    pub key: SessionKey,
}

impl Flood {
    /// Every kind.
    pub const ALL: [Self; 4] = [Self::Recorded, Self::RecordedFromMany, Self::Noise, Self::Guest];

    /// The name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Recorded => "one recorded hello, from one address",
            Self::RecordedFromMany => "one recorded hello, from many addresses",
            Self::Noise => "random bytes",
            Self::Guest => "new hellos with the right key, from many addresses",
        }
    }

    fn sockets(self) -> io::Result<Vec<UdpSocket>> {
        let addresses = match self {
            Self::Recorded | Self::Noise => 1,
            Self::RecordedFromMany | Self::Guest => ADDRESSES,
        };
        // Linux has the whole network 127.0.0.0/8 on loopback.
        (1..=addresses).map(|last| UdpSocket::bind(SocketAddr::from(([127, 0, 1, last], 0)))).collect()
    }
}

/// The datagrams of a flood that has ended.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Sent {
    /// Datagrams that the kernel took.
    pub datagrams: u64,
    /// For how long.
    pub elapsed: Duration,
}

impl Sent {
    /// Datagrams a second.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "a few digits are printed")]
    pub fn per_second(&self) -> f64 {
        self.datagrams as f64 / self.elapsed.as_secs_f64().max(1e-9)
    }
}

/// A flood, on a thread of its own.
#[derive(Debug)]
pub struct Flooding {
    targets: Arc<Mutex<Vec<SocketAddr>>>,
    end: Arc<AtomicBool>,
    thread: JoinHandle<Result<Sent, EntropyError>>,
}

impl Flooding {
    /// Begins to send `rate` datagrams a second to `targets` in turn.
    ///
    /// # Errors
    ///
    /// If a socket or random bytes cannot be had.
    pub fn start(flood: Flood, aim: &Aim, rate: u32, targets: Vec<SocketAddr>) -> Result<Self, Box<dyn std::error::Error>> {
        let targets = Arc::new(Mutex::new(targets));
        let end = Arc::new(AtomicBool::new(false));
        let sending = Sending { flood, sockets: flood.sockets()?, source: Source::draw(flood, aim)?, targets: Arc::clone(&targets), rate };
        let is_over = Arc::clone(&end);
        let thread = std::thread::spawn(move || sending.run(&is_over));
        Ok(Self { targets, end, thread })
    }

    /// Sends to other addresses from now on.
    pub fn aim(&self, targets: Vec<SocketAddr>) {
        *self.targets.lock().unwrap_or_else(PoisonError::into_inner) = targets;
    }

    /// Ends it, and says what it came to.
    ///
    /// # Errors
    ///
    /// If the thread had to give up.
    pub fn end(self) -> Result<Sent, Box<dyn std::error::Error>> {
        self.end.store(true, Ordering::Release);
        Ok(self.thread.join().map_err(|_| "a flood panicked")??)
    }
}

/// Material for the datagrams of a flood.
struct Source {
    aim: Aim,
    hello: [u8; HANDSHAKE_LEN],
    /// Nonces of a guest begin with this, so that no two floods send the same hello.
    nonce: Nonce,
    noise: Vec<u8>,
}

/// The longest datagram of random bytes; a session takes up to 152 bytes.
const LONGEST_NOISE: usize = 200;

impl Source {
    fn draw(flood: Flood, aim: &Aim) -> Result<Self, EntropyError> {
        let (mut nonce, mut noise) = (Nonce::default(), vec![0; if flood == Flood::Noise { 1 << 14 } else { 0 }]);
        SystemEntropy.fill(&mut nonce)?;
        SystemEntropy.fill(&mut noise)?;
        let hello = Joining::new(aim.session, Place(aim.place), &aim.key, nonce).hello();
        Ok(Self { aim: aim.clone(), hello, nonce, noise })
    }

    /// Makes the datagram of that number, and gives it to `send`.
    fn with(&mut self, flood: Flood, number: u64, send: impl FnOnce(&[u8]) -> bool) -> bool {
        match flood {
            Flood::Recorded | Flood::RecordedFromMany => send(&self.hello),
            Flood::Noise => {
                let place = usize::try_from(number).unwrap_or(0);
                // Two prime steps, so that places and lengths repeat together only after a long time.
                let start = place.wrapping_mul(61) % (self.noise.len() - LONGEST_NOISE);
                send(&self.noise[start..start + 1 + place % (LONGEST_NOISE - 1)])
            }
            Flood::Guest => {
                self.nonce[8..].copy_from_slice(&number.to_le_bytes());
                send(&Joining::new(self.aim.session, Place(self.aim.place), &self.aim.key, self.nonce).hello())
            }
        }
    }
}

struct Sending {
    flood: Flood,
    sockets: Vec<UdpSocket>,
    source: Source,
    targets: Arc<Mutex<Vec<SocketAddr>>>,
    rate: u32,
}

impl Sending {
    /// Sends the datagrams that are due each millisecond. What could not be sent in time is sent late, but not what a pause of more than 100 ms has left over.
    fn run(mut self, end: &AtomicBool) -> Result<Sent, EntropyError> {
        let (begin, mut number, mut sent) = (Instant::now(), 0_u64, 0);
        let mut skipped = Duration::ZERO;
        while !end.load(Ordering::Acquire) {
            let targets = self.targets.lock().unwrap_or_else(PoisonError::into_inner).clone();
            let due = |since: Duration| u64::try_from(since.as_micros()).unwrap_or(u64::MAX).saturating_mul(u64::from(self.rate)) / 1_000_000;
            let behind = due(begin.elapsed().saturating_sub(skipped)).saturating_sub(number);
            if behind > u64::from(self.rate) / 10 {
                skipped += Duration::from_micros(behind * 1_000_000 / u64::from(self.rate));
                continue;
            }
            for _ in 0..behind {
                let turn = |length: usize| usize::try_from(number % length.max(1) as u64).unwrap_or(0);
                let socket = &self.sockets[turn(self.sockets.len())];
                let Some(to) = targets.get(turn(targets.len())) else { break };
                sent += u64::from(self.source.with(self.flood, number, |bytes| socket.send_to(bytes, to).is_ok()));
                number += 1;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        Ok(Sent { datagrams: sent, elapsed: begin.elapsed() })
    }
}
