//! Ctrl-C and SIGTERM: the first asks for an end in good order, which has most of a second; the second ends at once.
//!
//! A computation that asks often enough ends by itself. One that cannot ask, such as the eigenvalues of a large matrix, is ended when its time is over: nothing is lost
//! that is whole, because files are written under another name until they are ([`crate::file`]), and a command that has whole results before its
//! end leaves word of what to do with them ([`keep`]).

use std::io::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError, mpsc};
use std::thread;
use std::time::Duration;

static ASKED: AtomicBool = AtomicBool::new(false);

/// What must be done even if the program ends at once.
static LAST: Mutex<Vec<Box<dyn Fn() + Send>>> = Mutex::new(Vec::new());

/// The use of whole results if the command does not end in time.
static KEEP: Mutex<Keep> = Mutex::new(Keep { act: None, begun: false });

struct Keep {
    act: Option<Box<dyn FnOnce() -> String + Send>>,
    /// Whether its time is over: the command itself must not end any more.
    begun: bool,
}

/// How long after the first signal a command may go on that has something to keep which it has not begun to print.
const TO_END: Duration = Duration::from_millis(500);
/// How long it then may take to print that, or what a command prints at its own end.
const TO_KEEP: Duration = Duration::from_millis(300);
/// How long what must be done at last may take.
const LAST_MOMENT: Duration = Duration::from_millis(50);

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

/// Has something done with whole results if the command does not end in time after a signal; it says what it did. Until [`kept`] is called.
pub(crate) fn keep(act: impl FnOnce() -> String + Send + 'static) {
    keeping().act = Some(Box::new(act));
}

/// The command ends by itself and keeps what it has. Does not return if its time is over, and that is done already.
pub(crate) fn kept() {
    let mut keep = keeping();
    keep.act = None;
    if keep.begun {
        drop(keep);
        loop {
            // Until the program is ended.
            thread::park();
        }
    }
}

/// Whether the user has asked for the end.
pub(crate) fn requested() -> bool {
    ASKED.load(Ordering::Relaxed)
}

/// Ends the program unless it ends by itself.
fn end_in_time() {
    thread::sleep(TO_END);
    let mut keep = keeping();
    let act = keep.act.take();
    keep.begun = act.is_some();
    drop(keep);
    let (say, heard) = mpsc::channel();
    if let Some(act) = act {
        // On a thread of its own: it may wait for ever, for a pipe that nobody reads.
        let _ = thread::Builder::new().name("keep".to_owned()).spawn(move || say.send(act()));
    } else {
        thread::sleep(TO_KEEP);
    }
    let said = heard.recv_timeout(TO_KEEP).unwrap_or_else(|_| "the computation was ended where it stood; files that are whole are kept".to_owned());
    // If standard error cannot be written to either, the exit status is all that is left to say it with.
    let _ = writeln!(std::io::stderr(), "interrupted: {said}");
    end();
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

fn keeping() -> MutexGuard<'static, Keep> {
    KEEP.lock().unwrap_or_else(PoisonError::into_inner)
}
