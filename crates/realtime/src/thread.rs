//! What a thread asks of the system to be on time.

use core::fmt;
use core::num::NonZeroU64;
use std::io;

use rustix::mm::{MlockAllFlags, mlockall};
use rustix::thread::set_current_timer_slack;
use thread_priority::{
    Error, RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy, set_thread_priority_and_policy, thread_native_id,
};

/// What to ask for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Wishes {
    /// `SCHED_FIFO` with this priority, 1 to 99: ahead of every ordinary thread.
    pub priority: Option<u8>,
    /// All memory of the process, present and future, stays in memory.
    pub lock_memory: bool,
}

impl Default for Wishes {
    /// Both, with a priority in the middle, below the threads of the kernel that serve devices.
    fn default() -> Self {
        Self { priority: Some(40), lock_memory: true }
    }
}

impl Wishes {
    /// Nothing but what costs nobody anything: no timer slack.
    pub const NONE: Self = Self { priority: None, lock_memory: false };
}

/// One thing that was asked for.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Wish {
    /// Wake-ups are not put off to be done together with others: a slack of 1 ns in place of 50 µs.
    TimerSlack,
    /// `SCHED_FIFO`.
    Priority,
    /// Locked memory.
    LockedMemory,
}

/// What the system granted.
#[derive(Debug, Default)]
pub struct Prepared {
    /// What it granted.
    pub granted: Vec<Wish>,
    /// What it refused: the run goes on without.
    pub refused: Vec<Refused>,
}

/// Something that the system refused.
#[derive(Debug)]
pub struct Refused {
    /// What.
    pub wish: Wish,
    /// Why.
    pub error: io::Error,
}

impl Wish {
    /// In a few words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::TimerSlack => "timer slack of 1 ns",
            Self::Priority => "SCHED_FIFO",
            Self::LockedMemory => "locked memory",
        }
    }

    /// What goes on without, and how to get it.
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

/// Asks the system for what helps the calling thread to be on time. Whatever is refused, the thread goes on without.
///
/// Locked memory is the whole process's, and stays when the thread ends.
#[must_use]
pub fn prepare_thread(wishes: &Wishes) -> Prepared {
    let mut prepared = Prepared::default();
    let mut note = |wish, done: io::Result<()>| match done {
        Ok(()) => prepared.granted.push(wish),
        Err(error) => prepared.refused.push(Refused { wish, error }),
    };
    note(Wish::TimerSlack, set_current_timer_slack(NonZeroU64::new(1)).map_err(io::Error::from));
    if let Some(priority) = wishes.priority {
        note(Wish::Priority, first_in_first_out(priority));
    }
    if wishes.lock_memory {
        note(Wish::LockedMemory, mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE).map_err(io::Error::from));
    }
    prepared
}

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
        // In a thread of its own, which takes its priority with it.
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
