//! Waiting for a deadline: the thread sleeps until shortly before the deadline and spins for the rest.

use std::io;
use std::os::fd::BorrowedFd;
use std::time::Duration;

use cohaptic_units::Instant;

use crate::Clock;

/// Way of waiting.
///
/// In both ways the thread asks the system to be woken before the deadline, earlier by a *margin*. The margin follows the lateness of recent wake-ups. After
/// the wake-up the thread watches the clock until the deadline, with the processor's pause instruction if there is one.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Pacing {
    /// The margin is the lateness, to a microsecond, that three of four wake-ups do not exceed, but at most 100 µs. Most deadlines are met to the microsecond,
    /// for some microseconds of processor time each. The first margin is zero.
    #[default]
    Sleep,
    /// The margin is the lateness that 98 of 100 wake-ups do not exceed. Deadlines are met to well below a microsecond unless another thread takes the core. A
    /// core is busy during the margin.
    Spin {
        /// Longest margin, and the margin of the first wake-up.
        margin: Duration,
    },
}

impl Pacing {
    /// Spins long enough for an ordinary machine, on which 99 % of the wake-ups are less than 100 µs late.
    pub const SPIN: Self = Self::Spin { margin: Duration::from_micros(120) };

    /// Returns the longest margin.
    const fn most(self) -> Duration {
        match self {
            Self::Sleep => Duration::from_micros(100),
            Self::Spin { margin } => margin,
        }
    }

    /// Returns the margin before the first wake-up, and the number of imagined wake-ups later than every step. The imagined wake-up of `Spin` keeps the margin
    /// at its longest until enough real wake-ups outweigh it.
    const fn first(self) -> (Duration, u32) {
        match self {
            Self::Sleep => (Duration::ZERO, 0),
            Self::Spin { margin } => (margin, 1),
        }
    }

    /// Returns the share of wake-ups, in percent, whose lateness the margin covers.
    const fn percent(self) -> u32 {
        match self {
            Self::Sleep => 75,
            Self::Spin { .. } => 98,
        }
    }
}

/// Reason why a wait ended.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Woken {
    /// The deadline has come. A file descriptor may be readable, too.
    Deadline,
    /// A file descriptor is readable before the deadline.
    Readable,
    /// A signal interrupted the wait before the deadline, and nothing is readable. The caller decides whether to go on.
    Early,
}

/// Waits for absolute deadlines, so that lateness at one deadline does not move the next.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Pacer {
    pacing: Pacing,
    /// Lateness of recent wake-ups.
    wake_ups: WakeUps,
    /// Present margin, computed from `wake_ups`.
    margin: Duration,
}

impl Default for Pacer {
    fn default() -> Self {
        Self::new(Pacing::default())
    }
}

impl Pacer {
    /// Returns a pacer without knowledge of the machine.
    #[must_use]
    pub const fn new(pacing: Pacing) -> Self {
        let (margin, later) = pacing.first();
        Self { pacing, wake_ups: WakeUps { counts: [0; WakeUps::STEPS], count: later }, margin }
    }

    /// Returns the present margin: see [`Pacing`]. The margin changes with each wake-up, and depends only on the lateness of wake-ups so far.
    #[must_use]
    pub const fn margin(&self) -> Duration {
        self.margin
    }

    /// Waits until the deadline (`None`: for ever) has come, or until one of `readable` can be read. Returns [`Woken::Deadline`] at once if the deadline has
    /// passed. `readable` is not watched during the [`Pacer::margin`].
    ///
    /// # Errors
    ///
    /// The error of the system.
    pub fn wait(&mut self, clock: &impl Clock, deadline: Option<Instant>, readable: &[BorrowedFd<'_>]) -> io::Result<Woken> {
        let woken = self.approach(clock, deadline, readable)?;
        if let (Woken::Deadline, Some(deadline)) = (woken, deadline) {
            while clock.now() < deadline {
                std::hint::spin_loop();
            }
        }
        Ok(woken)
    }

    /// Waits like [`wait`](Self::wait), but returns [`Woken::Deadline`] as soon as the deadline is no further away than the [`Pacer::margin`]. The caller
    /// watches the clock for the rest, and can make ready what happens at the deadline.
    ///
    /// # Errors
    ///
    /// The error of the system.
    pub(crate) fn approach(&mut self, clock: &impl Clock, deadline: Option<Instant>, readable: &[BorrowedFd<'_>]) -> io::Result<Woken> {
        let Some(deadline) = deadline else {
            return Ok(if clock.block(None, readable)? { Woken::Readable } else { Woken::Early });
        };
        // An instant before the start of the run becomes the start.
        let asleep_until = Instant::ZERO + deadline.saturating_duration_since(Instant::ZERO).saturating_sub(self.margin());
        let mut now = clock.now();
        while now < asleep_until {
            if clock.block(Some(asleep_until), readable)? {
                return Ok(Woken::Readable);
            }
            let woken = clock.now();
            if woken == now {
                // The clock did not move during the wait. Either a signal interrupted the wait at once, or the clock belongs to a test that moves the clock
                // itself.
                return Ok(Woken::Early);
            }
            now = woken;
            // A wait can end early, such as at the end of a piece; only a wake-up at the asked time tells about the machine.
            if now >= asleep_until {
                self.learn(now.saturating_duration_since(asleep_until));
            }
        }
        Ok(Woken::Deadline)
    }

    /// Counts a wake-up that was late by `late`, and computes the margin anew.
    fn learn(&mut self, late: Duration) {
        self.wake_ups.note(late);
        // Without a bound within the histogram, even the longest margin covers too few wake-ups; the margin is then the longest.
        let most = self.pacing.most();
        self.margin = self.wake_ups.bound(self.pacing.percent()).map_or(most, |bound| bound.min(most));
    }
}

/// Histogram of the lateness of wake-ups in steps of a microsecond. Old wake-ups lose weight: all counts are halved after about every thousand wake-ups.
#[derive(Clone, PartialEq, Eq, Debug)]
struct WakeUps {
    /// Wake-ups by lateness in microseconds, rounded down.
    counts: [u32; Self::STEPS],
    /// Number of all wake-ups, including those later than the last step.
    count: u32,
}

impl WakeUps {
    /// Width of a step.
    const STEP: Duration = Duration::from_micros(1);
    /// Number of steps: a little more than the longest usual margin.
    const STEPS: usize = 128;
    /// Count at which all counts are halved.
    const MOST: u32 = 1 << 11;

    fn note(&mut self, late: Duration) {
        let step = late.as_nanos() / Self::STEP.as_nanos();
        if let Some(count) = usize::try_from(step).ok().and_then(|step| self.counts.get_mut(step)) {
            *count += 1;
        }
        self.count += 1;
        if self.count >= Self::MOST {
            // Wake-ups later than the last step have no own count: their number is the difference to the sum.
            let later = self.count - self.counts.iter().sum::<u32>();
            self.counts.iter_mut().for_each(|count| *count /= 2);
            self.count = later / 2 + self.counts.iter().sum::<u32>();
        }
    }

    /// Returns the lateness, rounded down to a step, that `percent` of the wake-ups do not exceed, or `None` if it is beyond the last step.
    fn bound(&self, percent: u32) -> Option<Duration> {
        let wanted = (self.count * percent).div_ceil(100);
        let mut found = 0;
        // The first step at which the sum of counts reaches the share.
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

    /// Artificial clock that moves by a step at each reading, wakes late, and logs the ends of the waits asked for.
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
            // The wake-up is 50 µs late. Then the clock moves by 10 ns with each reading, until the deadline if it has not passed yet.
            assert_eq!(clock.now.get(), 1_000_000.max(asleep_until + 50_020));
        }
    }

    /// Returns the lateness of each tick \[ns\] and the margin at the end \[µs\]. Wake-up number n is late by `late(n)` \[ns\].
    fn lateness(pacing: Pacing, ticks: u64, late: impl Fn(u64) -> u64) -> (Vec<u64>, u128) {
        let (mut pacer, clock) = (Pacer::new(pacing), fake(10, 0));
        let tick = |tick: u64| {
            clock.late.set(late(tick));
            assert_eq!(pacer.wait(&clock, at(tick * 10_000_000), &[]).unwrap(), Woken::Deadline);
            clock.now.get() - tick * 10_000_000
        };
        ((1..=ticks).map(tick).collect(), pacer.margin().as_micros())
    }

    /// Returns the lateness of a wake-up \[ns\]. Of 100 wake-ups one is 0.5 µs late, one 1.5 µs, and so on up to 99.5 µs, in a mixed order.
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
        // Ten of 100 are too many for a margin that must cover 98, so the longest margin is chosen.
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
