//! The sender before the measured program, and the receiver behind it: both in this process, as the forwarder is.

use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use cohaptic_realtime::{Clock as _, MonotonicClock, Pacer, Pacing, Wishes, prepare_thread};
use cohaptic_units::Instant;
use rustix::net::sockopt;

use cohaptic_benches_realtime::machine;

/// The size of a datagram.
pub(crate) const SIZE: usize = 64;

#[derive(Clone, Copy, Debug)]
pub(crate) struct Sent {
    pub(crate) count: u64,
    pub(crate) elapsed: Duration,
    pub(crate) processor: Duration,
}

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Received {
    pub(crate) count: u64,
    /// After one that was sent later.
    pub(crate) reordered: u64,
    pub(crate) processor: Duration,
}

/// Sends numbered datagrams at a rate, one call of the kernel each, whatever is due every 100 µs (at rates below 10,000 a second, each at its time).
pub(crate) fn generate(socket: &UdpSocket, to: SocketAddr, rate: u64, span: Duration) -> Sent {
    let _ = prepare_thread(&Wishes::NONE);
    let start = machine::thread_time();
    let clock = MonotonicClock::start();
    let (mut pacer, end) = (Pacer::new(Pacing::Sleep), Instant::ZERO + span);
    let due = |number: u64| Instant::from_nanos(number * 1_000_000_000 / rate);
    let mut bytes = [0; SIZE];
    let (mut number, mut sent) = (0_u64, 0);
    loop {
        let now = clock.now();
        if now >= end {
            break;
        }
        while due(number) <= now {
            bytes[..8].copy_from_slice(&number.to_le_bytes());
            sent += u64::from(socket.send_to(&bytes, to).is_ok());
            number += 1;
        }
        let next = due(number).max(now + Duration::from_micros(100));
        // A wait that the system refuses shows as a rate that was not reached.
        let _ = pacer.wait(&clock, Some(if rate < 10_000 { due(number) } else { next }), &[]);
    }
    Sent { count: sent, elapsed: clock.now() - Instant::ZERO, processor: machine::thread_time() - start }
}

/// A thread that receives until it is stopped, without segmentation offload, so that the kernel cuts what was sent together.
pub(crate) struct Sink {
    pub(crate) address: SocketAddr,
    stop: Arc<AtomicBool>,
    thread: JoinHandle<Received>,
}

impl Sink {
    pub(crate) fn start() -> std::io::Result<Self> {
        let socket = wide("127.0.0.1:0")?;
        socket.set_nonblocking(true)?;
        let (address, stop) = (socket.local_addr()?, Arc::new(AtomicBool::new(false)));
        let is_over = Arc::clone(&stop);
        let thread = std::thread::spawn(move || {
            let start = machine::thread_time();
            let mut received = Received::default();
            let (mut bytes, mut next) = ([0; 2048], 0);
            while !is_over.load(Ordering::Relaxed) {
                while let Ok(length) = socket.recv(&mut bytes) {
                    received.count += 1;
                    let number = bytes[..length].first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes));
                    received.reordered += u64::from(number < next);
                    next = next.max(number + 1);
                }
                std::thread::sleep(Duration::from_micros(500));
            }
            received.processor = machine::thread_time() - start;
            received
        });
        Ok(Self { address, stop, thread })
    }

    pub(crate) fn end(self) -> Received {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.join().unwrap_or_default()
    }
}

/// A socket with as large a buffer as the relay asks for.
pub(crate) fn wide(address: &str) -> std::io::Result<UdpSocket> {
    const BUFFER: usize = 8 << 20;
    let socket = UdpSocket::bind(address)?;
    if sockopt::set_socket_recv_buffer_size_force(&socket, BUFFER).is_err() {
        sockopt::set_socket_recv_buffer_size(&socket, BUFFER)?;
    }
    Ok(socket)
}
