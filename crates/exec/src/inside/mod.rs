//! Processes inside the namespaces of a host.
//!
//! ```text
//!   this program ── starts itself ──▶ enter: new namespaces, device, names ── starts itself ──▶ init: process 1, starts the command
//! ```
//!
//! A new process namespace holds only the children of the process that makes the namespace, and only a process with one thread can make a user namespace. So
//! the program starts itself twice, by arguments that no user types. Process 1 is this program, not the command: the system ignores signals for which process
//! 1 has no handler, and the command would have to wait for the orphans of the namespace.

mod enter;
mod files;
mod init;
mod refusal;
mod setup;

use std::ffi::OsString;
use std::process::ExitCode;

pub(crate) use enter::offloads;
pub(crate) use setup::DEVICE;
pub use setup::Setup;

/// First argument of a process inside. No command of the program has a space in its name.
pub(crate) const MARK: &str = "inside exec";
/// Second argument of the process that makes the namespaces.
pub(crate) const ENTER: &str = "enter";
const INIT: &str = "init";

/// Exit status if this program itself fails.
pub(crate) const OWN_FAILURE: u8 = 125;
/// Exit status if the command cannot be executed.
const CANNOT_RUN: u8 = 126;
/// Exit status if the command is not found.
const NOT_FOUND: u8 = 127;

/// Runs a process inside, if the arguments name a process inside. The program must call this function before it has a second thread, and before it
/// looks at its arguments. Returns `None` in every other process.
#[must_use]
pub fn run() -> Option<ExitCode> {
    let arguments: Vec<OsString> = std::env::args_os().skip(1).take(3).collect();
    let [mark, stage, setup] = arguments.as_slice() else { return None };
    if mark != MARK {
        return None;
    }
    let command: Vec<OsString> = std::env::args_os().skip(4).collect();
    let ended = if stage == ENTER { enter::enter(setup, &command) } else { init::init(&command) };
    Some(if ended.is_ok() { ExitCode::SUCCESS } else { ExitCode::from(OWN_FAILURE) })
}
