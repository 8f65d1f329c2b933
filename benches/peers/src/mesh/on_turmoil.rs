//! turmoil: a host with a UDP socket for each peer, stepped by milliseconds.
//!
//! Its links have one latency, or one between two bounds by an exponential law, in whole milliseconds, and fail in both directions for a while instead of
//! losing a packet. So with jitter and loss a sender does not send lost samples, links take what no packet falls below, and the receiver keeps a packet
//! until the tick by which it should have arrived.

use std::cell::RefCell;
use std::net::SocketAddr;
use std::rc::Rc;
use std::time::Duration;

use turmoil::net::UdpSocket;

use super::body::Body;
use super::draws::Draws;
use super::on_bach_sockets::{SIZE, decode, encode};
use super::on_loop::outcome;
use super::{DELAY_NANOS, Mesh, Outcome, Packet, TICK_NANOS, TICKS_A_FRAME};

const PORT: u16 = 7000;
/// Six deviations of the jitter below the mean: what links take if the rest is the receiver's. A test shows that no packet of these runs is faster.
const LEAST_NANOS: u64 = DELAY_NANOS - 12_000_000;
/// More ticks than a packet is ever on its way.
const WHEEL: u64 = 64;
/// When the first tick is: all have bound their sockets then.
const BEGIN: Duration = Duration::from_millis(1);

/// Runs the mesh for a number of ticks.
///
/// # Panics
///
/// If turmoil gives an error.
#[must_use]
pub fn run(mesh: Mesh, ticks: u64) -> Outcome {
    let latency = Duration::from_nanos(if mesh.impaired { LEAST_NANOS } else { DELAY_NANOS });
    let mut sim = turmoil::Builder::new()
        .tick_duration(Duration::from_nanos(TICK_NANOS))
        .min_message_latency(latency)
        .max_message_latency(latency)
        .udp_capacity(64 * mesh.peers)
        .rng_seed(1)
        .simulation_duration(Duration::from_nanos(TICK_NANOS) * u32::try_from(ticks + 100).unwrap_or(u32::MAX))
        .build();
    let addresses: Vec<SocketAddr> = (0..mesh.peers).map(|peer| (sim.lookup(name(peer)), PORT).into()).collect();
    let bodies: Vec<Rc<RefCell<Body>>> = Body::all(mesh).into_iter().map(|body| Rc::new(RefCell::new(body))).collect();
    let worst = Rc::new(RefCell::new(0));
    for (me, body) in bodies.iter().enumerate() {
        sim.client(name(me), peer(mesh, me, ticks, Rc::clone(body), addresses.clone(), Rc::clone(&worst)));
    }
    sim.run().expect("the program ends");
    let bodies: Vec<Body> = bodies.iter().map(|body| body.borrow().clone()).collect();
    let worst = *worst.borrow();
    outcome(&bodies, worst)
}

fn name(peer: usize) -> String {
    format!("peer{}", peer + 1)
}

async fn peer(mesh: Mesh, me: usize, ticks: u64, body: Rc<RefCell<Body>>, addresses: Vec<SocketAddr>, worst: Rc<RefCell<u64>>) -> turmoil::Result {
    let begin = tokio::time::Instant::now() + BEGIN;
    let socket = UdpSocket::bind(("0.0.0.0", PORT)).await?;
    let draws = Draws::from(mesh, me);
    let mut wheel: Vec<Vec<Packet>> = vec![Vec::new(); WHEEL as usize];
    let mut buffer = [0; SIZE];
    for tick in 0..ticks {
        tokio::time::sleep_until(begin + Duration::from_nanos(tick * TICK_NANOS)).await;
        let now = tick * TICK_NANOS;
        let mut body = body.borrow_mut();
        if tick.is_multiple_of(TICKS_A_FRAME) {
            let (sequence, [x, v]) = (tick / TICKS_A_FRAME, body.state());
            for (to, address) in addresses.iter().enumerate().filter(|(to, _)| *to != me) {
                if let Some(delay) = draws[to].delay(sequence) {
                    let datagram = encode(&Packet { from: me, sequence, arrival: now + delay, x, v });
                    socket.try_send_to(&datagram, *address)?;
                }
            }
        }
        while socket.try_recv_from(&mut buffer).is_ok() {
            let packet = decode(&buffer);
            wheel[(packet.arrival.div_ceil(TICK_NANOS).max(tick) % WHEEL) as usize].push(packet);
        }
        for packet in wheel[(tick % WHEEL) as usize].drain(..) {
            let mut worst = worst.borrow_mut();
            *worst = now.saturating_sub(packet.arrival).max(*worst);
            body.receive(&packet);
        }
        body.tick();
    }
    Ok(())
}
