//! The clock of a run: nanoseconds since the run began, waiting for an instant, and the conversion of the kernel's time stamps.

use std::io;
use std::os::fd::BorrowedFd;
use std::time::Duration;

use cohaptic_units::Instant;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::thread::clock_nanosleep_absolute;
use rustix::time::{ClockId, clock_gettime};

/// Source of the time of a run, with a way to wait. The wall clock is [`MonotonicClock`]; tests have clocks of their own.
pub trait Clock {
    /// Returns the time since the run began.
    fn now(&self) -> Instant;

    /// Blocks until `until` (`None`: for ever), or until a descriptor of `readable` can be read. Returns whether a descriptor can be read. Can return early.
    ///
    /// # Errors
    ///
    /// The error of the system. Interruption by a signal is no error, but an early return.
    fn block(&self, until: Option<Instant>, readable: &[BorrowedFd<'_>]) -> io::Result<bool>;
}

/// `CLOCK_MONOTONIC`, counted from the start of the run. Setting the time of day does not move this clock.
#[derive(Clone, Copy, Debug)]
pub struct MonotonicClock {
    /// Reading of `CLOCK_MONOTONIC` at [`Instant::ZERO`] \[ns\].
    origin: u64,
}

/// Last piece of a long wait for sockets. A wait of more than twice this length is cut into two, because the kernel adds a slack of 0.1 % of the time-out to a
/// wait of `ppoll` (`select_estimate_accuracy`): 24 µs for a delay of 24 ms, but at most a microsecond for the last piece.
const LAST_PIECE: Duration = Duration::from_millis(1);

impl MonotonicClock {
    /// Returns a clock that shows zero now.
    #[must_use]
    pub fn start() -> Self {
        Self { origin: nanos(clock_gettime(ClockId::Monotonic)) }
    }

    /// Reads the clock of the run and the time of day together, for the conversion of the kernel's time stamps.
    #[must_use]
    pub fn stamps(&self) -> KernelStamps {
        let unix = clock_gettime(ClockId::Realtime);
        KernelStamps { now: self.now(), unix: Duration::from_nanos(nanos(unix)) }
    }
}

impl Clock for MonotonicClock {
    fn now(&self) -> Instant {
        Instant::from_nanos(nanos(clock_gettime(ClockId::Monotonic)) - self.origin)
    }

    fn block(&self, until: Option<Instant>, readable: &[BorrowedFd<'_>]) -> io::Result<bool> {
        match until {
            Some(until) if readable.is_empty() => {
                // The wait is absolute: time that passes between reading the clock and this call does not lengthen the wait.
                let at = self.origin.saturating_add(until.as_nanos());
                match clock_nanosleep_absolute(ClockId::Monotonic, &timespec(Duration::from_nanos(at))) {
                    Ok(()) | Err(Errno::INTR) => Ok(false),
                    Err(error) => Err(error.into()),
                }
            }
            until => {
                // `ppoll` waits for a span, not until an instant. The caller of a cut wait sees an early return and waits again.
                let timeout = until.map(|until| piece(until.saturating_duration_since(self.now())));
                let mut waited: Vec<PollFd<'_>> = readable.iter().map(|fd| PollFd::from_borrowed_fd(*fd, PollFlags::IN)).collect();
                match poll(&mut waited, timeout.map(timespec).as_ref()) {
                    Ok(ready) => Ok(ready > 0),
                    Err(Errno::INTR) => Ok(false),
                    Err(error) => Err(error.into()),
                }
            }
        }
    }
}

/// Returns the length of the next piece of a wait of length `span`.
fn piece(span: Duration) -> Duration {
    if span > LAST_PIECE * 2 { span - LAST_PIECE } else { span }
}

/// Readings of the clock of the run and of the time of day at the same moment.
///
/// The kernel stamps each arriving datagram with the time of day. The difference between the two readings converts the stamp to an instant of the run,
/// independent of when the program reads the datagram.
#[derive(Clone, Copy, Debug)]
pub struct KernelStamps {
    /// Reading of the clock of the run.
    now: Instant,
    /// Reading of the time of day, since 1970-01-01.
    unix: Duration,
}

/// Age up to which a stamp is believed. An older stamp means that the time of day was set in between.
const OLDEST: Duration = Duration::from_secs(1);

impl KernelStamps {
    /// Returns the instant of the run at which the time of day was `stamp`. Returns the present instant if `stamp` is `None`, lies in the future, or is more
    /// than a second old; the last two happen when the time of day is set.
    #[must_use]
    pub fn instant(&self, stamp: Option<Duration>) -> Instant {
        let age = stamp.and_then(|stamp| self.unix.checked_sub(stamp)).filter(|age| *age <= OLDEST);
        match age {
            None => self.now,
            Some(age) => Instant::ZERO + self.now.saturating_duration_since(Instant::ZERO).saturating_sub(age),
        }
    }

    /// Returns the instant at which both clocks were read.
    #[must_use]
    pub const fn now(&self) -> Instant {
        self.now
    }
}

/// Keeps the arrival instants of one socket in the order of the datagrams.
#[derive(Debug)]
pub(crate) struct ArrivalOrder {
    /// Latest instant given so far.
    latest: Instant,
}

impl ArrivalOrder {
    /// State before the first datagram.
    pub(crate) const NEW: Self = Self { latest: Instant::ZERO };

    /// Corrects the instants of the next datagrams of a socket, given in the order of arrival. Afterwards no instant is later than the instant of a following
    /// datagram in `arrivals`, and none is earlier than the last instant of the previous call.
    pub(crate) fn put_in_order(&mut self, arrivals: &mut [Instant]) {
        let Some(last) = arrivals.last().copied() else { return };
        let (mut earliest_behind, before) = (last, self.latest);
        self.latest = last.max(before);
        // From the last to the first: an instant that is too late is lowered to the earliest instant among the datagrams after it.
        for arrival in arrivals.iter_mut().rev() {
            earliest_behind = earliest_behind.min(*arrival);
            *arrival = earliest_behind.max(before);
        }
    }
}

/// Converts a reading of a clock to nanoseconds.
fn nanos(time: Timespec) -> u64 {
    // Neither clock is negative, and 64 bits hold 584 years of nanoseconds.
    let (seconds, nanos) = (u64::try_from(time.tv_sec).unwrap_or(0), u64::try_from(time.tv_nsec).unwrap_or(0));
    seconds.saturating_mul(1_000_000_000).saturating_add(nanos)
}

/// Converts a span for the kernel. A span beyond the range of the kernel becomes the longest one.
fn timespec(span: Duration) -> Timespec {
    Timespec { tv_sec: i64::try_from(span.as_secs()).unwrap_or(i64::MAX), tv_nsec: i64::from(span.subsec_nanos()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stamp_is_placed_by_the_difference_of_the_clocks() {
        let stamps = KernelStamps { now: Instant::from_nanos(5_000_000), unix: Duration::from_secs(1_700_000_000) };
        let back = |span: Duration| stamps.instant(Some(stamps.unix - span));
        assert_eq!(back(Duration::ZERO), stamps.now);
        assert_eq!(back(Duration::from_micros(300)), Instant::from_nanos(4_700_000));
        // The datagram waited in the socket before the run began, so it counts from the beginning of the run.
        assert_eq!(back(Duration::from_millis(6)), Instant::ZERO);
        // The time of day was set between stamp and reading.
        assert_eq!(back(Duration::from_secs(2)), stamps.now);
        assert_eq!(stamps.instant(Some(stamps.unix + Duration::from_nanos(1))), stamps.now);
        assert_eq!(stamps.instant(None), stamps.now);
    }

    #[test]
    fn an_instant_is_no_later_than_those_behind_it_and_no_earlier_than_the_last_of_the_batch_before() {
        let mut order = ArrivalOrder::NEW;
        let mut ordered = |given: &[u64]| {
            let mut instants: Vec<Instant> = given.iter().copied().map(Instant::from_nanos).collect();
            order.put_in_order(&mut instants);
            instants.into_iter().map(Instant::as_nanos).collect::<Vec<u64>>()
        };
        assert_eq!(ordered(&[3, 5, 5, 9]), [3, 5, 5, 9]);
        // The first two were stamped when they were read, at 20, before the kernel stamped the other two at 10 and 12.
        assert_eq!(ordered(&[20, 20, 10, 12]), [10, 10, 10, 12]);
        // The whole batch was stamped when it was read. The datagrams of the following batches had arrived by then.
        assert_eq!(ordered(&[25, 25]), [25, 25]);
        assert_eq!(ordered(&[]), []);
        assert_eq!(ordered(&[22, 24, 26]), [25, 25, 26]);
        assert_eq!(ordered(&[27, 21, 23]), [26, 26, 26]);
        assert_eq!(ordered(&[24, 28]), [26, 28]);
    }

    #[test]
    fn a_long_wait_with_sockets_is_cut_so_that_its_last_piece_is_short() {
        let mut left = Duration::from_millis(24);
        let mut pieces = Vec::new();
        while !left.is_zero() {
            pieces.push(piece(left));
            left -= piece(left);
        }
        assert_eq!(pieces, [Duration::from_millis(23), LAST_PIECE]);
    }
}
