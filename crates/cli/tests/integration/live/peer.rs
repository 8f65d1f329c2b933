//! A program that takes part: the Rust client of the protocol, over a socket and a thread of its own.

use std::net::{SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant as Wall};

use cohaptic_live::client::{Client, ClientConfig, Heard};
use cohaptic_live::{MAX_DATAGRAM, SystemEntropy};
use cohaptic_peer::State;
use cohaptic_peer::wire::{MAX_LEN, Sample};
use cohaptic_units::Instant;

/// A sample that was sent: when, and the bytes of the sample within the datagram.
#[derive(Clone, Debug)]
pub(super) struct Sent {
    pub(super) at: Wall,
    pub(super) sample: Vec<u8>,
}

/// Received sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Received {
    pub(super) at: Wall,
    pub(super) sender: u32,
    pub(super) sequence: u64,
}

/// Samples that a peer has sent and received.
#[derive(Clone, Debug, Default)]
pub(super) struct Account {
    pub(super) sent: Vec<Sent>,
    pub(super) received: Vec<Received>,
    /// Every datagram that the peer has sent, hellos included, as bytes.
    pub(super) wire: Vec<Vec<u8>>,
}

/// Peer at place 1 with a copy at rest. Sends every 8 ms, and receives even while it is silent.
pub(super) struct Peer {
    speaks: Arc<AtomicBool>,
    ends: Arc<AtomicBool>,
    account: Arc<Mutex<Account>>,
    position: Arc<AtomicU64>,
    thread: Option<JoinHandle<()>>,
}

/// Number of the session, which is the seed of the scenes of these tests.
pub(super) const SESSION: u64 = 7;

impl Peer {
    /// Starts a peer that sends from a port of its own.
    pub(super) fn begin(config: ClientConfig, door: SocketAddr, position: f64) -> Self {
        let (speaks, ends) = (Arc::new(AtomicBool::new(true)), Arc::new(AtomicBool::new(false)));
        let (account, position) = (Arc::new(Mutex::new(Account::default())), Arc::new(AtomicU64::new(position.to_bits())));
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        socket.connect(door).unwrap();
        socket.set_read_timeout(Some(Duration::from_millis(1))).unwrap();
        let shared = (Arc::clone(&speaks), Arc::clone(&ends), Arc::clone(&account), Arc::clone(&position));
        let thread = std::thread::spawn(move || talk(&socket, Client::new(config, Instant::ZERO), &shared));
        Self { speaks, ends, account, position, thread: Some(thread) }
    }

    /// Moves the copy to a position \[m\] at once.
    pub(super) fn move_to(&self, position: f64) {
        self.position.store(position.to_bits(), Ordering::Relaxed);
    }

    /// Sends nothing from now on.
    pub(super) fn fall_silent(&self) {
        self.speaks.store(false, Ordering::Relaxed);
    }

    pub(super) fn so_far(&self) -> Account {
        self.account.lock().unwrap().clone()
    }

    /// Ends the peer, and returns what it has sent and received.
    pub(super) fn end(mut self) -> Account {
        self.ends.store(true, Ordering::Relaxed);
        self.thread.take().unwrap().join().unwrap();
        self.so_far()
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
    }
}

type Shared = (Arc<AtomicBool>, Arc<AtomicBool>, Arc<Mutex<Account>>, Arc<AtomicU64>);

fn talk(socket: &UdpSocket, mut client: Client, (speaks, ends, account, position): &Shared) {
    let begin = Wall::now();
    let (mut number, mut next) = (0, begin);
    while !ends.load(Ordering::Relaxed) {
        let now = Instant::ZERO.saturating_add(begin.elapsed());
        if speaks.load(Ordering::Relaxed) {
            if let Some(hello) = client.poll_hello(now, &mut SystemEntropy).unwrap() {
                say(socket, account, &hello);
            }
            if Wall::now() >= next {
                // A thread that was held up does not make up for it: whoever listens would hear a burst.
                next = Wall::now() + Duration::from_millis(8);
                let here = f64::from_bits(position.load(Ordering::Relaxed));
                let mut plain = [0; MAX_LEN];
                let state = State { position: [here], velocity: [0.0] };
                let len = Sample { session: SESSION, sender: 1, sequence: number, sent: now, state }.encode(1, &mut plain);
                let mut sealed = [0; MAX_DATAGRAM];
                if let Some(sealed_len) = client.seal(&plain[..len], &mut sealed) {
                    account.lock().unwrap().sent.push(Sent { at: Wall::now(), sample: plain[..len].to_vec() });
                    say(socket, account, &sealed[..sealed_len]);
                    number += 1;
                }
            }
        }
        let mut buffer = [0; 2048];
        // An error is a timeout, or says that the session has ended.
        if let Ok(len) = socket.recv(&mut buffer) {
            match client.handle_datagram(now, &buffer[..len]) {
                Heard::Newest(sample) | Heard::Late(sample) => {
                    let received = Received { at: Wall::now(), sender: sample.sender, sequence: sample.sequence };
                    account.lock().unwrap().received.push(received);
                }
                Heard::Welcome | Heard::Taken | Heard::Ignored => {}
            }
        }
    }
}

fn say(socket: &UdpSocket, account: &Mutex<Account>, datagram: &[u8]) {
    account.lock().unwrap().wire.push(datagram.to_vec());
    let _sent = socket.send(datagram);
}

/// Returns the bytes of a sample as [`Peer`] sends it.
pub(super) fn sample(session: u64, sender: u32, sequence: u64, position: f64) -> Vec<u8> {
    let mut bytes = [0; MAX_LEN];
    let state = State { position: [position], velocity: [0.0] };
    let len = Sample { session, sender, sequence, sent: Instant::ZERO, state }.encode(1, &mut bytes);
    bytes[..len].to_vec()
}
