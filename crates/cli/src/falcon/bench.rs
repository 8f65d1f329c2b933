//! One exchange a millisecond, until somebody has seen enough.

use std::time::Duration;

use cohaptic_falcon::driver::{Driver, DriverConfig, DriverError, Setpoint, Statistics, Status};
use cohaptic_falcon::kinematics::Triple;
use cohaptic_units::Instant;

use super::reach::AnyTransport;
use crate::failure::Failure;
use crate::interrupt;

/// From one exchange to the next: USB gives no more than one in a millisecond.
const PERIOD: Duration = Duration::from_millis(1);

/// A turn that is later than this is counted. The serial chip hands over what has come once a millisecond, by its own clock: somewhat less is no fault.
const LATE: Duration = Duration::from_micros(100);

/// The work on a device.
pub(super) trait Task {
    /// The force on the grip \[N\] that is wanted at `at`, counted from the first exchange; `None` wants none.
    fn wants(&mut self, at: Duration, status: &Status) -> Option<Triple>;

    /// Looks at what came of the exchange that ended at `at`, and says whether to go on.
    fn look(&mut self, at: Duration, status: &Status) -> Result<Go, Failure>;
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Go {
    On,
    Enough,
}

/// Why exchanges ended.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum End {
    /// The task has seen enough.
    Enough,
    /// The time is over.
    Over,
    /// The user asked for it.
    Interrupted,
    /// The driver could not go on.
    Failed(DriverError),
}

/// A driver and how well its loop keeps its time.
#[derive(Debug)]
pub(super) struct Bench {
    driver: Driver<AnyTransport>,
    begun: Instant,
    next: Instant,
    late: u64,
    worst: Duration,
}

impl Bench {
    pub(super) fn open(way: AnyTransport, config: DriverConfig) -> Result<Self, DriverError> {
        let driver = Driver::open(way, config)?;
        let now = driver.now();
        Ok(Self { driver, begun: now, next: now, late: 0, worst: Duration::ZERO })
    }

    /// Exchanges packets; `most` is how long at most. Force is off for good afterwards, whatever happened.
    pub(super) fn run(&mut self, most: Option<Duration>, task: &mut impl Task) -> Result<End, Failure> {
        // Readings of the device are a result, and the loop looks for a signal before each exchange.
        interrupt::has_results();
        let end = self.exchanges(most, task);
        self.driver.stop();
        end
    }

    fn exchanges(&mut self, most: Option<Duration>, task: &mut impl Task) -> Result<End, Failure> {
        loop {
            let now = self.driver.now();
            if interrupt::requested() {
                return Ok(End::Interrupted);
            }
            if most.is_some_and(|most| self.passed() >= most) {
                return Ok(End::Over);
            }
            let wanted = task.wants(self.passed(), self.driver.status()).map(|force| Setpoint { force, at: now });
            if let Err(error) = self.driver.exchange(wanted) {
                return Ok(End::Failed(error));
            }
            if task.look(self.passed(), self.driver.status())? == Go::Enough {
                return Ok(End::Enough);
            }
            self.pace();
        }
    }

    /// Waits for the next turn; a turn that took too long moves all that follow.
    fn pace(&mut self) {
        self.next = self.next.saturating_add(PERIOD);
        let now = self.driver.now();
        let late = now.saturating_duration_since(self.next);
        if late.is_zero() {
            self.driver.sleep_until(self.next);
        } else {
            self.late += u64::from(late > LATE);
            self.worst = self.worst.max(late);
            self.next = now;
        }
    }

    /// Since the first exchange.
    pub(super) fn passed(&self) -> Duration {
        self.driver.now().saturating_duration_since(self.begun)
    }

    pub(super) const fn status(&self) -> &Status {
        self.driver.status()
    }

    pub(super) const fn statistics(&self) -> &Statistics {
        self.driver.statistics()
    }

    /// Turns that ended a tenth of a millisecond or more after the next should have begun, and the longest that one was late.
    pub(super) const fn lateness(&self) -> (u64, Duration) {
        (self.late, self.worst)
    }
}
