//! Network in steps: time advances in steps, and every event happens at a step.

use std::time::Duration;

use cohaptic_units::Instant;

use super::traffic::{Arrival, NODES, Traffic};

/// Treatment of a time between two steps.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Rounding {
    /// Round up to the next step.
    Up,
    /// Round to the nearest step; a time in the middle goes to the next step.
    Nearest,
}

impl Rounding {
    pub(crate) const BOTH: [Self; 2] = [Self::Up, Self::Nearest];

    /// Returns the number of steps in a span.
    pub(crate) fn steps(self, span: Duration, step: Duration) -> u64 {
        let (span, step) = (span.as_nanos(), step.as_nanos());
        let steps = match self {
            Self::Up => span.div_ceil(step),
            Self::Nearest => (span + step / 2) / step,
        };
        u64::try_from(steps).unwrap_or(u64::MAX)
    }

    /// Returns a span rounded to whole steps.
    pub(crate) fn span(self, span: Duration, step: Duration) -> Duration {
        Duration::from_nanos(self.steps(span, step).saturating_mul(u64::try_from(step.as_nanos()).unwrap_or(u64::MAX)))
    }
}

/// A packet on its way.
#[derive(Clone, Copy, Debug)]
struct Flying {
    from: usize,
    to: usize,
    /// Instant at which the sample was taken.
    taken: Instant,
}

/// Sends all traffic in steps: a sample is sent at the first step at or after its instant, its delay is rounded to steps, and it arrives at a step. Packets
/// wait in one list per future step, so that no packet is visited before its arrival.
pub(crate) fn carry(traffic: &Traffic, step: Duration, rounding: Rounding, mut show: impl FnMut(Arrival)) {
    let delays = traffic.delays.map(|row| row.map(|delay| rounding.steps(delay, step)));
    let longest = delays.iter().flatten().copied().max().unwrap_or(0);
    // No packet waits longer than the longest delay, so the lists can be reused in a ring.
    let mut lists: Vec<Vec<Flying>> = vec![Vec::new(); usize::try_from(longest + 1).unwrap_or(1)];
    let places = lists.len() as u64;
    let place = |step: u64| usize::try_from(step % places).unwrap_or(0);
    let mut numbers = [0; NODES];
    let (mut now, mut number, mut flying) = (Instant::ZERO, 0_u64, 0_usize);
    while flying > 0 || numbers.iter().any(|sent| *sent < traffic.rounds) {
        // A node may send several times within one step.
        for from in 0..NODES {
            while numbers[from] < traffic.rounds && traffic.instant(from, numbers[from]) <= now {
                let taken = traffic.instant(from, numbers[from]);
                numbers[from] += 1;
                for to in (0..NODES).filter(|to| *to != from) {
                    // The delay is rounded by itself, as in a simulator whose links have delays in steps.
                    lists[place(number + delays[from][to])].push(Flying { from, to, taken });
                    flying += 1;
                }
            }
        }
        // Sendings come first: a packet with a delay of zero steps arrives at the step of its sending.
        let due = &mut lists[place(number)];
        flying -= due.len();
        for Flying { from, to, taken } in due.drain(..) {
            show(Arrival { from, to, delay: now - taken });
        }
        number += 1;
        now += step;
    }
}
