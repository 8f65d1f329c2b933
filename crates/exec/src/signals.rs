//! Signals that reach the command once.
//!
//! All processes of an `exec` are in one process group. A signal of the terminal (Ctrl-C) reaches the whole group, the command included. A signal that
//! another process sends to the program alone must be passed on to the command, and a signal to the whole group must not be passed on. The program cannot
//! distinguish the two cases, but process 1 can, because process 1 is in the group too. The program waits for [`GROUP`] before passing a signal on, and
//! process 1 drops a signal that has also reached process 1 directly.

use core::time::Duration;
use std::io;

use nix::sys::signal::{SigSet, Signal};
use nix::sys::signalfd::SignalFd;

/// Time in which a signal to a group reaches all processes of the group: the system signals one process after the other, within microseconds.
pub(crate) const GROUP: Duration = Duration::from_millis(5);

/// A read signal.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Got {
    pub(crate) signal: Signal,
    /// The terminal has sent the signal, to the whole process group.
    pub(crate) is_of_terminal: bool,
}

/// Returns the signals to be passed on to the command.
pub(crate) fn passed_on() -> SigSet {
    [Signal::SIGHUP, Signal::SIGINT, Signal::SIGQUIT, Signal::SIGTERM, Signal::SIGUSR1, Signal::SIGUSR2].into_iter().collect()
}

/// Returns the number of a signal, as in messages and statuses.
pub(crate) fn number(signal: Signal) -> u8 {
    // Linux has 64 signals.
    u8::try_from(signal as i32).unwrap_or(0)
}

/// Returns the exit status of a command that a signal has ended, as shells have it.
pub(crate) fn status(signal: Signal) -> u8 {
    128 + number(signal)
}

/// Reads the next signal.
pub(crate) fn read(signals: &SignalFd) -> io::Result<Option<Got>> {
    /// `SI_KERNEL`: the kernel has sent the signal. The kernel sends the passed-on signals for a terminal only.
    const OF_KERNEL: i32 = 0x80;
    let Some(info) = signals.read_signal()? else { return Ok(None) };
    let number = i32::try_from(info.ssi_signo).map_err(io::Error::other)?;
    Ok(Some(Got { signal: Signal::try_from(number)?, is_of_terminal: info.ssi_code == OF_KERNEL }))
}
