//! bach, its network: the peers have UDP sockets, and a monitor of packets gives each its delay or drops it.
//!
//! A packet comes a few turns of the executor after its instant, so that ticks are a nanosecond behind.

use std::cell::RefCell;
use std::net::SocketAddr;
use std::rc::Rc;
use std::time::Duration;

use bach::environment::default::Runtime;
use bach::environment::net::queue::Fixed;
use bach::ext::{GroupExt, PrimaryExt, SpawnExt};
use bach::net::UdpSocket;
use bach::net::monitor::{self, Command};
use bach::time::Instant;

use super::body::Body;
use super::draws::Draws;
use super::on_loop::outcome;
use super::{DELAY_NANOS, Mesh, Outcome, Packet, TICK_NANOS, TICKS_A_FRAME};

const PORT: u16 = 7000;
const BEHIND: u64 = 1;
/// When the first tick is: all have bound their sockets then.
const BEGIN: u64 = TICK_NANOS;

/// The bytes of a datagram.
pub(super) const SIZE: usize = 64;

/// A sample as the bytes of a datagram: sender, number, when it arrives, state.
#[must_use]
pub(super) fn encode(packet: &Packet) -> [u8; SIZE] {
    let mut datagram = [0; SIZE];
    let words = [packet.from as u64, packet.sequence, packet.arrival, packet.x.to_bits(), packet.v.to_bits()];
    for (place, word) in datagram.chunks_exact_mut(8).zip(words) {
        place.copy_from_slice(&word.to_le_bytes());
    }
    datagram
}

/// The sample of a datagram.
#[must_use]
pub(super) fn decode(datagram: &[u8]) -> Packet {
    let word = |place: usize| datagram[8 * place..8 * place + 8].iter().rev().fold(0, |word, byte| word << 8 | u64::from(*byte));
    Packet { from: word(0) as usize, sequence: word(1), arrival: word(2), x: f64::from_bits(word(3)), v: f64::from_bits(word(4)) }
}

/// Runs the mesh for a number of ticks.
///
/// # Panics
///
/// If bach gives an error.
#[must_use]
pub fn run(mesh: Mesh, ticks: u64) -> Outcome {
    let bodies: Vec<Rc<RefCell<Body>>> = Body::all(mesh).into_iter().map(|body| Rc::new(RefCell::new(body))).collect();
    let worst = Rc::new(RefCell::new(0));
    let net = Fixed::default().with_net_latency(Duration::from_nanos(DELAY_NANOS - BEHIND));
    Runtime::new().with_net_queues(Some(Box::new(net))).run(|| {
        if mesh.impaired {
            // The draws stand in the datagram; a sample that is lost has no arrival.
            monitor::on_packet_sent(|packet| {
                let payload = packet.transport.payload();
                let arrival = payload.get(16..24).map_or(0, |bytes| bytes.iter().rev().fold(0, |word, byte| word << 8 | u64::from(*byte)));
                if arrival == 0 {
                    return Command::Drop;
                }
                let now = Instant::now().elapsed_since_start();
                let delay = Duration::from_nanos(BEGIN + arrival).saturating_sub(now);
                monitor::delay(delay).absolute().into()
            });
        }
        for (me, body) in bodies.iter().enumerate() {
            peer(mesh, me, ticks, Rc::clone(body), Rc::clone(&worst)).group(name(me)).primary().spawn();
        }
    });
    let bodies: Vec<Body> = bodies.iter().map(|body| body.borrow().clone()).collect();
    let worst = *worst.borrow();
    outcome(&bodies, worst)
}

fn name(peer: usize) -> String {
    format!("peer{}", peer + 1)
}

async fn peer(mesh: Mesh, me: usize, ticks: u64, body: Rc<RefCell<Body>>, worst: Rc<RefCell<u64>>) {
    let socket = UdpSocket::bind(format!("{}:{PORT}", name(me))).await.expect("the port is free");
    bach::time::sleep(Duration::from_nanos(BEGIN + BEHIND) - Instant::now().elapsed_since_start()).await;
    let draws = Draws::from(mesh, me);
    let others: Vec<SocketAddr> =
        (0..mesh.peers).map(|other| bach::net::try_lookup(format!("{}:{PORT}", name(other))).expect("it has one")).collect();
    let socket = Rc::new(socket);
    receive(Rc::clone(&socket), Rc::clone(&body), worst).spawn();
    for tick in 0..ticks {
        let now = tick * TICK_NANOS;
        if tick.is_multiple_of(TICKS_A_FRAME) {
            let (sequence, [x, v]) = (tick / TICKS_A_FRAME, body.borrow().state());
            for (to, address) in others.iter().enumerate().filter(|(to, _)| *to != me) {
                let arrival = draws[to].delay(sequence).map_or(0, |delay| now + delay);
                let datagram = encode(&Packet { from: me, sequence, arrival, x, v });
                socket.send_to(&datagram, *address).await.expect("its buffer has no end");
            }
        }
        body.borrow_mut().tick();
        bach::time::sleep(Duration::from_nanos(TICK_NANOS)).await;
    }
}

/// A task of its own: a socket of bach gives nothing to a task that does not wait for it.
async fn receive(socket: Rc<UdpSocket>, body: Rc<RefCell<Body>>, worst: Rc<RefCell<u64>>) {
    let mut buffer = [0; SIZE];
    while socket.recv_from(&mut buffer).await.is_ok() {
        let packet = decode(&buffer);
        let now = Instant::now().elapsed_since_start();
        let error = now.abs_diff(Duration::from_nanos(BEGIN + packet.arrival)).as_nanos();
        let mut worst = worst.borrow_mut();
        *worst = u64::try_from(error).unwrap_or(u64::MAX).max(*worst);
        body.borrow_mut().receive(&packet);
    }
}
