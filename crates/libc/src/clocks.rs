//! Clocks and random numbers, where a test bed is asked for virtual ones.

use std::cell::Cell;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use libc::{c_int, c_uint, c_void, clockid_t, size_t, ssize_t, timespec};

use crate::caught::{caught, real};
use crate::memory::{fail, room};

thread_local! {
    /// Reading that the next call for the monotonic clock on this thread returns.
    static MINT: Cell<Option<timespec>> = const { Cell::new(None) };
}

/// Returns the instant of the standard library whose reading of the clock is 0. The standard library makes instants only by reading the clock, so the reading
/// is 0 for this one call.
#[expect(clippy::disallowed_methods, reason = "the reading is one of this file")]
fn origin() -> Instant {
    static ORIGIN: OnceLock<Instant> = OnceLock::new();
    *ORIGIN.get_or_init(|| {
        MINT.set(Some(timespec { tv_sec: 0, tv_nsec: 0 }));
        Instant::now()
    })
}

fn reading(time: Duration) -> timespec {
    timespec { tv_sec: i64::try_from(time.as_secs()).unwrap_or(i64::MAX), tv_nsec: time.subsec_nanos().into() }
}

/// See `clock_gettime(2)`. The monotonic clocks and the time of day are those of the run, if the test bed has [`Clocks`](cohaptic_sockets::Clocks). Clocks of the
/// process and of threads are the system's.
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn clock_gettime(clock: clockid_t, to: *mut timespec) -> c_int {
    // Taken at every call, also while a thread ends: the value needs no destructor, so an ending thread still has the value.
    let minted = MINT.take();
    if let Some(minted) = minted {
        // SAFETY: the caller promises a place for the reading.
        unsafe { to.write(minted) };
        return 0;
    }
    let served = caught("clock_gettime", || {
        let is_monotonic = match clock {
            libc::CLOCK_MONOTONIC | libc::CLOCK_MONOTONIC_RAW | libc::CLOCK_MONOTONIC_COARSE | libc::CLOCK_BOOTTIME => true,
            libc::CLOCK_REALTIME | libc::CLOCK_REALTIME_COARSE | libc::CLOCK_TAI => false,
            _ => return None,
        };
        let clocks = cohaptic_sockets::bed()?.clocks()?;
        let time = if is_monotonic { clocks.monotonic.saturating_duration_since(origin()) } else { clocks.day };
        if to.is_null() {
            return Some(fail(libc::EFAULT));
        }
        // SAFETY: the caller promises a place for the reading.
        unsafe { to.write(reading(time)) };
        Some(Ok(0))
    });
    served.unwrap_or_else(|| {
        let real = real!(clock_gettime: unsafe extern "C" fn(clockid_t, *mut timespec) -> c_int);
        // SAFETY: the caller keeps the contract of the C library's function.
        unsafe { real(clock, to) }
    })
}

/// See `getrandom(2)`. Random numbers come from the seed of the run, if the test bed is asked for that.
///
/// # Safety
///
/// As the function of the C library.
#[unsafe(no_mangle)]
unsafe extern "C" fn getrandom(start: *mut c_void, length: size_t, flags: c_uint) -> ssize_t {
    let served = caught("getrandom", || {
        let bed = cohaptic_sockets::bed()?;
        // SAFETY: the caller promises the memory.
        let room = unsafe { room(start, length) };
        bed.random(room).then(|| Ok(ssize_t::try_from(length).unwrap_or(ssize_t::MAX)))
    });
    served.unwrap_or_else(|| {
        let real = real!(getrandom: unsafe extern "C" fn(*mut c_void, size_t, c_uint) -> ssize_t);
        // SAFETY: the caller keeps the contract of the C library's function.
        unsafe { real(start, length, flags) }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The standard library reads its clock here, so that an instant has a known reading.
    #[test]
    fn an_instant_is_made_from_a_reading() {
        MINT.set(Some(timespec { tv_sec: 100, tv_nsec: 5 }));
        #[expect(clippy::disallowed_methods, reason = "the reading is one of this test")]
        let minted = Instant::now();
        assert_eq!(minted.duration_since(origin()), Duration::new(100, 5));
        assert_eq!(reading(Duration::new(7, 9)).tv_nsec, 9);
    }
}
