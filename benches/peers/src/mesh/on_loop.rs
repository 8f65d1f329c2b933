//! A bare loop over ticks: no event queue at all, since everything that matters happens at ticks. Written for one scene, once.

use std::collections::VecDeque;

use super::body::Body;
use super::draws::Draws;
use super::{DELAY_NANOS, Mesh, Outcome, Packet, TICK_NANOS, TICKS_A_FRAME};

/// More ticks than a packet is ever on its way.
const WHEEL: u64 = 64;

/// Runs the mesh for a number of ticks.
#[must_use]
pub fn run(mesh: Mesh, ticks: u64) -> Outcome {
    let n = mesh.peers;
    let mut bodies = Body::all(mesh);
    let draws: Vec<Vec<Draws>> = (0..n).map(|from| Draws::from(mesh, from)).collect();
    let mut ring: VecDeque<(usize, Packet)> = VecDeque::new();
    let mut wheel: Vec<Vec<(usize, Packet)>> = vec![Vec::new(); WHEEL as usize];
    let mut worst = 0;
    for tick in 0..ticks {
        let now = tick * TICK_NANOS;
        if tick.is_multiple_of(TICKS_A_FRAME) {
            let sequence = tick / TICKS_A_FRAME;
            for from in 0..n {
                let [x, v] = bodies[from].state();
                for to in (0..n).filter(|&to| to != from) {
                    if mesh.impaired {
                        let Some(delay) = draws[from][to].delay(sequence) else { continue };
                        let arrival = now + delay;
                        wheel[(arrival.div_ceil(TICK_NANOS) % WHEEL) as usize].push((to, Packet { from, sequence, arrival, x, v }));
                    } else {
                        ring.push_back((to, Packet { from, sequence, arrival: now + DELAY_NANOS, x, v }));
                    }
                }
            }
        }
        for (to, packet) in wheel[(tick % WHEEL) as usize].drain(..) {
            worst = worst.max(now - packet.arrival);
            bodies[to].receive(&packet);
        }
        while let Some((to, packet)) = ring.pop_front_if(|(_, packet)| packet.arrival <= now) {
            bodies[to].receive(&packet);
        }
        for body in &mut bodies {
            body.tick();
        }
    }
    outcome(&bodies, worst)
}

/// What bodies end with.
pub(super) fn outcome(bodies: &[Body], arrival_error_nanos: u64) -> Outcome {
    Outcome {
        positions: bodies.iter().map(|body| body.state()[0]).collect(),
        delivered: bodies.iter().map(Body::delivered).sum(),
        arrival_error_nanos,
    }
}
