//! Samples to neighbours alone.

use cohaptic_units::Instant;
use cohaptic_wan::{Arrivals, DirectLinks, LinkId};

use super::super::Sample;
use super::super::in_flight::Packet;
use super::super::rows::Rows;
use super::{Links, PerPacket};

impl<const P: usize, const L: usize> PerPacket<P, L> {
    /// [`PerPacket::send`] where each receiver has senders of its own.
    pub(super) fn send_to_neighbours(
        &mut self,
        (tick, now): (u64, Instant),
        senders: &[usize],
        sent: &[Sample<P, L>],
        next: impl Fn(usize) -> Instant,
    ) {
        if let Links::Carried(carrier) = &mut self.links {
            return carrier.send(now, senders, sent);
        }
        let Self { rows, receivers, links, sends, in_flight, .. } = self;
        sends.fill(false);
        senders.iter().for_each(|sender| sends[*sender] = true);
        let packet = |rows: &Rows, receiver: usize, number: usize, arrival: Instant, sequence: u64| {
            let (column, run) = (number / L, number % L);
            rows.packet::<P, L>((receiver, column, run), &sent[rows.sender(receiver, column)].state(run), arrival, sequence)
        };
        for receiver in 0..receivers.len() {
            let row = rows.columns(receiver) * L;
            let first_link = rows.link(receiver, 0) * L;
            match links {
                Links::Direct(links) => {
                    let mut arrivals = Arrivals::NONE;
                    for first in (0..row).step_by(DirectLinks::AT_ONCE) {
                        let count = DirectLinks::AT_ONCE.min(row - first);
                        let mut idle = u8::MAX;
                        for place in (0..count).filter(|place| sends[rows.sender(receiver, (first + place) / L)]) {
                            idle &= !(1 << place);
                        }
                        if idle == u8::MAX {
                            continue;
                        }
                        links.offer(now, LinkId::new(first_link + first), count, idle, &mut arrivals);
                        for place in arrivals.places() {
                            let packet = packet(rows, receiver, first + place, arrivals.at[place], arrivals.sequences[place]);
                            in_flight.push((tick, now), packet, arrivals.overtakes(place));
                        }
                    }
                }
                Links::Carried(_) => {}
                Links::Stepped(links, info) => {
                    for number in 0..row {
                        let sender = rows.sender(receiver, number / L);
                        if !sends[sender] {
                            continue;
                        }
                        let link = LinkId::new(first_link + number);
                        let packet = packet(rows, receiver, number, now, links.offered(link));
                        links.offer((now, next(sender)), link, *info, packet, |arrival, overtakes, packet| {
                            in_flight.push((tick, now), Packet { arrival, ..packet }, overtakes);
                        });
                    }
                }
            }
        }
    }
}
