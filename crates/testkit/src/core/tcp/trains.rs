//! Segments that leave one connection within one call, and segments that arrive together.
//!
//! The segments of a flight leave, arrive and are acknowledged at the same instants. Where the link lets them travel as one event (`wire/train.rs`), the
//! search for their way, their link and their connection takes place once for all of them. The connection handles each segment, and may send after each
//! segment, as if the segments arrived one after the other: only the offers to the link wait until the last segment was handled. Nothing else is offered on the
//! path meanwhile, so that no number and no instant differs.

use cohaptic_tcp::{Segment, State};
use cohaptic_wan::{NodeId, Path};

use super::passing::Way;
use super::{ConnId, Core, End};
use crate::core::{Ends, Kind, Parcel};
use crate::trace::Lost;
use crate::wire::Held;

/// Segments of one connection that leave within one call. All have the same path and addresses.
#[derive(Debug, Default)]
pub(super) struct Leaving(Option<(Path, Box<Parcel>)>);

impl End {
    /// Returns whether the handshake is over, the connection is not in TIME-WAIT, and no listener holds the connection. Segments of such a connection need no
    /// search for a listener.
    fn is_under_way(&self) -> bool {
        let state = self.machine.state();
        state.is_synchronised() && state != State::TimeWait && self.listener.is_none()
    }
}

impl Core {
    /// Appends the segments that the connection may send now to `leaving`.
    pub(super) fn transmit(&mut self, id: ConnId, leaving: &mut Leaving) {
        let now = self.now();
        loop {
            let machine = &mut self.tcp.end_mut(id).machine;
            if let Some(followers) = leaving.0.as_mut().and_then(|(_, first)| first.followers.as_mut()) {
                return machine.transmit(now, &mut followers.flight);
            }
            let Some(segment) = machine.poll_transmit(now) else { return };
            match &mut leaving.0 {
                Some((_, first)) => self.spare.append(first, segment),
                None => self.begin(id, leaving, segment),
            }
        }
    }

    /// Searches the way of the first segment that leaves.
    fn begin(&mut self, id: ConnId, leaving: &mut Leaving, segment: Segment<'static>) {
        let host = self.tcp.end(id).host;
        let addresses = Ends::new(segment.source, segment.destination, Kind::Segment);
        match self.way(host, &addresses) {
            Way::Loopback => self.tcp.loopback.push_back((host, segment)),
            Way::Nowhere => {}
            Way::On(path) => leaving.0 = Some((path, self.spare.wrapped(addresses, segment))),
        }
    }

    /// Hands the segments that leave to their link: together if the link takes trains and the run watches no packets, otherwise one by one.
    pub(super) fn depart(&mut self, id: ConnId, leaving: Leaving) {
        let Some((path, first)) = leaving.0 else { return };
        let refused = if self.wire.is_watched() { Err(first) } else { self.wire.offer_train(path, first) };
        if let Err(first) = refused {
            self.split(first, |core, parcel| core.emit_on(path, Some(id), parcel));
        }
    }

    /// Calls `take` with a parcel for each segment of a train. The report of the link about the first segment holds for the others as well.
    pub(in crate::core) fn split(&mut self, mut first: Box<Parcel>, mut take: impl FnMut(&mut Self, Box<Parcel>)) {
        let (addresses, mut arrival) = (first.addresses, first.arrival);
        let followers = first.followers.take();
        take(self, first);
        let Some(mut followers) = followers else { return };
        while let Some(segment) = followers.flight.pop_front() {
            let mut parcel = self.spare.wrapped(addresses, segment);
            arrival.packet.sequence += 1;
            parcel.arrival = arrival;
            take(self, parcel);
        }
        self.spare.put_followers(followers);
    }

    /// Handles the segment of a parcel that has arrived at `host`, and the segments that travel with it.
    pub(in crate::core) fn arrive_segments(&mut self, host: NodeId, mut first: Box<Parcel>) -> Result<(), Lost> {
        let Some(mut followers) = first.followers.take() else { return self.arrive_alone(host, first) };
        self.wire.held.remove(Held::cost(first.bytes.len()) + followers.cost());
        // The fates of these segments need no record: a run that records packets has no trains.
        if self.is_up(host)
            && let Some(segment) = first.bytes.segment_mut()
        {
            let (now, mut leaving) = (self.now(), Leaving::default());
            let mut connection = self.under_way(host, segment);
            if let Some(id) = connection {
                self.tcp.end_mut(id).machine.take_segment(now, segment);
                connection = self.go_on(id, &mut leaving);
            } else {
                let _ = self.arrive_whole(host, segment, false);
            }
            let flight = &mut followers.flight;
            while !flight.is_empty() {
                if let Some(id) = connection {
                    self.tcp.end_mut(id).machine.handle_next(now, flight);
                    connection = self.go_on(id, &mut leaving);
                } else if let Some(mut segment) = flight.pop_front() {
                    let _ = self.arrive_whole(host, &mut segment, false);
                }
            }
            if let Some(id) = connection {
                self.depart(id, leaving);
                self.follow_up(id);
            }
        }
        self.spare.put_followers(followers);
        self.spare.put(first);
        Ok(())
    }

    /// Returns the connection of a train that arrives at `host`, if the connection [is under way](End::is_under_way).
    fn under_way(&mut self, host: NodeId, segment: &Segment<'_>) -> Option<ConnId> {
        let is_here = self.is_own(host, segment.destination.ip());
        let id = self.tcp.routed(&super::route(host, segment.destination, segment.source)).filter(|_| is_here)?;
        self.tcp.end(id).is_under_way().then_some(id)
    }

    /// Goes on after a connection has handled a segment of a train: answers go to `leaving`. Returns the connection if it is still under way.
    fn go_on(&mut self, id: ConnId, leaving: &mut Leaving) -> Option<ConnId> {
        self.transmit(id, leaving);
        // Called after each segment, so that tasks are woken in the order of the segments.
        self.wake_ends(id);
        if self.tcp.end(id).is_under_way() {
            return Some(id);
        }
        // `follow_up` may remove the connection, so that the next segments of the train are routed singly.
        self.depart(id, std::mem::take(leaving));
        self.follow_up(id);
        None
    }
}
