//! Asking a loop that has to be on time how it stands: it answers the next time that it looks up, and never waits.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::Duration;

/// The side that asks.
#[derive(Debug)]
pub(super) struct Probe<T> {
    wanted: Arc<AtomicBool>,
    answers: Receiver<T>,
}

/// The side that is asked.
#[derive(Debug)]
pub(super) struct Asked<T> {
    wanted: Arc<AtomicBool>,
    answers: SyncSender<T>,
}

/// Longer than any pause that a loaded machine makes: a loop that does not answer for so long has ended.
const PATIENCE: Duration = Duration::from_secs(30);

pub(super) fn probe<T>() -> (Probe<T>, Asked<T>) {
    let wanted = Arc::new(AtomicBool::new(false));
    let (answer, answers) = sync_channel(1);
    (Probe { wanted: Arc::clone(&wanted), answers }, Asked { wanted, answers: answer })
}

impl<T> Probe<T> {
    /// How it stands now; `None` if the loop has ended.
    pub(super) fn ask(&self) -> Option<T> {
        // An answer that came after the patience was at its end is an old one.
        while self.answers.try_recv().is_ok() {}
        self.wanted.store(true, Ordering::Release);
        self.answers.recv_timeout(PATIENCE).ok()
    }
}

impl<T> Asked<T> {
    /// Answers if somebody asks.
    pub(super) fn answer(&self, make: impl FnOnce() -> T) {
        if self.wanted.swap(false, Ordering::Acquire) {
            // Nobody waits for two answers; one that nobody fetches any more is dropped.
            let _ = self.answers.try_send(make());
        }
    }
}
