//! Ctrl-C, SIGTERM and SIGHUP: the first asks the command to stop computing, the second ends the program at once.
//!
//! A command computes, and then writes its results. The first signal ends the first of these within a second and never the second: once a command has results
//! ([`has_results`]), it stops computing by itself, because it looks at [`requested`], and writes the results however long that takes. A computation that has
//! no result yet and cannot look at [`requested`], such as the eigenvalues of a large matrix, is ended when [`TO_STOP`] is over. A command that has whole
//! results of parts while it computes others leaves word of what to do with these ([`keep`]).

use std::io::Write as _;
use std::mem;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError, mpsc};
use std::thread::{self, ThreadId};
use std::time::Duration;

static ASKED: AtomicBool = AtomicBool::new(false);

/// What must be done even if the program ends at once.
static LAST: Mutex<Vec<Box<dyn Fn() + Send>>> = Mutex::new(Vec::new());

static STAGE: Mutex<Stage> = Mutex::new(Stage::Computes);

/// How far the command is.
enum Stage {
    /// There is no result yet that could be written.
    Computes,
    /// Parts of the result are there, and this function writes them; the command cannot look at [`requested`] often enough to do so itself.
    Keeps(Box<dyn FnOnce() -> String + Send>),
    /// There are results, which the command writes itself.
    HasResults,
    /// The time of the command is over. Only this thread may still write.
    Ends(ThreadId),
}

/// How long after the first signal a command may compute that has no results; a second, less the time that a process takes to end.
const TO_STOP: Duration = Duration::from_millis(800);
/// How long results may be written without a word about it.
const TO_WRITE_SILENTLY: Duration = Duration::from_millis(200);
/// How long what must be done at last may take.
const LAST_MOMENT: Duration = Duration::from_millis(50);

/// The line for results that take long to write.
const WRITES: &str = "what was computed is written before the program ends, however long that takes; a second signal ends the program at once";
/// The line of a computation that had no results.
const ENDED: &str = "the computation was ended where it stood; files that are whole are kept";

/// Begins to listen. Where that is impossible, signals end the program as they always do.
pub(crate) fn listen() {
    let _ = ctrlc::set_handler(|| {
        if ASKED.swap(true, Ordering::Relaxed) {
            end();
        }
        if thread::Builder::new().name("end".to_owned()).spawn(end_in_time).is_err() {
            end();
        }
    });
}

/// Has something done before the program ends without its own end: that a device lets go of somebody's hand. It must not wait.
pub(crate) fn before_exit(act: impl Fn() + Send + 'static) {
    LAST.lock().unwrap_or_else(PoisonError::into_inner).push(Box::new(act));
}

/// Has whole results of parts written if the command computes for too long after a signal; the function says what it wrote. Until [`has_results`] is called.
pub(crate) fn keep(act: impl FnOnce() -> String + Send + 'static) {
    *stage() = Stage::Keeps(Box::new(act));
}

/// The command has results: from now on only a second signal ends the program before the command does. The caller looks at [`requested`] between any two
/// steps of what it still computes. Everything that is printed or written as a whole file calls this itself.
///
/// Does not return if the time of the command is over already.
pub(crate) fn has_results() {
    let mut stage = stage();
    match *stage {
        Stage::Computes | Stage::Keeps(_) => *stage = Stage::HasResults,
        Stage::HasResults => {}
        Stage::Ends(by) => {
            drop(stage);
            // Half of a document must not stand before or behind what the other thread prints.
            while thread::current().id() != by {
                thread::park();
            }
        }
    }
}

/// Whether the user has asked for the end.
pub(crate) fn requested() -> bool {
    ASKED.load(Ordering::Relaxed)
}

/// Ends the program unless it ends by itself, or has results to write.
fn end_in_time() {
    thread::sleep(TO_STOP);
    let mut stage = stage();
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

/// Writes the results of parts, and says so if that takes long.
fn said_of(act: Box<dyn FnOnce() -> String + Send>) -> String {
    let (done, is_done) = mpsc::channel::<()>();
    let late = thread::Builder::new().name("late".to_owned()).spawn(move || {
        if is_done.recv_timeout(TO_WRITE_SILENTLY) == Err(mpsc::RecvTimeoutError::Timeout) {
            say(WRITES);
        }
    });
    let said = act();
    drop(done);
    // Its line comes before the last one.
    let _ = late.map(thread::JoinHandle::join);
    said
}

/// If standard error cannot be written to either, the exit status is all that is left to say it with.
fn say(line: &str) {
    let _ = writeln!(std::io::stderr(), "interrupted: {line}");
}

/// Ends it at once.
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
