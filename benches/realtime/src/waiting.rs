//! The ways to wait for an instant that the tables compare.

use std::io;
use std::time::Duration;

use cohaptic_realtime::{Clock as _, MonotonicClock, Pacer, Pacing};
use cohaptic_units::Instant;

/// How a bare thread waits.
#[derive(Clone, Debug)]
pub enum Waiting {
    /// `clock_nanosleep`, and nothing that a pacer does to be on time.
    System,
    /// `clock_nanosleep` until that long before, then looking at the clock: as [`Pacing::Spin`] did before its margin followed the lateness of wake-ups.
    FixedMargin(Duration),
    /// A pacer.
    Paced(Box<Pacer>),
}

impl Waiting {
    /// All of them, with their names.
    #[must_use]
    pub fn all() -> [(&'static str, Self); 4] {
        let paced = |pacing| Self::Paced(Box::new(Pacer::new(pacing)));
        [
            ("`clock_nanosleep`", Self::System),
            ("a fixed margin of 120 µs", Self::FixedMargin(Duration::from_micros(120))),
            ("sleeping", paced(Pacing::Sleep)),
            ("spinning", paced(Pacing::SPIN)),
        ]
    }

    /// Waits for an instant.
    ///
    /// # Errors
    ///
    /// What the system says of the wait.
    pub fn wait(&mut self, clock: &MonotonicClock, due: Instant) -> io::Result<()> {
        match self {
            Self::System => clock.block(Some(due), &[]).map(drop),
            Self::FixedMargin(margin) => {
                let asleep_until = Instant::ZERO + due.saturating_duration_since(Instant::ZERO).saturating_sub(*margin);
                if clock.now() < asleep_until {
                    clock.block(Some(asleep_until), &[])?;
                }
                while clock.now() < due {
                    std::hint::spin_loop();
                }
                Ok(())
            }
            Self::Paced(pacer) => pacer.wait(clock, Some(due), &[]).map(drop),
        }
    }
}
