//! The state that the loop shows to other threads.

use core::time::Duration;

use cohaptic_units::Instant;

use crate::driver::{Phase, Reading, Statistics, Status};
use crate::kinematics::Triple;
use crate::protocol::Buttons;
use crate::safety::ZeroCause;

/// How well the loop keeps its time.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct LoopStatistics {
    /// Turns so far.
    pub turns: u64,
    /// Turns that ended after the next should have begun.
    pub late: u64,
    /// The longest that one was late.
    pub worst: Duration,
}

/// The device after its last exchange.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Snapshot {
    /// When that was, on the transport's clock.
    pub at: Instant,
    /// Where the device stands.
    pub phase: Phase,
    /// Whether the device is homed and the user has switched forces on since.
    pub armed: bool,
    /// Which encoders are homed.
    pub homed: [bool; 3],
    /// The counts of the encoders.
    pub encoders: [i16; 3],
    /// Which buttons are pressed.
    pub buttons: Buttons,
    /// Where the grip is, if that is known.
    pub reading: Option<Reading>,
    /// The force that went out \[N\].
    pub force: Triple,
    /// What happened so far.
    pub statistics: Statistics,
    /// How well the loop keeps its time.
    pub timing: LoopStatistics,
}

/// Words of a snapshot: 5 of flags and times, 9 of vectors, and counters.
pub(super) const WORDS: usize = 5 + 9 + 12 + ZeroCause::ALL.len() + 3;

impl Snapshot {
    pub(super) fn new(at: Instant, status: &Status, statistics: &Statistics, timing: LoopStatistics) -> Self {
        let Status { phase, armed, homed, encoders, buttons, reading, force, motors: _, verdict: _ } = *status;
        Self { at, phase, armed, homed, encoders, buttons, reading, force, statistics: *statistics, timing }
    }

    /// Whether a peer may begin: it is known where the grip is, and forces that are asked for go out.
    #[must_use]
    pub const fn is_ready(&self) -> bool {
        self.armed && self.reading.is_some()
    }

    pub(super) fn to_words(self) -> [u64; WORDS] {
        let mut words = [0; WORDS];
        let reading = self.reading.unwrap_or(Reading { at: Instant::ZERO, position: [0.0; 3], velocity: [0.0; 3] });
        let phase: u64 = match self.phase {
            Phase::Silent => 0,
            Phase::Homing => 1,
            Phase::Homed => 2,
            Phase::Active => 3,
            Phase::Stopped => 4,
        };
        let homed = self.homed.iter().rev().fold(0, |bits, homed| bits << 1 | u64::from(*homed));
        let encoders = self.encoders.iter().rev().fold(0, |bits, count| bits << 16 | u64::from(count.cast_unsigned()));
        let Statistics {
            exchanges,
            reports,
            timeouts,
            garbage_bytes,
            faults,
            implausible,
            unlocated,
            unhomed,
            zeroed,
            limited,
            slewed,
            saturated,
            farewells,
        } = self.statistics;
        let flags = phase | homed << 8 | u64::from(self.buttons.bits()) << 16 | u64::from(self.reading.is_some()) << 24 | u64::from(self.armed) << 32;
        let vectors = [reading.position, reading.velocity, self.force];
        let counters = [exchanges, reports, timeouts, garbage_bytes, faults, implausible, unlocated, unhomed, limited, slewed, saturated, farewells];
        let worst = u64::try_from(self.timing.worst.as_nanos()).unwrap_or(u64::MAX);
        let all = [self.at.as_nanos(), flags, encoders, reading.at.as_nanos(), self.timing.turns, self.timing.late, worst].into_iter();
        let all = all.chain(vectors.into_iter().flatten().map(f64::to_bits)).chain(counters).chain(zeroed);
        for (word, value) in words.iter_mut().zip(all) {
            *word = value;
        }
        words
    }

    pub(super) fn from_words(words: &[u64; WORDS]) -> Self {
        let mut words = words.iter().copied();
        let mut next = || words.next().unwrap_or(0);
        let (at, flags, encoders, read_at) = (Instant::from_nanos(next()), next(), next(), Instant::from_nanos(next()));
        let timing = LoopStatistics { turns: next(), late: next(), worst: Duration::from_nanos(next()) };
        let mut triple = || -> Triple { core::array::from_fn(|_| f64::from_bits(next())) };
        let (position, velocity, force) = (triple(), triple(), triple());
        // In the order in which they were written.
        let statistics = Statistics {
            exchanges: next(),
            reports: next(),
            timeouts: next(),
            garbage_bytes: next(),
            faults: next(),
            implausible: next(),
            unlocated: next(),
            unhomed: next(),
            limited: next(),
            slewed: next(),
            saturated: next(),
            farewells: next(),
            zeroed: core::array::from_fn(|_| next()),
        };
        let byte = |shift: u32| (flags >> shift).to_le_bytes()[0];
        Self {
            at,
            phase: match byte(0) {
                1 => Phase::Homing,
                2 => Phase::Homed,
                3 => Phase::Active,
                4 => Phase::Stopped,
                _ => Phase::Silent,
            },
            armed: byte(32) == 1,
            homed: [0, 1, 2].map(|bit| byte(8) >> bit & 1 == 1),
            encoders: [0, 16, 32].map(|shift| {
                let [low, high, ..] = (encoders >> shift).to_le_bytes();
                i16::from_le_bytes([low, high])
            }),
            buttons: Buttons::from_bits(byte(16)),
            reading: (byte(24) == 1).then_some(Reading { at: read_at, position, velocity }),
            force,
            statistics,
            timing,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_hold_everything() {
        let mut count = 100;
        let mut next = || {
            count += 1;
            count
        };
        let statistics = Statistics {
            exchanges: next(),
            reports: next(),
            timeouts: next(),
            garbage_bytes: next(),
            faults: next(),
            implausible: next(),
            unlocated: next(),
            unhomed: next(),
            zeroed: core::array::from_fn(|_| next()),
            limited: next(),
            slewed: next(),
            saturated: next(),
            farewells: next(),
        };
        let reading = Reading { at: Instant::from_nanos(5), position: [1.0, 2.0, 3.0], velocity: [4.0, 5.0, 6.0] };
        for phase in [Phase::Silent, Phase::Homing, Phase::Homed, Phase::Active, Phase::Stopped] {
            let snapshot = Snapshot {
                at: Instant::from_nanos(9),
                phase,
                armed: phase == Phase::Homed,
                homed: [true, false, true],
                encoders: [-1, i16::MIN, 77],
                buttons: Buttons::from_bits(0xA),
                reading: Some(reading),
                force: [-1.0, 0.5, 8.0],
                statistics,
                timing: LoopStatistics { turns: 1, late: 2, worst: Duration::from_nanos(3) },
            };
            assert_eq!(Snapshot::from_words(&snapshot.to_words()), snapshot);
        }
        assert_eq!(Snapshot::from_words(&Snapshot::default().to_words()), Snapshot::default());
    }
}
