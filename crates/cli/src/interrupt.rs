//! Ctrl-C, SIGTERM and SIGHUP: the first asks the command to stop computing, the second ends the program at once.
//!
//! A command computes, and then writes results. The first signal ends the computation within a second, and never the writing. Once a command has results
//! ([`has_results`]), the command checks [`requested`], stops computing by itself, and writes the results however long the writing takes.
//! A computation that has no result yet and cannot check [`requested`], such as the eigenvalues of a large matrix, is ended after [`TO_STOP`]. A command with
//! whole results of some parts, and with other parts still to compute, registers a function for writing the whole results ([`keep`]).

use std::io::Write as _;
use std::mem;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError, mpsc};
use std::thread::{self, ThreadId};
use std::time::Duration;

static ASKED: AtomicBool = AtomicBool::new(false);

/// Actions to do even if the program ends at once.
static LAST: Mutex<Vec<Box<dyn Fn() + Send>>> = Mutex::new(Vec::new());

static STAGE: Mutex<Stage> = Mutex::new(Stage::Computes);

/// Stage of the command.
enum Stage {
    /// The command has no result yet.
    Computes,
    /// Parts of the result exist, and this function writes the parts. Used by commands with long computations between two checks of [`requested`].
    Keeps(Box<dyn FnOnce() -> String + Send>),
    /// The command has results, and writes the results itself.
    HasResults,
    /// The time of the command is over. Only the thread with this id may still write.
    Ends(ThreadId),
}

/// Longest computation after the first signal, for a command without results: a second, less the time for the end of a process.
const TO_STOP: Duration = Duration::from_millis(800);
/// Longest writing of results without a line on standard error.
const TO_WRITE_SILENTLY: Duration = Duration::from_millis(200);
/// Wait for the effects of the last actions.
const LAST_MOMENT: Duration = Duration::from_millis(50);

/// Line about results whose writing takes long.
const WRITES: &str = "what was computed is written before the program ends, however long that takes; a second signal ends the program at once";
/// Line about the end of a computation without results.
const ENDED: &str = "the computation stopped where it stood; complete files are kept";

/// Installs the handler of signals. If the system refuses the handler, signals end the program at once, as by default.
pub(crate) fn listen() {
    let _ = ctrlc::set_handler(|| {
        if ASKED.swap(true, Ordering::Relaxed) {
            end();
        }
        // Without a thread nobody could end the computation in time, so the program ends at once.
        if thread::Builder::new().name("end".to_owned()).spawn(end_in_time).is_err() {
            end();
        }
    });
}

/// Registers an action to do before the program ends at once, such as switching off the force of a device in a person's hand. The action must not wait.
pub(crate) fn before_exit(act: impl Fn() + Send + 'static) {
    LAST.lock().unwrap_or_else(PoisonError::into_inner).push(Box::new(act));
}

/// Registers a function for writing the whole results of parts. The function is called if the command still computes [`TO_STOP`] after a signal, and returns a
/// line about the written results. A call of [`has_results`] removes the function.
pub(crate) fn keep(act: impl FnOnce() -> String + Send + 'static) {
    *stage() = Stage::Keeps(Box::new(act));
}

/// Marks that the command has results: from now on only a second signal ends the program before the command does. The caller checks [`requested`] between any
/// two further steps of computation. All functions that print, or write a whole file, call this function themselves.
///
/// Does not return if the time of the command is over already.
pub(crate) fn has_results() {
    let mut stage = stage();
    match *stage {
        Stage::Computes | Stage::Keeps(_) => *stage = Stage::HasResults,
        Stage::HasResults => {}
        Stage::Ends(by) => {
            drop(stage);
            // The thread `by` may be printing. This thread waits for the end of the program, so that no part of a second document mixes with the output of
            // `by`.
            while thread::current().id() != by {
                thread::park();
            }
        }
    }
}

/// Returns whether the user has asked for the end.
pub(crate) fn requested() -> bool {
    ASKED.load(Ordering::Relaxed)
}

/// Waits for [`TO_STOP`] and ends the program, unless the command has results to write. Writes the results of parts before the end.
fn end_in_time() {
    thread::sleep(TO_STOP);
    let mut stage = stage();
    // The lock is held while the stage changes, so that `has_results` either comes first, and the results are written, or finds the end and waits.
    if matches!(*stage, Stage::HasResults) {
        drop(stage);
        say(WRITES);
        return;
    }
    let before = mem::replace(&mut *stage, Stage::Ends(thread::current().id()));
    drop(stage);
    match before {
        Stage::Keeps(act) => say(&said_of(act)),
        Stage::Computes | Stage::HasResults | Stage::Ends(_) => say(ENDED),
    }
    end();
}

/// Writes the results of parts and returns the line about them. Prints [`WRITES`] if the writing takes long.
fn said_of(act: Box<dyn FnOnce() -> String + Send>) -> String {
    let (done, is_done) = mpsc::channel::<()>();
    let late = thread::Builder::new().name("late".to_owned()).spawn(move || {
        // The channel closes at the end of the writing. A time-out therefore means that the writing takes long.
        if is_done.recv_timeout(TO_WRITE_SILENTLY) == Err(mpsc::RecvTimeoutError::Timeout) {
            say(WRITES);
        }
    });
    let said = act();
    drop(done);
    // The line of the thread `late` has to come before the last line of the program.
    let _ = late.map(thread::JoinHandle::join);
    said
}

/// Prints a line on standard error. If standard error cannot be written to, only the exit status tells of the interruption.
fn say(line: &str) {
    let _ = writeln!(std::io::stderr(), "interrupted: {line}");
}

/// Does the actions in [`LAST`], and ends the program with the status of an interruption, [`LAST_MOMENT`] later if there are such actions.
fn end() -> ! {
    let last = LAST.lock().unwrap_or_else(PoisonError::into_inner);
    last.iter().for_each(|act| act());
    if !last.is_empty() {
        thread::sleep(LAST_MOMENT);
    }
    std::process::exit(i32::from(crate::failure::INTERRUPTED));
}

fn stage() -> MutexGuard<'static, Stage> {
    STAGE.lock().unwrap_or_else(PoisonError::into_inner)
}
