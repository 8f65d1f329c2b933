//! An event loop over a binary heap: what one writes in an afternoon, with an event for each peer's tick and for each packet.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

use super::body::Body;
use super::draws::Draws;
use super::on_loop::outcome;
use super::{Mesh, Outcome, Packet, TICK_NANOS, TICKS_A_FRAME};

/// An event, and the peer that it happens to.
#[derive(Clone, Copy, Debug)]
enum What {
    Arrives(Packet),
    Ticks,
}

#[derive(Clone, Copy, Debug)]
struct Event {
    at: u64,
    peer: usize,
    what: What,
}

impl Event {
    /// Packets come before the ticks of the same instant.
    const fn key(&self) -> (u64, bool, usize) {
        (self.at, matches!(self.what, What::Ticks), self.peer)
    }
}

impl PartialEq for Event {
    fn eq(&self, other: &Self) -> bool {
        self.key() == other.key()
    }
}

impl Eq for Event {}

impl PartialOrd for Event {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Event {
    fn cmp(&self, other: &Self) -> Ordering {
        self.key().cmp(&other.key())
    }
}

/// Runs the mesh for a number of ticks.
#[must_use]
pub fn run(mesh: Mesh, ticks: u64) -> Outcome {
    let n = mesh.peers;
    let mut bodies = Body::all(mesh);
    let draws: Vec<Vec<Draws>> = (0..n).map(|from| Draws::from(mesh, from)).collect();
    let mut heap: BinaryHeap<Reverse<Event>> = (0..n).map(|peer| Reverse(Event { at: 0, peer, what: What::Ticks })).collect();
    let mut worst = 0;
    while let Some(Reverse(Event { at, peer, what })) = heap.pop() {
        if at >= ticks * TICK_NANOS {
            break;
        }
        match what {
            What::Arrives(packet) => {
                worst = worst.max(at - packet.arrival);
                // Those that arrive after the last tick do not count, as with a loop over ticks.
                if at <= (ticks - 1) * TICK_NANOS {
                    bodies[peer].receive(&packet);
                }
            }
            What::Ticks => {
                let tick = at / TICK_NANOS;
                if tick.is_multiple_of(TICKS_A_FRAME) {
                    let (sequence, [x, v]) = (tick / TICKS_A_FRAME, bodies[peer].state());
                    for to in (0..n).filter(|&to| to != peer) {
                        if let Some(delay) = draws[peer][to].delay(sequence) {
                            let arrival = at + delay;
                            heap.push(Reverse(Event { at: arrival, peer: to, what: What::Arrives(Packet { from: peer, sequence, arrival, x, v }) }));
                        }
                    }
                }
                bodies[peer].tick();
                heap.push(Reverse(Event { at: at + TICK_NANOS, peer, what: What::Ticks }));
            }
        }
    }
    outcome(&bodies, worst)
}
