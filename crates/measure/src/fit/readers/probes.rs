//! Probes that are answered: a packet up and a packet down, with delays of both ways.

use cohaptic_wan::delay_table::Attoseconds;

use super::{Delays, Direction, LeftOut, Program, ReaderError};
use crate::fit::{Measurement, Measurements};

/// One probe.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Probe {
    /// Instant of sending, by the clock of the client.
    pub(super) sent: Attoseconds,
    pub(super) outcome: Outcome,
}

/// Fate of a probe.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Outcome {
    /// The packet was lost on the way up.
    LostUp,
    /// The answer was lost on the way down.
    LostDown,
    /// Packet or answer was lost.
    Lost,
    /// The answer came. Delays are `None` where the file does not have them. Delays up and down contain the offset of the server's clock.
    Answered { up: Option<Attoseconds>, down: Option<Attoseconds>, rtt: Option<Attoseconds> },
}

/// Place of a probe and names of its delays, for errors.
pub(super) trait Places {
    /// Returns the place of the instant of sending of the probe with this index.
    fn sent(&self, probe: usize) -> String;
    /// Returns the place of the delay of the probe with this index.
    fn delay(&self, probe: usize, direction: Direction) -> String;
}

/// Takes the delays of one way, or of the round trip.
///
/// The offset of the server's clock is θ = (min up − min down)/2 of the probes that were answered: the least delays of both ways are then equal. The offset is
/// taken off in whole attoseconds, because the two clocks may count from different years.
pub(super) fn take(program: Program, probes: &[Probe], direction: Option<Direction>, places: &impl Places) -> Result<Delays, ReaderError> {
    let Some(direction) = direction else {
        return Err(ReaderError::new("direction", "the file has both ways: expected up, down, or rtt for the round trip"));
    };
    let least = |of: fn(&Outcome) -> Option<Attoseconds>| probes.iter().filter_map(|probe| of(&probe.outcome)).min();
    let [up, down] = [least(|outcome| outcome.up()), least(|outcome| outcome.down())];
    let offset = match (direction, up, down) {
        // Two delays of 10^20 s could exceed the range of the difference.
        (Direction::Up | Direction::Down, Some(up), Some(down)) => up.since(down).map(|difference| Attoseconds::new(difference.get() / 2)),
        _ => None,
    };
    let mut left_out = LeftOut::default();
    let mut packets: Vec<Measurement> = Vec::new();
    let first = probes.first().map_or(Attoseconds::new(0), |probe| probe.sent);
    let mut before = first;
    for (number, probe) in probes.iter().enumerate() {
        // `Measurements::in_order` below relies on this check.
        if probe.sent < before {
            let expected = "probes in the order of sending";
            return Err(ReaderError::found(places.sent(number), "an instant before that of the probe before", expected));
        }
        before = probe.sent;
        let delay = match (probe.outcome, direction) {
            (Outcome::Lost, Direction::Rtt)
            | (Outcome::LostUp, Direction::Up | Direction::Rtt)
            | (Outcome::LostDown, Direction::Down | Direction::Rtt) => None,
            // The loss may have been on the other way: the packet counts neither as lost nor as delivered.
            (Outcome::Lost, Direction::Up | Direction::Down) => {
                left_out.either_way += 1;
                continue;
            }
            // A lost request has no answer to measure, and a lost answer took the delay of its request with it.
            (Outcome::LostUp, Direction::Down) | (Outcome::LostDown, Direction::Up) => {
                left_out.other_way += 1;
                continue;
            }
            (Outcome::Answered { up, down, rtt }, _) => {
                let (shown, offset) = match direction {
                    Direction::Up => (up, offset),
                    // The server's clock is ahead by the offset, so a delay down is shown too short by the offset.
                    Direction::Down => (down, offset.map(|offset| Attoseconds::new(-offset.get()))),
                    Direction::Rtt => (rtt, None),
                };
                let shown =
                    super::json::needed(shown, places.delay(number, direction), "the delay of an answered probe, or that the probe was lost")?;
                let delay = shown.since(offset.unwrap_or(Attoseconds::new(0)));
                Some(delay.ok_or_else(|| ReaderError::found(places.delay(number, direction), "a delay out of range", "less than 10^20 s"))?)
            }
        };
        // Instants are below 10^20 s, so their difference is in range unless their signs differ.
        let sent_s = probe.sent.seconds_since(first);
        let sent_s = sent_s.ok_or_else(|| ReaderError::found(places.sent(number), "an instant out of range", "within 10^20 s of the first"))?;
        packets.push(Measurement { sent_s, delay_s: delay.map(Attoseconds::seconds) });
    }
    Ok(Delays {
        program,
        direction,
        measurements: Measurements::in_order(packets),
        left_out,
        offset_s: offset.map(Attoseconds::seconds),
        notes: Vec::new(),
    })
}

impl Outcome {
    const fn up(&self) -> Option<Attoseconds> {
        if let Self::Answered { up, .. } = self { *up } else { None }
    }

    const fn down(&self) -> Option<Attoseconds> {
        if let Self::Answered { down, .. } = self { *down } else { None }
    }
}
