//! States of the exchanges with a device slower than the tick, in the vector of states of the general path.

use cohaptic_peer::{Device as _, Exchange, Exchanged, Strategy};

use super::layout::Member;
use super::{state, write};
use crate::timetable::{Event, Timetable};

/// Lets a peer at the beginning of a frame remember the exchanges with its device from the states `z`. `until` is the number of ticks until the next exchange.
/// Returns the number of states.
pub(super) fn restore_exchange<const A: usize, S: Strategy<A>>(
    member: &mut Member<A, S>,
    exchange: Exchange,
    until: u32,
    z: &[f64],
    time: f64,
    compliance: f64,
) -> usize {
    let device = member.device().state();
    let mut exchanged = Exchanged { reading: device, latest: device, held: [0.0; A], until };
    let mut next = 0;
    if exchange.late {
        exchanged.latest = state(z, time);
        next += 2 * A;
    }
    if exchange.holds() {
        exchanged.reading = state(&z[next..], time);
        exchanged.held = core::array::from_fn(|axis| z[next + 2 * A + axis] / compliance);
        next += 3 * A;
    }
    member.set_exchanged(exchanged);
    next
}

/// Writes the remembered exchanges of a peer with its device to `z`, in the order of [`restore_exchange`]. Returns the number of states.
pub(super) fn read_exchange<const A: usize, S: Strategy<A>>(
    member: &Member<A, S>,
    exchange: Exchange,
    z: &mut [f64],
    time: f64,
    compliance: f64,
) -> usize {
    let Some(exchanged) = member.exchanged() else { return 0 };
    let mut next = 0;
    if exchange.late {
        write(&exchanged.latest, z, time);
        next += 2 * A;
    }
    if exchange.holds() {
        write(&exchanged.reading, &mut z[next..], time);
        next += 2 * A;
        for (entry, force) in z[next..].iter_mut().zip(exchanged.held) {
            *entry = force * compliance;
        }
        next += A;
    }
    next
}

/// Returns the number of ticks of each node before its first exchange in the frame, indexed by node.
pub(super) fn ticks_until_exchange(timetable: &Timetable) -> Vec<u32> {
    let mut until = vec![0; timetable.sent.len()];
    let mut found = vec![false; timetable.sent.len()];
    for event in &timetable.events {
        if let Event::Tick { node, exchanges, .. } = *event
            && !found[node]
        {
            (found[node], until[node]) = (exchanges, until[node] + u32::from(!exchanges));
        }
    }
    until
}
