//! Process 1 of a host: starts the command, passes signals on, and waits for orphans.

use std::ffi::OsString;
use std::io;
use std::os::fd::{AsFd as _, OwnedFd};
use std::process::{Command, Stdio};

use nix::sys::signal::{SigSet, Signal, kill};
use nix::sys::signalfd::SignalFd;
use nix::sys::wait::{WaitPidFlag, WaitStatus, waitpid};
use nix::unistd::Pid;
use rustix::event::{PollFd, PollFlags, poll};

use super::{CANNOT_RUN, NOT_FOUND, OWN_FAILURE, enter, files};
use crate::channel::{Channel, Order, Report};
use crate::signals;

/// Starts the command at the order of the program outside, and reports the end of the command.
pub(super) fn init(command: &[OsString]) -> io::Result<()> {
    let channel = Channel::of_standard_input()?;
    enter::dies_with_parent()?;
    files::mount_processes();
    rustix::thread::clear_ambient_capability_set()?;
    let ended = match wait_for_start(&channel)? {
        Some(input) => run(&channel, command, input),
        // The program outside is gone before the start.
        None => return Ok(()),
    };
    channel.report(&ended, None)
}

/// Waits for the order to start. Returns the standard input for the command, or `None` if the program outside is gone.
fn wait_for_start(channel: &Channel) -> io::Result<Option<OwnedFd>> {
    match channel.next_order()? {
        Some((Order::Start, input)) => Ok(input),
        // A signal before the start ends the host: nothing has begun.
        Some((Order::Signal(_), _)) | None => Ok(None),
    }
}

/// Runs the command to its end, and returns the report about the end.
fn run(channel: &Channel, command: &[OsString], input: OwnedFd) -> Report {
    let Some((name, arguments)) = command.split_first() else { return Report::Failed(OWN_FAILURE, "there is no command".to_owned()) };
    let watched = signals::passed_on();
    let mut all = watched;
    all.add(Signal::SIGCHLD);
    let failed = |error: io::Error| Report::Failed(OWN_FAILURE, format!("cannot watch signals: {error}"));
    let signals = match all.thread_block().and_then(|()| SignalFd::new(&all)) {
        Ok(signals) => signals,
        Err(error) => return failed(error.into()),
    };
    // The command inherits the signal mask, so the mask is lifted for the moment of the start.
    let mut starting = Command::new(name);
    starting.args(arguments).stdin(Stdio::from(input));
    let _ = all.thread_unblock();
    let child = starting.spawn();
    let _ = all.thread_block();
    let child = match child {
        Ok(child) => child,
        Err(error) => {
            let status = if error.kind() == io::ErrorKind::NotFound { NOT_FOUND } else { CANNOT_RUN };
            return Report::Failed(status, format!("cannot run {}: {error}", name.display()));
        }
    };
    let Ok(child) = i32::try_from(child.id()).map(Pid::from_raw) else { return failed(io::ErrorKind::InvalidData.into()) };
    // Without the program outside the loop below sees the end of the channel.
    let _ = channel.report(&Report::Started, None);
    match watch(channel, &signals, child) {
        Ok(status) => Report::Ended(status),
        Err(error) => failed(error),
    }
}

/// Waits for the end of the command, and returns its status. Passes signals on meanwhile. The end of the program outside is the end of this process, and with
/// it of all processes of the namespace.
fn watch(channel: &Channel, signals: &SignalFd, child: Pid) -> io::Result<u8> {
    let mut group = SigSet::empty();
    // The mask was lifted while the command started, so a command that ended at once has left no SIGCHLD to read.
    if let Some(status) = reap(child)? {
        return Ok(status);
    }
    loop {
        let mut waited = [PollFd::from_borrowed_fd(signals.as_fd(), PollFlags::IN), PollFd::from_borrowed_fd(channel.as_fd(), PollFlags::IN)];
        match poll(&mut waited, None) {
            Ok(_) | Err(rustix::io::Errno::INTR) => {}
            Err(error) => return Err(error.into()),
        }
        let [has_signal, has_order] = waited.map(|waited| !waited.revents().is_empty());
        if has_signal && let Some(signal) = signals::read(signals)? {
            if signal.signal == Signal::SIGCHLD {
                if let Some(status) = reap(child)? {
                    return Ok(status);
                }
            } else if !signal.is_of_terminal {
                // The signal was sent to the whole process group or to process 1 alone. The program outside must not repeat the signal for the command.
                group.add(signal.signal);
            }
            // All signals come before orders: see `signals`.
            continue;
        }
        if has_order {
            let Some((order, _)) = channel.next_order()? else { std::process::exit(0) };
            if let Order::Signal(number) = order
                && let Ok(signal) = Signal::try_from(i32::from(number))
                && !group.contains(signal)
            {
                kill(child, signal)?;
            }
            group.clear();
        }
    }
}

/// Takes the statuses of all ended children: the command, and orphans adopted by process 1. Returns the status of the command.
fn reap(child: Pid) -> io::Result<Option<u8>> {
    let mut found = None;
    loop {
        let (pid, status) = match waitpid(None, Some(WaitPidFlag::WNOHANG)) {
            Ok(WaitStatus::Exited(pid, status)) => (pid, u8::try_from(status & 0xff).unwrap_or(OWN_FAILURE)),
            Ok(WaitStatus::Signaled(pid, signal, _)) => (pid, signals::status(signal)),
            Ok(WaitStatus::StillAlive) | Err(nix::errno::Errno::ECHILD) => return Ok(found),
            Ok(_) | Err(nix::errno::Errno::EINTR) => continue,
            Err(error) => return Err(error.into()),
        };
        if pid == child {
            found = Some(status);
        }
    }
}
