//! Programs of a mesh, found by the address of the sender. Addresses are configured, or learnt from the first datagram.

use core::time::Duration;
use std::collections::BTreeMap;
use std::net::SocketAddr;

use cohaptic_units::Instant;
use cohaptic_wan::NodeId;

use crate::config::Program;

/// Addresses of the programs of a mesh.
///
/// A stranger takes the place of the first program, in the order of the configuration, with neither a configured nor a learnt address. Without such a program,
/// the stranger takes the place of the first program with a learnt address after a silence of `forget_after`. A stranger never becomes the program at the
/// target port of the stranger's datagram.
#[derive(Debug)]
pub(super) struct Programs {
    /// Program of each known address.
    places: BTreeMap<SocketAddr, NodeId>,
    /// Address and latest datagram of each program, indexed by program.
    programs: Vec<Known>,
    /// Silence before a learnt address gives way to a stranger.
    forget_after: Duration,
    /// Address and program of the latest sender: most datagrams of a batch come from the same program.
    last: Option<(SocketAddr, NodeId)>,
}

/// Current knowledge of a program.
#[derive(Debug)]
struct Known {
    /// Address of the program; `None` if not learnt yet.
    address: Option<SocketAddr>,
    /// `true` if the address is configured. A configured address never changes.
    is_given: bool,
    /// Instant of the latest datagram from the program; zero before the first.
    heard: Instant,
}

impl Programs {
    pub(super) fn new(programs: &[Program], forget_after: Duration) -> Self {
        let known = |program: &Program| Known { address: program.address, is_given: program.address.is_some(), heard: Instant::ZERO };
        let places = (0..).map(NodeId).zip(programs).filter_map(|(place, program)| Some((program.address?, place))).collect();
        Self { places, programs: programs.iter().map(known).collect(), forget_after, last: None }
    }

    /// Returns the program at the address `from` that sends to the port of program `to`, or `None` for a stranger without a place. Records `now` as the latest
    /// sign of the program.
    pub(super) fn sender(&mut self, from: SocketAddr, to: NodeId, now: Instant) -> Option<NodeId> {
        let place = match self.last {
            Some((address, place)) if address == from => place,
            _ => {
                let place = self.places.get(&from).copied().or_else(|| self.learn(from, to, now))?;
                self.last = Some((from, place));
                place
            }
        };
        // `places` and `last` name programs of the configuration only, so the index is valid.
        self.programs[place.index()].heard = now;
        Some(place)
    }

    /// Returns the address of a program, or `None` if the address is not known yet.
    pub(super) fn address(&self, place: NodeId) -> Option<SocketAddr> {
        self.programs.get(place.index())?.address
    }

    /// Gives a stranger the place of a program, or returns `None` if no program can have this address.
    fn learn(&mut self, from: SocketAddr, to: NodeId, now: Instant) -> Option<NodeId> {
        // The candidates: a configured address is never taken away, and a program does not send to the program's own port.
        let open = |place: &NodeId| *place != to && !self.programs[place.index()].is_given;
        let nodes = || (0..self.programs.len()).map(NodeId::new);
        let silent = |place: &NodeId| now.saturating_duration_since(self.programs[place.index()].heard) >= self.forget_after;
        let unknown = |place: &NodeId| self.programs[place.index()].address.is_none();
        // Unheard programs come first, so that a silent program keeps the place as long as there is a choice.
        let place = nodes().filter(open).find(unknown).or_else(|| nodes().filter(open).find(silent))?;
        if let Some(before) = self.programs[place.index()].address.replace(from) {
            self.places.remove(&before);
        }
        self.places.insert(from, place);
        // `last` may name the address that has just lost its place.
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
        // The stranger sends to program 0, so program 2 is the first candidate.
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
        // The former address has become a stranger.
        assert_eq!(programs.sender(address(9), NodeId(1), second(32)), None);
        assert_eq!(programs.address(NodeId(0)), Some(address(8)));
    }
}
