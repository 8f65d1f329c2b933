//! bach, its queues: a task for each peer, and before it a queue with latency, from which it takes at each tick what has arrived.
//!
//! No timer and no task for a packet: the fastest that bach has. Its queue finds the first that is due by going through those that are not.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use bach::environment::default::Runtime;
use bach::ext::{InstantQueueExt, PrimaryExt, QueueExt, SpawnExt};
use bach::queue::latent::{self, Latency};
use bach::queue::vec_deque;
use bach::sync::queue::Shared;
use bach::time::Instant;

use super::body::Body;
use super::draws::Draws;
use super::on_loop::outcome;
use super::{Mesh, Outcome, Packet, TICK_NANOS, TICKS_A_FRAME};

/// What a packet has drawn is its latency.
#[derive(Clone, Copy, Debug)]
struct Drawn;

impl Latency<Packet> for Drawn {
    fn for_value(&self, packet: &Packet) -> Duration {
        Duration::from_nanos(packet.arrival).saturating_sub(Instant::now().elapsed_since_start())
    }
}

type Inbox = Arc<Mutex<latent::Queue<Packet, vec_deque::Queue<(Instant, Packet)>, Drawn>>>;

/// Runs the mesh for a number of ticks.
#[must_use]
pub fn run(mesh: Mesh, ticks: u64) -> Outcome {
    let inboxes: Vec<Inbox> = (0..mesh.peers).map(|_| Arc::new(vec_deque::Queue::default().latent(Drawn).mutex())).collect();
    let bodies: Vec<Rc<RefCell<Body>>> = Body::all(mesh).into_iter().map(|body| Rc::new(RefCell::new(body))).collect();
    let worst = Rc::new(RefCell::new(0));
    Runtime::new().run(|| {
        for (me, body) in bodies.iter().enumerate() {
            peer(mesh, me, ticks, Rc::clone(body), inboxes.clone(), Rc::clone(&worst)).primary().spawn();
        }
    });
    let bodies: Vec<Body> = bodies.iter().map(|body| body.borrow().clone()).collect();
    let worst = *worst.borrow();
    outcome(&bodies, worst)
}

async fn peer(mesh: Mesh, me: usize, ticks: u64, body: Rc<RefCell<Body>>, inboxes: Vec<Inbox>, worst: Rc<RefCell<u64>>) {
    let draws = Draws::from(mesh, me);
    for tick in 0..ticks {
        let now = tick * TICK_NANOS;
        if tick.is_multiple_of(TICKS_A_FRAME) {
            let (sequence, [x, v]) = (tick / TICKS_A_FRAME, body.borrow().state());
            for (to, inbox) in inboxes.iter().enumerate().filter(|(to, _)| *to != me) {
                if let Some(delay) = draws[to].delay(sequence) {
                    let pushed = inbox.push(Packet { from: me, sequence, arrival: now + delay, x, v });
                    debug_assert!(pushed.is_ok(), "queues have no limit");
                }
            }
        }
        {
            let (mut body, mut worst) = (body.borrow_mut(), worst.borrow_mut());
            while let Ok(packet) = inboxes[me].pop() {
                *worst = (now - packet.arrival).max(*worst);
                body.receive(&packet);
            }
            body.tick();
        }
        bach::time::sleep(Duration::from_nanos(TICK_NANOS)).await;
    }
}
