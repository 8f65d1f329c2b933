//! A host, seen from outside: the processes inside, and the device of the host.

use std::ffi::OsString;
use std::io;
use std::os::fd::AsFd as _;
use std::process::{Child, ChildStderr, ChildStdout, Command, Stdio};

use cohaptic_router::Tun;

use crate::channel::{Channel, Order, Report};
use crate::inside::{self, DEVICE, ENTER, MARK, OWN_FAILURE, Setup};

/// Host with its processes. The processes end with this value.
#[derive(Debug)]
pub(crate) struct Host {
    child: Child,
    pub(crate) channel: Channel,
}

/// Way of a command's output.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Output {
    /// The command has the standard input, output and error of this program.
    Shared,
    /// As [`Output::Shared`], but the standard output goes to the standard error of this program.
    ToError,
    /// Standard output and error go line by line to the listener of [`run`](crate::run). The standard input is empty.
    Lines,
}

/// Failure of a command, or of this program before the command.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("{why}")]
pub struct Failed {
    /// Exit status: 125 for a failure of this program, 126 if the command cannot be executed, 127 if the command is not found.
    pub status: u8,
    /// Reason, in words.
    pub why: String,
}

impl Failed {
    pub(crate) const fn own(why: String) -> Self {
        Self { status: OWN_FAILURE, why }
    }
}

impl Host {
    /// Starts the processes of a host. The command waits for [`Host::start`].
    pub(crate) fn begin(setup: &Setup, command: &[OsString], output: Output) -> Result<Self, Failed> {
        let failed = |what: &str| {
            let what = what.to_owned();
            move |error: io::Error| Failed::own(format!("cannot {what}: {error}"))
        };
        let (outside, inside) = Channel::pair().map_err(failed("make a pair of sockets"))?;
        let own = std::env::current_exe().map_err(failed("find the file of this program"))?;
        let mut process = Command::new(own);
        process.args([MARK, ENTER, &setup.to_text()]).args(command).stdin(Stdio::from(inside.into_descriptor()));
        match output {
            Output::Shared => {}
            Output::ToError => {
                process.stdout(io::stderr().as_fd().try_clone_to_owned().map_err(failed("copy standard error"))?);
            }
            Output::Lines => {
                process.stdout(Stdio::piped()).stderr(Stdio::piped());
            }
        }
        let child = process.spawn().map_err(failed("start this program again"))?;
        Ok(Self { child, channel: outside })
    }

    /// Waits for the device of the host.
    pub(crate) fn device(&self) -> Result<Tun, Failed> {
        match self.channel.next_report() {
            Ok(Some((Report::Device(number), Some(descriptor)))) => Ok(Tun::of_descriptor(descriptor, DEVICE, inside::offloads(number))),
            Ok(Some((Report::Failed(status, why), _))) => Err(Failed { status, why }),
            Ok(_) => Err(Failed::own("the process inside has ended before its device was there".to_owned())),
            Err(error) => Err(Failed::own(format!("cannot hear the process inside: {error}"))),
        }
    }

    /// Lets the command begin. `reads`: the command has the standard input of this program; otherwise the input is empty.
    pub(crate) fn start(&self, reads: bool) -> io::Result<()> {
        if reads {
            self.channel.order(Order::Start, Some(io::stdin().as_fd()))
        } else {
            self.channel.order(Order::Start, Some(std::fs::File::open("/dev/null")?.as_fd()))
        }
    }

    /// Takes the pipes of the command's output.
    pub(crate) fn output(&mut self) -> (Option<ChildStdout>, Option<ChildStderr>) {
        (self.child.stdout.take(), self.child.stderr.take())
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        // Process 1 ends with its parent, and all processes of the namespace with process 1.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
