//! Watch over the commands of a run: their starts, signals and ends.

use core::time::Duration;
use std::io;
use std::os::fd::{AsFd as _, BorrowedFd};

use cohaptic_realtime::{Clock as _, MonotonicClock};
use cohaptic_units::Instant;
use nix::sys::signal::Signal;
use nix::sys::signalfd::SignalFd;

use super::output::Outputs;
use super::{Plan, named};
use crate::channel::{Order, Report as Told};
use crate::emulation::Stop;
use crate::host::{Failed, Host, Output};
use crate::signals;

/// Time from SIGTERM until the remaining commands are killed.
const TO_END: Duration = Duration::from_secs(5);

/// State of a command.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum State {
    /// The command waits until all hosts before are ready.
    Waits,
    Runs,
    Ended(u8),
}

/// End of the commands.
pub(super) struct Ended {
    /// Status of the run.
    pub(super) status: u8,
    /// Status of each command, or `None` for a command ended by force.
    pub(super) statuses: Vec<Option<u8>>,
    /// Number of the first signal that asks programs to end, or `None` for none.
    pub(super) signal: Option<u8>,
}

/// Watch over the commands: starts in turn, signals, and the end of all commands together.
pub(super) struct Watch<'a> {
    plan: &'a Plan,
    /// Hosts; `None` after the host was ended by force.
    hosts: Vec<Option<&'a Host>>,
    states: Vec<State>,
    signals: &'a SignalFd,
    outputs: &'a Outputs,
    clock: MonotonicClock,
    /// Status of the run; `None` before the run is ending.
    status: Option<u8>,
    /// Instant at which the remaining commands are killed; `None` before the run is ending.
    kill_at: Option<Instant>,
    /// Number of the first signal that asks programs to end; `None` before.
    signal: Option<u8>,
}

impl<'a> Watch<'a> {
    pub(super) fn new(plan: &'a Plan, hosts: &'a [Host], signals: &'a SignalFd, outputs: &'a Outputs) -> Self {
        let states = vec![State::Waits; hosts.len()];
        let hosts = hosts.iter().map(Some).collect();
        Self { plan, hosts, states, signals, outputs, clock: MonotonicClock::start(), status: None, kill_at: None, signal: None }
    }

    /// Runs the commands until all commands have ended, or until the remaining commands have to be killed.
    pub(super) fn until_all_have_ended(mut self, stop: &Stop) -> Result<Ended, Failed> {
        while self.hosts.iter().any(Option::is_some) {
            self.start_ready()?;
            if self.kill_at.is_some_and(|at| self.clock.now() >= at) {
                break;
            }
            self.wait().map_err(|error| Failed::own(format!("cannot wait for the commands: {error}")))?;
            if self.outputs.has_network_ended() {
                // The thread of the network returns the reason.
                break;
            }
            self.pass_signals().map_err(|error| Failed::own(format!("cannot pass signals on: {error}")))?;
            self.hear()?;
        }
        stop.finish();
        let ended = |state: &State| if let State::Ended(status) = state { Some(*status) } else { None };
        Ok(Ended { status: self.status.unwrap_or(0), statuses: self.states.iter().map(ended).collect(), signal: self.signal })
    }

    /// Starts each command for which all hosts before are ready.
    fn start_ready(&mut self) -> Result<(), Failed> {
        for place in 0..self.states.len() {
            // No command starts after the run has begun to end.
            if self.states[place] == State::Waits && self.kill_at.is_none() {
                let Some(host) = self.hosts[place] else { continue };
                let started = host.start(self.plan.hosts[place].output != Output::Lines);
                started.map_err(|error| Failed::own(format!("cannot start the command: {error}")))?;
                self.states[place] = State::Runs;
            }
            // Nobody waits for an ended command: the run goes on, or ends with the status of the command.
            let is_waited_for = self.plan.hosts[place].ready.is_some() && !self.outputs.is_ready(place) && self.states[place] == State::Runs;
            if is_waited_for {
                break;
            }
        }
        Ok(())
    }

    /// Waits for a signal, a report, a newly ready host, or the time to kill.
    fn wait(&self) -> io::Result<()> {
        let mut readable: Vec<BorrowedFd<'_>> = self.hosts.iter().flatten().map(|host| host.channel.as_fd()).collect();
        readable.extend([self.signals.as_fd(), self.outputs.as_fd()]);
        self.clock.block(self.kill_at, &readable)?;
        if is_readable(self.outputs.as_fd())? { self.outputs.take_wake() } else { Ok(()) }
    }

    fn pass_signals(&mut self) -> io::Result<()> {
        if !is_readable(self.signals.as_fd())? {
            return Ok(());
        }
        let Some(got) = signals::read(self.signals)? else { return Ok(()) };
        if !matches!(got.signal, Signal::SIGUSR1 | Signal::SIGUSR2) {
            self.signal.get_or_insert_with(|| signals::number(got.signal));
        }
        if !got.is_of_terminal {
            // Process 1 then has the signal too, if it was sent to the whole group.
            self.clock.block(Some(self.clock.now().saturating_add(signals::GROUP)), &[])?;
            self.tell_all(got.signal);
        }
        // A waiting command has no process for the signal. The host ends as if the signal had ended the command: no command starts after Ctrl-C, and a
        // command that never ran does not count as a success.
        for place in 0..self.states.len() {
            if self.states[place] == State::Waits {
                self.end(place, signals::status(got.signal));
            }
        }
        Ok(())
    }

    /// Passes a signal to all running commands.
    fn tell_all(&self, signal: Signal) {
        for host in self.hosts.iter().flatten() {
            // A just ended host needs no signal.
            let _ = host.channel.order(Order::Signal(signals::number(signal)), None);
        }
    }

    /// Reads the reports of the hosts.
    fn hear(&mut self) -> Result<(), Failed> {
        for place in 0..self.hosts.len() {
            let plan = &self.plan.hosts[place];
            let unheard = |error: io::Error| Failed::own(format!("cannot hear the process inside: {error}"));
            while let Some(host) = self.hosts[place]
                && is_readable(host.channel.as_fd()).map_err(unheard)?
            {
                match host.channel.next_report().map_err(unheard)? {
                    Some((Told::Started | Told::Device(_), _)) => {}
                    Some((Told::Ended(status), _)) => self.end(place, status),
                    Some((Told::Failed(status, why), _)) => return Err(named(self.plan, plan, Failed { status, why })),
                    // A run that is ending needs no report any more.
                    None if self.kill_at.is_some() => self.hosts[place] = None,
                    // Process 1 reports nothing before the start, so that process 1 was killed. The command counts as killed, too, and not as successful.
                    None if self.states[place] == State::Waits => self.end(place, signals::status(Signal::SIGKILL)),
                    None => return Err(named(self.plan, plan, Failed::own("the process inside has ended without a word".to_owned()))),
                }
            }
        }
        Ok(())
    }

    /// Notes the end of a command, or of a host whose command never starts. The end of the main command, or without a main command the first failure, ends the
    /// run: all other commands get SIGTERM.
    fn end(&mut self, place: usize, status: u8) {
        self.states[place] = State::Ended(status);
        self.hosts[place] = None;
        let has_main = self.plan.hosts.iter().any(|host| host.is_main);
        let decides = if has_main { self.plan.hosts[place].is_main } else { status != 0 };
        if decides && self.status.is_none() {
            self.status = Some(status);
            self.kill_at = Some(self.clock.now().saturating_add(TO_END));
            self.tell_all(Signal::SIGTERM);
        }
    }
}

/// Returns whether a descriptor can be read now.
fn is_readable(descriptor: BorrowedFd<'_>) -> io::Result<bool> {
    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    let mut waited = [PollFd::from_borrowed_fd(descriptor, PollFlags::IN)];
    Ok(poll(&mut waited, Some(&Timespec { tv_sec: 0, tv_nsec: 0 }))? > 0)
}
