//! Waiting for a deadline: sleep, and if asked spin the last of it.

use std::io;
use std::os::fd::BorrowedFd;
use std::time::Duration;

use cohaptic_units::Instant;

use crate::Clock;

/// How to wait.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Pacing {
    /// Leave the processor until the system wakes the thread: tens of microseconds late.
    #[default]
    Sleep,
    /// The same until `margin` before the deadline, then look at the clock again and again: well below a microsecond late as long as the thread is not
    /// moved aside, for a core that is busy during the margin.
    Spin {
        /// Longer than nearly all wake-ups of the system are late.
        margin: Duration,
    },
}

impl Pacing {
    /// Spins long enough for an ordinary machine: 99 % of its wake-ups are less than 100 µs late.
    pub const SPIN: Self = Self::Spin { margin: Duration::from_micros(120) };
}

/// Why a wait came to its end.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Woken {
    /// The deadline has come. Something may be readable too.
    Deadline,
    /// Before the deadline, something can be read.
    Readable,
    /// Before the deadline, and nothing can be read: a signal. Look whether to go on.
    Early,
}

/// Waits for absolute deadlines, so that being late for one does not move the next.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Pacer {
    pacing: Pacing,
}

impl Pacer {
    /// A pacer that waits like that.
    #[must_use]
    pub const fn new(pacing: Pacing) -> Self {
        Self { pacing }
    }

    /// Waits until the deadline (`None`: for ever) has come, or until one of `readable` can be read. A deadline that has passed is [`Woken::Deadline`] at
    /// once. While it spins it does not look at `readable`: at most for the margin.
    ///
    /// # Errors
    ///
    /// What the system says of the wait.
    #[inline]
    pub fn wait(&self, clock: &impl Clock, deadline: Option<Instant>, readable: &[BorrowedFd<'_>]) -> io::Result<Woken> {
        let Some(deadline) = deadline else {
            return Ok(if clock.block(None, readable)? { Woken::Readable } else { Woken::Early });
        };
        let margin = match self.pacing {
            Pacing::Sleep => Duration::ZERO,
            Pacing::Spin { margin } => margin,
        };
        let asleep_until = Instant::ZERO + deadline.saturating_duration_since(Instant::ZERO).saturating_sub(margin);
        loop {
            let now = clock.now();
            if now >= deadline {
                return Ok(Woken::Deadline);
            }
            if now >= asleep_until {
                break;
            }
            if clock.block(Some(asleep_until), readable)? {
                return Ok(Woken::Readable);
            }
            if clock.now() == now {
                // A clock that does not move while it waits has been interrupted at once, or belongs to a test that wants to be asked.
                return Ok(Woken::Early);
            }
        }
        while clock.now() < deadline {
            std::hint::spin_loop();
        }
        Ok(Woken::Deadline)
    }
}

#[cfg(test)]
mod tests {
    use std::cell::{Cell, RefCell};

    use super::*;

    /// A clock that moves by a step each time it is read, wakes late, and writes down what it was asked.
    struct Fake {
        now: Cell<u64>,
        step: u64,
        late: u64,
        readable_at: Option<u64>,
        asked: RefCell<Vec<u64>>,
    }

    impl Clock for Fake {
        fn now(&self) -> Instant {
            self.now.set(self.now.get() + self.step);
            Instant::from_nanos(self.now.get())
        }

        fn block(&self, until: Option<Instant>, _readable: &[BorrowedFd<'_>]) -> io::Result<bool> {
            let until = until.map_or(u64::MAX, Instant::as_nanos);
            self.asked.borrow_mut().push(until);
            if let Some(at) = self.readable_at.filter(|at| *at <= until) {
                self.now.set(at);
                return Ok(true);
            }
            self.now.set(until + self.late);
            Ok(false)
        }
    }

    fn fake(step: u64, late: u64) -> Fake {
        Fake { now: Cell::new(0), step, late, readable_at: None, asked: RefCell::new(Vec::new()) }
    }

    fn at(nanos: u64) -> Option<Instant> {
        Some(Instant::from_nanos(nanos))
    }

    #[test]
    fn sleeping_wakes_as_late_as_the_system_does_and_spinning_does_not() {
        let (sleeping, spinning) = (fake(0, 50_000), fake(10, 50_000));
        assert_eq!(Pacer::new(Pacing::Sleep).wait(&sleeping, at(1_000_000), &[]).unwrap(), Woken::Deadline);
        assert_eq!(sleeping.now.get(), 1_050_000);
        let margin = Duration::from_micros(120);
        assert_eq!(Pacer::new(Pacing::Spin { margin }).wait(&spinning, at(1_000_000), &[]).unwrap(), Woken::Deadline);
        assert_eq!(*spinning.asked.borrow(), [880_000], "it sleeps once, until the margin");
        // Woken at 930,000, then in steps of 10 to the deadline.
        assert_eq!(spinning.now.get(), 1_000_000);
    }

    #[test]
    fn deadlines_are_absolute_so_lateness_does_not_add_up() {
        let clock = fake(0, 50_000);
        let pacer = Pacer::new(Pacing::Sleep);
        let late: Vec<u64> = (1..=100)
            .map(|tick| {
                pacer.wait(&clock, at(tick * 1_000_000), &[]).unwrap();
                clock.now.get() - tick * 1_000_000
            })
            .collect();
        assert_eq!(late, [50_000; 100]);
    }

    #[test]
    fn what_can_be_read_ends_the_wait_and_a_past_deadline_does_not_wait() {
        let clock = Fake { readable_at: Some(300_000), ..fake(0, 0) };
        assert_eq!(Pacer::default().wait(&clock, at(1_000_000), &[]).unwrap(), Woken::Readable);
        assert_eq!(Pacer::default().wait(&clock, None, &[]).unwrap(), Woken::Readable);
        assert_eq!(Pacer::default().wait(&clock, at(300_000), &[]).unwrap(), Woken::Deadline);
        assert_eq!(clock.asked.borrow().len(), 2);
    }

    #[test]
    fn a_clock_that_stands_still_is_not_waited_for_for_ever() {
        struct Still;
        impl Clock for Still {
            fn now(&self) -> Instant {
                Instant::ZERO
            }
            fn block(&self, _until: Option<Instant>, _readable: &[BorrowedFd<'_>]) -> io::Result<bool> {
                Ok(false)
            }
        }
        assert_eq!(Pacer::default().wait(&Still, at(1), &[]).unwrap(), Woken::Early);
    }
}
