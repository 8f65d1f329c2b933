//! Waiting for a deadline: sleep until shortly before it, and spin the last of it.

use std::io;
use std::os::fd::BorrowedFd;
use std::time::Duration;

use cohaptic_units::Instant;

use crate::Clock;

/// How to wait.
///
/// Either way the system is asked for the thread before the deadline, by a *margin* that follows how late it woke the thread of late. The rest of the margin is waited
/// out with the clock in view and the processor's pause instruction, where it has one.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Pacing {
    /// As early as three of four wake-ups were late at most, to a microsecond, and never more than 100 µs: most deadlines are met to the microsecond, for some
    /// microseconds of processor time each. The first margin is zero.
    #[default]
    Sleep,
    /// As early as 98 of 100 wake-ups were late at most: well below a microsecond late as long as the thread is not moved aside, for a core that is busy during the
    /// margin.
    Spin {
        /// The longest margin, which is that of the first wake-ups.
        margin: Duration,
    },
}

impl Pacing {
    /// Spins long enough for an ordinary machine: 99 % of its wake-ups are less than 100 µs late.
    pub const SPIN: Self = Self::Spin { margin: Duration::from_micros(120) };

    /// The longest margin.
    const fn most(self) -> Duration {
        match self {
            Self::Sleep => Duration::from_micros(100),
            Self::Spin { margin } => margin,
        }
    }

    /// The margin while nothing is known, and the number of wake-ups that are thought to have been later than any that is counted.
    const fn first(self) -> (Duration, u32) {
        match self {
            Self::Sleep => (Duration::ZERO, 0),
            Self::Spin { margin } => (margin, 1),
        }
    }

    /// Of 100 wake-ups, how many are to be within the margin.
    const fn percent(self) -> u32 {
        match self {
            Self::Sleep => 75,
            Self::Spin { .. } => 98,
        }
    }
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
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Pacer {
    pacing: Pacing,
    wake_ups: WakeUps,
    margin: Duration,
}

impl Default for Pacer {
    fn default() -> Self {
        Self::new(Pacing::default())
    }
}

impl Pacer {
    /// A pacer that waits like that.
    #[must_use]
    pub const fn new(pacing: Pacing) -> Self {
        let (margin, later) = pacing.first();
        Self { pacing, wake_ups: WakeUps { counts: [0; WakeUps::STEPS], count: later }, margin }
    }

    /// How it waits.
    #[must_use]
    pub const fn pacing(&self) -> Pacing {
        self.pacing
    }

    /// So long before a deadline the thread is to be awake: see [`Pacing`]. It changes with each wake-up, and depends on nothing but how late those so far were.
    #[must_use]
    pub const fn margin(&self) -> Duration {
        self.margin
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
    pub(crate) fn approach(&mut self, clock: &impl Clock, deadline: Option<Instant>, readable: &[BorrowedFd<'_>]) -> io::Result<Woken> {
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
                self.learn(now.saturating_duration_since(asleep_until));
            }
        }
        Ok(Woken::Deadline)
    }

    /// The system woke the thread that late.
    #[inline]
    fn learn(&mut self, late: Duration) {
        self.wake_ups.note(late);
        let most = self.pacing.most();
        self.margin = self.wake_ups.bound(self.pacing.percent()).map_or(most, |bound| bound.min(most));
    }
}

/// How late the system woke the thread: a histogram in steps of a microsecond, in which a wake-up counts half as much after every thousand or so.
#[derive(Clone, PartialEq, Eq, Debug)]
struct WakeUps {
    counts: [u32; Self::STEPS],
    /// Of all, those later than the last step among them.
    count: u32,
}

impl WakeUps {
    const STEP: Duration = Duration::from_micros(1);
    const STEPS: usize = 128;
    /// At this count all counts are halved.
    const MOST: u32 = 1 << 11;

    #[inline]
    fn note(&mut self, late: Duration) {
        let step = late.as_nanos() / Self::STEP.as_nanos();
        if let Some(count) = usize::try_from(step).ok().and_then(|step| self.counts.get_mut(step)) {
            *count += 1;
        }
        self.count += 1;
        if self.count >= Self::MOST {
            let later = self.count - self.counts.iter().sum::<u32>();
            self.counts.iter_mut().for_each(|count| *count /= 2);
            self.count = later / 2 + self.counts.iter().sum::<u32>();
        }
    }

    /// That percentage of them were this late at most, to a step; `None` if that is beyond the last step.
    #[inline]
    fn bound(&self, percent: u32) -> Option<Duration> {
        let wanted = (self.count * percent).div_ceil(100);
        let mut found = 0;
        let step = (0..).zip(&self.counts).find_map(|(step, count)| {
            found += count;
            (found >= wanted).then_some(step)
        });
        step.map(|step| Self::STEP * step)
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
    fn the_first_deadline_is_slept_through_or_approached_as_early_as_allowed() {
        for (pacing, asleep_until) in [(Pacing::Sleep, 1_000_000), (Pacing::SPIN, 880_000), (Pacing::Spin { margin: Duration::ZERO }, 1_000_000)] {
            let clock = fake(10, 50_000);
            assert_eq!(Pacer::new(pacing).wait(&clock, at(1_000_000), &[]).unwrap(), Woken::Deadline);
            assert_eq!(*clock.asked.borrow(), [asleep_until], "it sleeps once");
            // Woken 50 µs later, then in steps of 10 ns, one for each look, to the deadline if that has not passed.
            assert_eq!(clock.now.get(), 1_000_000.max(asleep_until + 50_020));
        }
    }

    /// How late the ticks of a pacer are on a clock whose wake-ups are that late \[ns\], and what its margin is at the end \[µs\].
    fn lateness(pacing: Pacing, ticks: u64, late: impl Fn(u64) -> u64) -> (Vec<u64>, u128) {
        let (mut pacer, clock) = (Pacer::new(pacing), fake(10, 0));
        let tick = |tick: u64| {
            clock.late.set(late(tick));
            assert_eq!(pacer.wait(&clock, at(tick * 10_000_000), &[]).unwrap(), Woken::Deadline);
            clock.now.get() - tick * 10_000_000
        };
        ((1..=ticks).map(tick).collect(), pacer.margin().as_micros())
    }

    /// Of 100 wake-ups one is 0.5 µs late, one 1.5 µs, and so on up to 99.5 µs, in an order that mixes them.
    fn evenly(tick: u64) -> u64 {
        (tick * 37 % 100) * 1000 + 500
    }

    #[test]
    fn the_margin_is_the_quantile_of_how_late_wake_ups_were() {
        assert_eq!(lateness(Pacing::Sleep, 1000, evenly).1, 74);
        assert_eq!(lateness(Pacing::SPIN, 1000, evenly).1, 98);
        let (found, _) = lateness(Pacing::Sleep, 3000, evenly);
        let learned = &found[1000..];
        assert!(learned.iter().filter(|late| **late <= 1000).count() >= 1490, "three of four are on time to a microsecond");
        assert!(learned.iter().all(|late| *late <= 26_000), "the others are late by what they differ");
    }

    #[test]
    fn rare_wake_ups_that_are_late_by_milliseconds_do_not_move_it() {
        let with_outliers = |tick: u64| if tick.is_multiple_of(10) { 3_000_000 } else { 40_500 };
        assert_eq!(lateness(Pacing::Sleep, 1000, with_outliers).1, 40);
        // Among 100 there are too many of them for one that is to have 98 in time: then it does what it may.
        assert_eq!(lateness(Pacing::SPIN, 1000, with_outliers).1, 120);
    }

    #[test]
    fn it_follows_a_system_that_becomes_slower_or_faster() {
        let changes = |before: u64, after: u64| move |tick: u64| if tick < 5000 { before } else { after };
        for (before, after) in [(20_500, 70_500), (70_500, 20_500)] {
            assert_eq!(lateness(Pacing::Sleep, 4999, changes(before, after)).1, u128::from(before / 1000));
            assert_eq!(lateness(Pacing::Sleep, 9000, changes(before, after)).1, u128::from(after / 1000));
        }
    }

    #[test]
    fn deadlines_are_absolute_so_lateness_does_not_add_up() {
        let (found, margin) = lateness(Pacing::Sleep, 100, |_| 900_000);
        assert_eq!(margin, 100, "what is looked at the clock for has a bound");
        assert_eq!(found[0], 900_020);
        assert!(found[1..].iter().all(|late| *late == 800_020), "{found:?}");
    }

    #[test]
    fn the_same_lateness_gives_the_same_margins() {
        assert_eq!(lateness(Pacing::Sleep, 2500, evenly), lateness(Pacing::Sleep, 2500, evenly));
        assert_ne!(lateness(Pacing::Sleep, 2500, evenly), lateness(Pacing::Sleep, 2500, |tick| evenly(tick + 1)));
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
        assert_eq!(Pacer::default().wait(&Still, at(1_000_000), &[]).unwrap(), Woken::Early);
    }
}
