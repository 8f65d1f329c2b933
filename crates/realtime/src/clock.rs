//! The clock: nanoseconds since the run began, and a way to wait for them.

use std::io;
use std::os::fd::BorrowedFd;
use std::time::Duration;

use cohaptic_units::Instant;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::thread::clock_nanosleep_absolute;
use rustix::time::{ClockId, clock_gettime};

/// Tells the time of a run and waits for it. The wall clock is [`MonotonicClock`]; a test has one of its own.
pub trait Clock {
    /// The time since the run began.
    fn now(&self) -> Instant;

    /// Blocks until `until` (`None`: for ever), or until one of `readable` can be read, and says whether one can. It may come back early.
    ///
    /// # Errors
    ///
    /// What the system says, but for interruption by a signal, which is coming back early.
    fn block(&self, until: Option<Instant>, readable: &[BorrowedFd<'_>]) -> io::Result<bool>;
}

/// `CLOCK_MONOTONIC`, counted from the start of the run. No step of the time of day moves it.
#[derive(Clone, Copy, Debug)]
pub struct MonotonicClock {
    /// `CLOCK_MONOTONIC` at [`Instant::ZERO`] \[ns\].
    origin: u64,
}

/// A wait with sockets that is longer than this is cut in two. The kernel adds a slack of a thousandth of the time-out to the waits of `ppoll` (0.1 %,
/// `select_estimate_accuracy`), 24 µs for the delay of a link; for the last piece it is at most a microsecond.
const LAST_PIECE: Duration = Duration::from_millis(1);

impl MonotonicClock {
    /// A clock that shows zero now.
    #[must_use]
    pub fn start() -> Self {
        Self { origin: nanos(clock_gettime(ClockId::Monotonic)) }
    }

    /// Both clocks now, to place the time stamps of the kernel.
    #[must_use]
    pub fn stamps(&self) -> KernelStamps {
        let unix = clock_gettime(ClockId::Realtime);
        KernelStamps { now: self.now(), unix: Duration::from_nanos(nanos(unix)) }
    }
}

impl Clock for MonotonicClock {
    #[inline]
    fn now(&self) -> Instant {
        Instant::from_nanos(nanos(clock_gettime(ClockId::Monotonic)) - self.origin)
    }

    fn block(&self, until: Option<Instant>, readable: &[BorrowedFd<'_>]) -> io::Result<bool> {
        match until {
            Some(until) if readable.is_empty() => {
                // Absolute: whatever happens between reading the clock and this call costs nothing.
                let at = self.origin.saturating_add(until.as_nanos());
                match clock_nanosleep_absolute(ClockId::Monotonic, &timespec(Duration::from_nanos(at))) {
                    Ok(()) | Err(Errno::INTR) => Ok(false),
                    Err(error) => Err(error.into()),
                }
            }
            until => {
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

/// How long to wait at once, of a wait that is that long.
fn piece(span: Duration) -> Duration {
    if span > LAST_PIECE * 2 { span - LAST_PIECE } else { span }
}

/// The clock of the run and the time of day at one moment.
///
/// The kernel notes when a datagram came in, but by the time of day. The difference between the two clocks places it in the run, whenever the program gets
/// round to reading it.
#[derive(Clone, Copy, Debug)]
pub struct KernelStamps {
    now: Instant,
    unix: Duration,
}

/// A stamp that is older than this when it is read is not believed: the time of day was stepped.
const OLDEST: Duration = Duration::from_secs(1);

impl KernelStamps {
    /// The instant of the run at which the time of day was `stamp`; now if there is no stamp, or if it lies in the future or more than a second back, which
    /// happens when the time of day is set.
    #[must_use]
    pub fn instant(&self, stamp: Option<Duration>) -> Instant {
        let age = stamp.and_then(|stamp| self.unix.checked_sub(stamp)).filter(|age| *age <= OLDEST);
        match age {
            None => self.now,
            Some(age) => Instant::ZERO + self.now.saturating_duration_since(Instant::ZERO).saturating_sub(age),
        }
    }

    /// When both clocks were read.
    #[must_use]
    pub const fn now(&self) -> Instant {
        self.now
    }
}

/// The order in which the datagrams of one socket came in.
#[derive(Debug)]
pub(crate) struct ArrivalOrder {
    latest: Instant,
}

impl ArrivalOrder {
    /// Before the first datagram.
    pub(crate) const NEW: Self = Self { latest: Instant::ZERO };

    /// Puts the instants of the next datagrams, which came in that order, in order: none is later than one behind it, nor earlier than the last one of those before.
    pub(crate) fn put_in_order(&mut self, arrivals: &mut [Instant]) {
        let Some(last) = arrivals.last().copied() else { return };
        let (mut earliest_behind, before) = (last, self.latest);
        self.latest = last.max(before);
        for arrival in arrivals.iter_mut().rev() {
            earliest_behind = earliest_behind.min(*arrival);
            *arrival = earliest_behind.max(before);
        }
    }
}

fn nanos(time: Timespec) -> u64 {
    // Neither clock is negative, and both fit: 584 years of nanoseconds.
    let (seconds, nanos) = (u64::try_from(time.tv_sec).unwrap_or(0), u64::try_from(time.tv_nsec).unwrap_or(0));
    seconds.saturating_mul(1_000_000_000).saturating_add(nanos)
}

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
        // Before the run began there is no instant: what waited in the socket came at its beginning.
        assert_eq!(back(Duration::from_millis(6)), Instant::ZERO);
        // The time of day was set in between.
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
        // Two were stamped when they were read, at 20, before the kernel stamped those of 10 and 12.
        assert_eq!(ordered(&[20, 20, 10, 12]), [10, 10, 10, 12]);
        // All of this batch were stamped when they were read, and those of the next ones had come by then.
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
