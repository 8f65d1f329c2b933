//! The loop of all `cohaptic falcon` commands: one exchange with the device per millisecond, until the command's task ends the loop.
//!
//! The module takes an opened transport and a [`Task`], and knows nothing of arguments and answers.

use std::time::Duration;

use cohaptic_falcon::driver::{Driver, DriverConfig, DriverError, Setpoint, Statistics, Status};
use cohaptic_falcon::kinematics::Triple;
use cohaptic_units::Instant;

use super::reach::AnyTransport;
use crate::failure::Failure;
use crate::interrupt;

/// Time between the beginnings of two exchanges. USB allows at most one exchange per millisecond.
const PERIOD: Duration = Duration::from_millis(1);

/// Least lateness of a late turn. The serial chip delivers received bytes once per millisecond by a clock of its own, so that a smaller lateness is no fault.
const LATE: Duration = Duration::from_micros(100);

/// The work of a command on a device, called once per exchange.
pub(super) trait Task {
    /// Returns the force to put on the grip \[N\], or `None` to ask for no force. `at` is the time since the first exchange began.
    fn wants(&mut self, at: Duration, status: &Status) -> Option<Triple>;

    /// Reads the status after an exchange, and returns whether the loop goes on. `at` is the time since the first exchange began.
    fn look(&mut self, at: Duration, status: &Status) -> Result<Go, Failure>;
}

/// Answer of a task after an exchange.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Go {
    /// The loop continues.
    On,
    /// The task is complete, and the loop ends.
    Enough,
}

/// Reason for the end of the loop.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum End {
    /// The task is complete.
    Enough,
    /// The time limit has passed.
    Over,
    /// The user interrupted the command.
    Interrupted,
    /// An exchange failed, and the driver cannot continue.
    Failed(DriverError),
}

/// A driver, with the schedule of its exchanges and the statistics of late turns.
#[derive(Debug)]
pub(super) struct Bench {
    driver: Driver<AnyTransport>,
    /// Instant at which the driver was opened, from which all times are counted.
    begun: Instant,
    /// Instant at which the present turn was due.
    next: Instant,
    /// Number of turns that were late by more than [`LATE`].
    late: u64,
    /// Largest lateness of a turn.
    worst: Duration,
}

impl Bench {
    pub(super) fn open(way: AnyTransport, config: DriverConfig) -> Result<Self, DriverError> {
        let driver = Driver::open(way, config)?;
        let now = driver.now();
        Ok(Self { driver, begun: now, next: now, late: 0, worst: Duration::ZERO })
    }

    /// Exchanges packets until the task, the user, an error or the time limit `most` ends the loop. The driver is stopped afterwards in every case,
    /// an error of the task included, so that no force stays on the device.
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
            // The setpoint carries its instant, by which the driver's gate refuses a force that is too old.
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

    /// Waits until the next turn is due. A turn that took longer than the period postpones all later turns.
    fn pace(&mut self) {
        self.next = self.next.saturating_add(PERIOD);
        let now = self.driver.now();
        let late = now.saturating_duration_since(self.next);
        if late.is_zero() {
            // Sleeping to an absolute instant keeps the mean rate, because the time of an exchange does not add to the period.
            self.driver.sleep_until(self.next);
        } else {
            self.late += u64::from(late > LATE);
            self.worst = self.worst.max(late);
            // Turns are not made up for: exchanges in quick succession would not be faster, since USB limits their rate.
            self.next = now;
        }
    }

    /// Returns the time since the driver was opened, which is also the time since the first exchange began.
    pub(super) fn passed(&self) -> Duration {
        self.driver.now().saturating_duration_since(self.begun)
    }

    pub(super) const fn status(&self) -> &Status {
        self.driver.status()
    }

    pub(super) const fn statistics(&self) -> &Statistics {
        self.driver.statistics()
    }

    /// Returns the number of turns that were late by more than 0.1 ms, and the largest lateness of any turn.
    pub(super) const fn lateness(&self) -> (u64, Duration) {
        (self.late, self.worst)
    }
}
