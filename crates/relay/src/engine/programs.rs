//! The sender of a datagram, in a mesh: programs by their addresses, given or learnt.

use core::time::Duration;
use std::collections::BTreeMap;
use std::net::SocketAddr;

use cohaptic_units::Instant;
use cohaptic_wan::NodeId;

use crate::config::Program;

/// The addresses of the programs.
///
/// A stranger's address becomes that of the first program, in the order of the file, to which it may belong: whose address is not given and not known; if
/// there is none, whose address was learnt and has been silent too long. It is never that of the program to which it speaks.
#[derive(Debug)]
pub(super) struct Programs {
    places: BTreeMap<SocketAddr, NodeId>,
    programs: Vec<Known>,
    forget_after: Duration,
    /// The sender before: most datagrams of a batch are of one.
    last: Option<(SocketAddr, NodeId)>,
}

#[derive(Debug)]
struct Known {
    address: Option<SocketAddr>,
    is_given: bool,
    heard: Instant,
}

impl Programs {
    pub(super) fn new(programs: &[Program], forget_after: Duration) -> Self {
        let known = |program: &Program| Known { address: program.address, is_given: program.address.is_some(), heard: Instant::ZERO };
        let places = (0..).map(NodeId).zip(programs).filter_map(|(place, program)| Some((program.address?, place))).collect();
        Self { places, programs: programs.iter().map(known).collect(), forget_after, last: None }
    }

    /// The program that sends from that address to the port of program `to`; `None`: a stranger.
    #[inline]
    pub(super) fn sender(&mut self, from: SocketAddr, to: NodeId, now: Instant) -> Option<NodeId> {
        let place = match self.last {
            Some((address, place)) if address == from => place,
            _ => {
                let place = self.places.get(&from).copied().or_else(|| self.learn(from, to, now))?;
                self.last = Some((from, place));
                place
            }
        };
        self.programs[place.index()].heard = now;
        Some(place)
    }

    /// Where a program is; `None` if that is not known yet.
    #[inline]
    pub(super) fn address(&self, place: NodeId) -> Option<SocketAddr> {
        self.programs.get(place.index())?.address
    }

    #[cold]
    fn learn(&mut self, from: SocketAddr, to: NodeId, now: Instant) -> Option<NodeId> {
        let open = |place: &NodeId| *place != to && !self.programs[place.index()].is_given;
        let nodes = || (0..self.programs.len()).map(NodeId::new);
        let silent = |place: &NodeId| now.saturating_duration_since(self.programs[place.index()].heard) >= self.forget_after;
        let unknown = |place: &NodeId| self.programs[place.index()].address.is_none();
        let place = nodes().filter(open).find(unknown).or_else(|| nodes().filter(open).find(silent))?;
        if let Some(before) = self.programs[place.index()].address.replace(from) {
            self.places.remove(&before);
        }
        self.places.insert(from, place);
        self.last = None;
        Some(place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn address(port: u16) -> SocketAddr {
        ([127, 0, 0, 1], port).into()
    }

    fn programs(given: [Option<u16>; 3]) -> Programs {
        let program = |(place, port): (usize, Option<u16>)| Program { name: place.to_string(), port: address(1), address: port.map(address) };
        let programs: Vec<Program> = given.into_iter().enumerate().map(program).collect();
        Programs::new(&programs, Duration::from_secs(30))
    }

    fn second(count: u64) -> Instant {
        Instant::from_nanos(count * 1_000_000_000)
    }

    #[test]
    fn given_addresses_are_known_and_strangers_are_not_taken_for_them() {
        let mut programs = programs([Some(1), Some(2), Some(3)]);
        assert_eq!(
            (1..=4).map(|port| programs.sender(address(port), NodeId(0), second(99))).collect::<Vec<_>>(),
            [Some(NodeId(0)), Some(NodeId(1)), Some(NodeId(2)), None]
        );
    }

    #[test]
    fn a_stranger_is_the_first_program_that_it_may_be() {
        let mut programs = programs([None, Some(2), None]);
        // It speaks to program 0, so it is not that one.
        assert_eq!(programs.sender(address(9), NodeId(0), second(1)), Some(NodeId(2)));
        assert_eq!(programs.sender(address(8), NodeId(1), second(1)), Some(NodeId(0)));
        assert_eq!(programs.sender(address(7), NodeId(1), second(1)), None);
        assert_eq!((programs.address(NodeId(0)), programs.address(NodeId(2))), (Some(address(8)), Some(address(9))));
    }

    #[test]
    fn one_that_was_learnt_and_falls_silent_makes_room_for_another() {
        let mut programs = programs([None, Some(2), Some(3)]);
        assert_eq!(programs.sender(address(9), NodeId(1), second(1)), Some(NodeId(0)));
        assert_eq!(programs.sender(address(8), NodeId(1), second(30)), None);
        assert_eq!(programs.sender(address(8), NodeId(1), second(31)), Some(NodeId(0)));
        // The one before is a stranger now.
        assert_eq!(programs.sender(address(9), NodeId(1), second(32)), None);
        assert_eq!(programs.address(NodeId(0)), Some(address(8)));
    }
}
