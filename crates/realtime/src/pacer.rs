//! Waiting for a deadline: sleep, and if asked spin the last of it.

use std::io;
use std::os::fd::BorrowedFd;
use std::time::Duration;

use cohaptic_units::Instant;

use crate::Clock;

/// How to wait.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Pacing {
    /// Leave the processor until the system wakes the thread, which it is asked for as much before the deadline as it is usually late. When it is earlier
    /// than usual, look at the clock for the rest: half of all deadlines are met to the microsecond, for some microseconds of processor time each.
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
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Pacer {
    pacing: Pacing,
    usual: UsualLateness,
}

impl Pacer {
    /// A pacer that waits like that.
    #[must_use]
    pub const fn new(pacing: Pacing) -> Self {
        Self { pacing, usual: UsualLateness { nanos: 0 } }
    }

    /// How it waits.
    #[must_use]
    pub const fn pacing(&self) -> Pacing {
        self.pacing
    }

    /// So long before a deadline the thread is to be awake: the margin of [`Pacing::Spin`]; sleeping, what its wake-ups were usually late so far.
    #[must_use]
    pub const fn margin(&self) -> Duration {
        match self.pacing {
            Pacing::Sleep => Duration::from_nanos(self.usual.nanos),
            Pacing::Spin { margin } => margin,
        }
    }

    /// Waits until the deadline (`None`: for ever) has come, or until one of `readable` can be read. A deadline that has passed is [`Woken::Deadline`] at
    /// once. During the [`Pacer::margin`] it does not look at `readable`.
    ///
    /// # Errors
    ///
    /// What the system says of the wait.
    #[inline]
    pub fn wait(&mut self, clock: &impl Clock, deadline: Option<Instant>, readable: &[BorrowedFd<'_>]) -> io::Result<Woken> {
        let woken = self.approach(clock, deadline, readable)?;
        if let (Woken::Deadline, Some(deadline)) = (woken, deadline) {
            while clock.now() < deadline {
                std::hint::spin_loop();
            }
        }
        Ok(woken)
    }

    /// Waits like [`wait`](Self::wait), but comes back with [`Woken::Deadline`] as soon as the deadline is no further away than the [`Pacer::margin`]. The rest is the
    /// caller's, to look at the clock, and to make ready what happens at the deadline.
    ///
    /// # Errors
    ///
    /// What the system says of the wait.
    #[inline]
    pub fn approach(&mut self, clock: &impl Clock, deadline: Option<Instant>, readable: &[BorrowedFd<'_>]) -> io::Result<Woken> {
        let Some(deadline) = deadline else {
            return Ok(if clock.block(None, readable)? { Woken::Readable } else { Woken::Early });
        };
        let asleep_until = Instant::ZERO + deadline.saturating_duration_since(Instant::ZERO).saturating_sub(self.margin());
        let mut now = clock.now();
        while now < asleep_until {
            if clock.block(Some(asleep_until), readable)? {
                return Ok(Woken::Readable);
            }
            let woken = clock.now();
            if woken == now {
                // A clock that does not move while it waits has been interrupted at once, or belongs to a test that wants to be asked.
                return Ok(Woken::Early);
            }
            now = woken;
            if now >= asleep_until {
                self.usual.note(now.saturating_duration_since(asleep_until));
            }
        }
        Ok(Woken::Deadline)
    }
}

/// The running median of how late the system wakes the thread.
///
/// It rises by a step with each wake-up that is later and falls with each that is not, so that it stays where half of them are later. A wake-up that is late by
/// milliseconds, because something else ran, moves it by no more than any other.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
struct UsualLateness {
    nanos: u64,
}

impl UsualLateness {
    const STEP: u64 = 500;
    /// The longest span for which the clock is looked at, whatever the system does.
    const MOST: u64 = 100_000;

    #[inline]
    fn note(&mut self, late: Duration) {
        let is_later = late > Duration::from_nanos(self.nanos);
        self.nanos = if is_later { (self.nanos + Self::STEP).min(Self::MOST) } else { self.nanos.saturating_sub(Self::STEP) };
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
        late: Cell<u64>,
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
            self.now.set(until + self.late.get());
            Ok(false)
        }
    }

    fn fake(step: u64, late: u64) -> Fake {
        Fake { now: Cell::new(0), step, late: Cell::new(late), readable_at: None, asked: RefCell::new(Vec::new()) }
    }

    fn at(nanos: u64) -> Option<Instant> {
        Some(Instant::from_nanos(nanos))
    }

    #[test]
    fn sleeping_wakes_as_late_as_the_system_does_and_spinning_does_not() {
        let (sleeping, spinning) = (fake(0, 50_000), fake(10, 50_000));
        assert_eq!(Pacer::new(Pacing::Sleep).wait(&sleeping, at(1_000_000), &[]).unwrap(), Woken::Deadline);
        assert_eq!(sleeping.now.get(), 1_050_000, "of the first wake-up nothing is known yet");
        let margin = Duration::from_micros(120);
        assert_eq!(Pacer::new(Pacing::Spin { margin }).wait(&spinning, at(1_000_000), &[]).unwrap(), Woken::Deadline);
        assert_eq!(*spinning.asked.borrow(), [880_000], "it sleeps once, until the margin");
        // Woken at 930,000, then in steps of 10 to the deadline.
        assert_eq!(spinning.now.get(), 1_000_000);
    }

    /// How late the ticks of a pacer that sleeps are on a clock whose wake-ups are that late \[ns\].
    fn lateness(ticks: u64, clock: &Fake, late: impl Fn(u64) -> u64) -> Vec<u64> {
        let mut pacer = Pacer::new(Pacing::Sleep);
        let tick = |tick: u64| {
            clock.late.set(late(tick));
            assert_eq!(pacer.wait(clock, at(tick * 1_000_000), &[]).unwrap(), Woken::Deadline);
            clock.now.get() - tick * 1_000_000
        };
        (1..=ticks).map(tick).collect()
    }

    #[test]
    fn deadlines_are_absolute_so_lateness_does_not_add_up() {
        // It never falls behind, and learns by 500 ns a tick to be woken as much earlier as it is late.
        let found = lateness(100, &fake(0, 0), |_| 50_000);
        let wanted: Vec<u64> = (0..100).map(|tick| 50_000 - 500 * tick).collect();
        assert_eq!(found, wanted);
    }

    #[test]
    fn it_is_never_early_and_is_on_time_when_woken_as_late_as_usual_or_earlier() {
        // Wake-ups 40 or 60 µs late in turns, and every 50th by 3 ms.
        let late = |tick: u64| if tick.is_multiple_of(50) { 3_000_000 } else { 40_000 + 20_000 * (tick % 2) };
        let clock = fake(10, 0);
        let found = lateness(2000, &clock, late);
        let learned = &found[1000..];
        assert!(learned.iter().filter(|late| **late <= 10).count() >= 480, "the earlier half is on time");
        let latest = learned.iter().filter(|late| **late < 500_000).max().unwrap();
        assert!(*latest <= 20_500, "the others are later by what they differ, and a step: {latest}");
    }

    #[test]
    fn what_is_looked_at_the_clock_for_has_a_bound() {
        let mut pacer = Pacer::new(Pacing::Sleep);
        let clock = fake(10, 900_000);
        (1..=1000).for_each(|tick| assert_eq!(pacer.wait(&clock, at(tick * 1_000_000), &[]).unwrap(), Woken::Deadline));
        assert_eq!(pacer.margin(), Duration::from_micros(100));
    }

    #[test]
    fn an_approach_leaves_the_margin_to_the_caller() {
        let clock = fake(0, 20_000);
        let mut pacer = Pacer::new(Pacing::Spin { margin: Duration::from_micros(120) });
        assert_eq!(pacer.approach(&clock, at(1_000_000), &[]).unwrap(), Woken::Deadline);
        assert_eq!(clock.now.get(), 900_000);
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
