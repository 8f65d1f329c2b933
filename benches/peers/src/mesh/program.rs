//! The programs, in the order of the tables, and what they leave out.

use crate::version;

use super::{Mesh, Outcome, on_bach, on_bach_sockets, on_cohaptic, on_heap, on_loop, on_nexosim, on_turmoil};

/// A program that runs the mesh.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Program {
    /// This project, as it runs a scene that nobody watches.
    Cohaptic,
    /// This project with an observer of every packet: event by event.
    CohapticWatched,
    /// No event queue at all.
    Loop,
    /// A binary heap of events.
    Heap,
    /// nexosim's scheduler and mailboxes.
    Nexosim,
    /// bach's tasks, and its queues with latency.
    Bach,
    /// bach's tasks and UDP sockets.
    BachSockets,
    /// turmoil's hosts and UDP sockets.
    Turmoil,
}

impl Program {
    /// All of them.
    pub const ALL: [Self; 8] =
        [Self::Cohaptic, Self::CohapticWatched, Self::Loop, Self::Heap, Self::Nexosim, Self::Bach, Self::BachSockets, Self::Turmoil];

    /// How it is called in a table.
    #[must_use]
    pub fn name(self) -> String {
        match self {
            Self::Cohaptic => "cohaptic".into(),
            Self::CohapticWatched => "cohaptic, every packet watched".into(),
            Self::Loop => "a bare loop over ticks".into(),
            Self::Heap => "a bare loop over a binary heap".into(),
            Self::Nexosim => format!("nexosim {}", version("nexosim")),
            Self::Bach => format!("bach {}, queues", version("bach")),
            Self::BachSockets => format!("bach {}, UDP sockets", version("bach")),
            Self::Turmoil => format!("turmoil {}", version("turmoil")),
        }
    }

    /// What it does not model, whatever is asked of it.
    #[must_use]
    pub const fn lacks(self) -> &'static str {
        match self {
            Self::Cohaptic | Self::CohapticWatched => "congestion control, layers below the datagram, networks of routers",
            Self::Loop => "time between ticks, any other scene, bytes, counters of links, records",
            Self::Heap => "any other scene, bytes, counters of links, records",
            Self::Nexosim => "links: no delay, loss, jitter, rate, queue or counter but those written here; bytes",
            Self::Bach => "random loss, rate, correlation, counters of links; bytes",
            Self::BachSockets => "a law of delay or loss (a monitor written here decides), rate, correlation, counters of links",
            Self::Turmoil => {
                "time below a millisecond; normal jitter and loss of single packets (written here, at both ends); rate, queues, duplication, counters of links"
            }
        }
    }

    /// How finely packets arrive.
    #[must_use]
    pub const fn resolution(self) -> &'static str {
        match self {
            Self::Cohaptic | Self::CohapticWatched | Self::Heap | Self::Nexosim | Self::Bach | Self::BachSockets => "1 ns",
            Self::Loop | Self::Turmoil => "1 ms",
        }
    }

    /// Runs the mesh for a number of ticks.
    #[must_use]
    pub fn run(self, mesh: Mesh, ticks: u64) -> Outcome {
        match self {
            Self::Cohaptic => on_cohaptic::run(&on_cohaptic::scene(mesh, ticks)),
            Self::CohapticWatched => on_cohaptic::run_watched(&on_cohaptic::scene(mesh, ticks)),
            Self::Loop => on_loop::run(mesh, ticks),
            Self::Heap => on_heap::run(mesh, ticks),
            Self::Nexosim => on_nexosim::run(mesh, ticks),
            Self::Bach => on_bach::run(mesh, ticks),
            Self::BachSockets => on_bach_sockets::run(mesh, ticks),
            Self::Turmoil => on_turmoil::run(mesh, ticks),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TICK_NANOS;

    /// Two seconds: after that the samples of 250 frames have been lost, late and out of order.
    const TICKS: u64 = 2_000;

    #[test]
    fn all_programs_end_in_the_same_state_to_the_bit() {
        for mesh in [3, 10].into_iter().flat_map(|peers| [false, true].map(|impaired| Mesh { peers, impaired })) {
            let expected = on_cohaptic::run(&on_cohaptic::scene(mesh, TICKS));
            assert!(expected.positions.iter().all(|position| *position > 1e-3), "{mesh:?}: the hand has pushed all of them: {expected:?}");
            for program in Program::ALL {
                let outcome = program.run(mesh, TICKS);
                for (peer, (actual, expected)) in outcome.positions.iter().zip(&expected.positions).enumerate() {
                    assert_eq!(actual.to_bits(), expected.to_bits(), "{program:?}, {mesh:?}, peer {peer}: {actual} is not {expected}");
                }
                // Which programs have a packet at its instant, and which at the next tick.
                let late = if outcome.arrival_error_nanos == 0 { 0 } else { TICK_NANOS };
                assert!(outcome.arrival_error_nanos <= late, "{program:?}, {mesh:?}: {outcome:?}");
                assert!(mesh.impaired || outcome.arrival_error_nanos == 0, "{program:?}, {mesh:?}: constant delays end at ticks");
                assert!(program.resolution() == "1 ms" || program == Program::Bach || outcome.arrival_error_nanos == 0, "{program:?}, {mesh:?}");
                // This project also delivers what arrives in the millisecond after the last tick.
                let last = (mesh.peers * mesh.peers) as u64;
                assert!((outcome.delivered..=outcome.delivered + last).contains(&expected.delivered), "{program:?}, {mesh:?}");
            }
        }
    }
}
