//! Requests of a thread to the system, so that the thread runs on time.

use core::fmt;
use core::num::NonZeroU64;
use std::io;

use rustix::mm::{MlockAllFlags, mlockall};
use rustix::thread::set_current_timer_slack;
use thread_priority::{
    Error, RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy, set_thread_priority_and_policy, thread_native_id,
};

/// Requests to make.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Wishes {
    /// Priority under `SCHED_FIFO`, 1 to 99: the thread runs before every ordinary thread. `None`: no request.
    pub priority: Option<u8>,
    /// `true` if to lock all present and future memory of the process, so that no page fault delays the thread.
    pub lock_memory: bool,
}

impl Default for Wishes {
    /// Returns both requests, with a priority in the middle, below the kernel's threads that serve devices.
    fn default() -> Self {
        Self { priority: Some(40), lock_memory: true }
    }
}

impl Wishes {
    /// No request except timer slack, which costs no other thread anything.
    pub const NONE: Self = Self { priority: None, lock_memory: false };
}

/// One request.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Wish {
    /// Timer slack of 1 ns in place of 50 µs: the kernel does not delay wake-ups to join them with other wake-ups.
    TimerSlack,
    /// Scheduling by `SCHED_FIFO`.
    Priority,
    /// Locked memory.
    LockedMemory,
}

/// Answers of the system.
#[derive(Debug, Default)]
pub struct Prepared {
    /// Granted requests.
    pub granted: Vec<Wish>,
    /// Refused requests. The run goes on without them.
    pub refused: Vec<Refused>,
}

/// Request refused by the system.
#[derive(Debug)]
pub struct Refused {
    /// Refused request.
    pub wish: Wish,
    /// Error of the system.
    pub error: io::Error,
}

impl Wish {
    /// Returns the name of the request for messages.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::TimerSlack => "timer slack of 1 ns",
            Self::Priority => "SCHED_FIFO",
            Self::LockedMemory => "locked memory",
        }
    }

    /// Returns the consequence of a refusal, and the permission that lets the request succeed.
    const fn way_out(self) -> &'static str {
        match self {
            Self::TimerSlack => "wake-ups may be 50 µs later",
            Self::Priority => "other programs may delay this one; allow it with CAP_SYS_NICE, or with `rtprio` in /etc/security/limits.conf",
            Self::LockedMemory => "a page fault may delay it; allow it with CAP_IPC_LOCK, or with `memlock` in /etc/security/limits.conf",
        }
    }
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} was refused ({}): {}", self.wish.name(), self.error, self.wish.way_out())
    }
}

/// Makes the requests for the calling thread, and timer slack in any case. The thread goes on without refused requests.
///
/// Locked memory concerns the whole process, and stays locked when the thread ends.
#[must_use]
pub fn prepare_thread(wishes: &Wishes) -> Prepared {
    let mut prepared = Prepared::default();
    let mut note = |wish, done: io::Result<()>| match done {
        Ok(()) => prepared.granted.push(wish),
        Err(error) => prepared.refused.push(Refused { wish, error }),
    };
    // Timer slack needs no permission, so this request is always made.
    note(Wish::TimerSlack, set_current_timer_slack(NonZeroU64::new(1)).map_err(io::Error::from));
    if let Some(priority) = wishes.priority {
        note(Wish::Priority, first_in_first_out(priority));
    }
    if wishes.lock_memory {
        note(Wish::LockedMemory, mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE).map_err(io::Error::from));
    }
    prepared
}

/// Puts the calling thread under `SCHED_FIFO`. A priority out of range becomes the nearest one in 1 to 99.
fn first_in_first_out(priority: u8) -> io::Result<()> {
    let value = ThreadPriorityValue::try_from(priority.clamp(1, 99)).map_err(io::Error::other)?;
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(value), policy).map_err(|error| match error {
        Error::OS(code) => io::Error::from_raw_os_error(code),
        Error::Priority(message) | Error::Ffi(message) => io::Error::other(message),
        Error::PriorityNotInRange(range) => io::Error::other(format!("priorities are {range:?}")),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_wish_is_granted_or_refused_and_a_refusal_says_what_to_do() {
        // The priority ends with the new thread, so that no other test runs with the priority.
        let prepared = std::thread::spawn(|| prepare_thread(&Wishes { lock_memory: false, ..Wishes::default() })).join().unwrap();
        let mut all = prepared.granted.clone();
        all.extend(prepared.refused.iter().map(|refused| refused.wish));
        all.sort_unstable();
        assert_eq!(all, [Wish::TimerSlack, Wish::Priority]);
        let refused = Refused { wish: Wish::Priority, error: io::Error::from_raw_os_error(1) };
        let text = refused.to_string();
        assert!(text.starts_with("SCHED_FIFO was refused (Operation not permitted") && text.contains("CAP_SYS_NICE"), "{text}");
    }
}
