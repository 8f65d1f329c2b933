//! Ctrl-C: the first asks for an end in good order, the second ends at once.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Duration;

static ASKED: AtomicBool = AtomicBool::new(false);

/// What must be done even if the program ends at once.
static LAST: Mutex<Vec<Box<dyn Fn() + Send>>> = Mutex::new(Vec::new());

/// How long that may take.
const LAST_MOMENT: Duration = Duration::from_millis(50);

/// Begins to listen. Where that is impossible, Ctrl-C ends the program as it always does.
pub(crate) fn listen() {
    let _ = ctrlc::set_handler(|| {
        if ASKED.swap(true, Ordering::Relaxed) {
            let last = LAST.lock().unwrap_or_else(PoisonError::into_inner);
            last.iter().for_each(|act| act());
            if !last.is_empty() {
                thread::sleep(LAST_MOMENT);
            }
            std::process::exit(i32::from(crate::failure::INTERRUPTED));
        }
    });
}

/// Has something done before a second Ctrl-C ends the program: that a device lets go of somebody's hand. It must not wait.
pub(crate) fn before_exit(act: impl Fn() + Send + 'static) {
    LAST.lock().unwrap_or_else(PoisonError::into_inner).push(Box::new(act));
}

/// Whether the user has asked for the end.
pub(crate) fn asked() -> bool {
    ASKED.load(Ordering::Relaxed)
}
