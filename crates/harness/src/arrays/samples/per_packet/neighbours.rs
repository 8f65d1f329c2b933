//! Sending samples over the links of a topology: peers hear their neighbours only.

use cohaptic_units::Instant;
use cohaptic_wan::{Arrivals, DirectLinks, LinkId};

use super::super::Sample;
use super::{Links, PerPacket};

impl<const A: usize, const L: usize> PerPacket<A, L> {
    /// Like [`PerPacket::send`], for receivers with different senders.
    #[inline(never)]
    pub(super) fn send_to_neighbours(
        &mut self,
        (tick, now): (u64, Instant),
        senders: &[usize],
        sent: &[Sample<A, L>],
        next: impl Fn(usize) -> Instant,
    ) {
        // Rows have different lengths, so each receiver's links are offered separately and the last eight of a row may be incomplete.
        let Self { rows, receivers, links, sends, in_flight, .. } = self;
        sends.fill(false);
        senders.iter().for_each(|sender| sends[*sender] = true);
        for receiver in 0..receivers.len() {
            let row = rows.columns(receiver) * L;
            let first_link = rows.link(receiver, 0) * L;
            match links {
                Links::Direct(links) => {
                    let mut arrivals = Arrivals::NONE;
                    for first in (0..row).step_by(DirectLinks::AT_ONCE) {
                        let count = DirectLinks::AT_ONCE.min(row - first);
                        // One bit for each of up to eight links: a link with a set bit is offered no packet.
                        let mut idle = u8::MAX;
                        for place in (0..count).filter(|place| sends[rows.sender(receiver, (first + place) / L)]) {
                            idle &= !(1 << place);
                        }
                        if idle == u8::MAX {
                            continue;
                        }
                        links.offer(now, LinkId::new(first_link + first), count, idle, &mut arrivals);
                        for place in arrivals.places() {
                            let (column, run) = ((first + place) / L, (first + place) % L);
                            let state = sent[rows.sender(receiver, column)].state(run);
                            let packet = rows.packet::<A, L>((receiver, column, run), &state, arrivals.at[place], arrivals.sequences[place]);
                            in_flight.push((tick, now), packet, arrivals.overtakes(place));
                        }
                    }
                }
                // Several runs at once have direct links only.
                Links::Stepped(_) if const { L > 1 } => {}
                Links::Stepped(links) => {
                    for number in 0..row {
                        let (column, run) = (number / L, number % L);
                        let sender = rows.sender(receiver, column);
                        if !sends[sender] {
                            continue;
                        }
                        links.offer(
                            (now, next(sender)),
                            LinkId::new(first_link + number),
                            sent[sender].state(run),
                            |arrival, overtakes, sequence, state| {
                                in_flight.push((tick, now), rows.packet::<A, L>((receiver, column, run), &state, arrival, sequence), overtakes);
                            },
                        );
                    }
                }
            }
        }
    }
}
