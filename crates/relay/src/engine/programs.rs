//! The sender of a datagram, in a mesh: programs by their addresses, given or learnt.

use core::time::Duration;
use std::collections::BTreeMap;
use std::net::SocketAddr;

use cohaptic_units::Instant;

use crate::config::Program;

/// The addresses of the programs.
///
/// A stranger's address becomes that of the first program, in the order of the file, to which it may belong: whose address is not given and not known; if
/// there is none, whose address was learnt and has been silent too long. It is never that of the program to which it speaks.
#[derive(Debug)]
pub(super) struct Programs {
    places: BTreeMap<SocketAddr, u32>,
    programs: Vec<Known>,
    forget_after: Duration,
    /// The sender before: most datagrams of a batch are of one.
    last: Option<(SocketAddr, u32)>,
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
        let places = (0..).zip(programs).filter_map(|(place, program)| Some((program.address?, place))).collect();
        Self { places, programs: programs.iter().map(known).collect(), forget_after, last: None }
    }

    /// The program that sends from that address to the port of program `to`; `None`: a stranger.
    #[inline]
    pub(super) fn sender(&mut self, from: SocketAddr, to: u32, now: Instant) -> Option<u32> {
        let place = match self.last {
            Some((address, place)) if address == from => place,
            _ => {
                let place = self.places.get(&from).copied().or_else(|| self.learn(from, to, now))?;
                self.last = Some((from, place));
                place
            }
        };
        self.programs[place as usize].heard = now;
        Some(place)
    }

    /// Where a program is; `None` if that is not known yet.
    #[inline]
    pub(super) fn address(&self, place: u32) -> Option<SocketAddr> {
        self.programs.get(place as usize)?.address
    }

    #[cold]
    fn learn(&mut self, from: SocketAddr, to: u32, now: Instant) -> Option<u32> {
        let open = |place: &u32| *place != to && !self.programs[*place as usize].is_given;
        let count = u32::try_from(self.programs.len()).unwrap_or(u32::MAX);
        let silent = |place: &u32| now.saturating_duration_since(self.programs[*place as usize].heard) >= self.forget_after;
        let unknown = |place: &u32| self.programs[*place as usize].address.is_none();
        let place = (0..count).filter(open).find(unknown).or_else(|| (0..count).filter(open).find(silent))?;
        if let Some(before) = self.programs[place as usize].address.replace(from) {
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
        assert_eq!((1..=4).map(|port| programs.sender(address(port), 0, second(99))).collect::<Vec<_>>(), [Some(0), Some(1), Some(2), None]);
    }

    #[test]
    fn a_stranger_is_the_first_program_that_it_may_be() {
        let mut programs = programs([None, Some(2), None]);
        // It speaks to program 0, so it is not that one.
        assert_eq!(programs.sender(address(9), 0, second(1)), Some(2));
        assert_eq!(programs.sender(address(8), 1, second(1)), Some(0));
        assert_eq!(programs.sender(address(7), 1, second(1)), None);
        assert_eq!((programs.address(0), programs.address(2)), (Some(address(8)), Some(address(9))));
    }

    #[test]
    fn one_that_was_learnt_and_falls_silent_makes_room_for_another() {
        let mut programs = programs([None, Some(2), Some(3)]);
        assert_eq!(programs.sender(address(9), 1, second(1)), Some(0));
        assert_eq!(programs.sender(address(8), 1, second(30)), None);
        assert_eq!(programs.sender(address(8), 1, second(31)), Some(0));
        // The one before is a stranger now.
        assert_eq!(programs.sender(address(9), 1, second(32)), None);
        assert_eq!(programs.address(0), Some(address(8)));
    }
}
