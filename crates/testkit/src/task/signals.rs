//! Signals to the programs of hosts.

use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll, Waker};

use cohaptic_sockets::Signals;
use cohaptic_wan::NodeId;

/// Signals for which the programs of a run listen.
#[derive(Default)]
pub(crate) struct Handlers(Mutex<Vec<Handler>>);

/// A signal that the program of a host handles, with the waiting listeners. As with Linux, the program handles the signal until the end of the program, also
/// when nobody waits for the signal any more.
struct Handler {
    host: NodeId,
    number: i32,
    waiting: Vec<Arc<Mutex<Waiting>>>,
}

/// State of a listener that waits for a signal.
#[derive(Debug, Default)]
struct Waiting {
    has_come: bool,
    waker: Option<Waker>,
}

impl Handlers {
    /// Listens for a signal on a host.
    pub(crate) fn listen(&self, host: NodeId, number: i32) -> Listener {
        let waiting = Arc::default();
        let mut handlers = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let place = handlers.iter().position(|handler| (handler.host, handler.number) == (host, number)).unwrap_or_else(|| {
            handlers.push(Handler { host, number, waiting: Vec::new() });
            handlers.len() - 1
        });
        let all = &mut handlers[place].waiting;
        // A listener that was dropped has left its state with the handler alone.
        all.retain(|waiting| Arc::strong_count(waiting) > 1);
        all.push(Arc::clone(&waiting));
        Listener(waiting)
    }

    /// Sends a signal to the program of a host. Returns whether the program handles the signal.
    pub(crate) fn send(&self, host: NodeId, number: i32) -> bool {
        let waiting = {
            let handlers = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            let Some(handler) = handlers.iter().find(|handler| (handler.host, handler.number) == (host, number)) else { return false };
            handler.waiting.clone()
        };
        for waiting in waiting {
            let waker = {
                let mut waiting = waiting.lock().unwrap_or_else(PoisonError::into_inner);
                waiting.has_come = true;
                waiting.waker.take()
            };
            // Without the lock: a waker is foreign.
            waker.into_iter().for_each(Waker::wake);
        }
        true
    }

    /// Forgets the signals of a host, whose program has ended.
    pub(super) fn forget(&self, host: NodeId) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).retain(|handler| handler.host != host);
    }
}

/// Listener of a program for a signal.
#[derive(Debug)]
pub(crate) struct Listener(Arc<Mutex<Waiting>>);

impl Signals for Listener {
    fn poll_receive(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        let mut waiting = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if std::mem::take(&mut waiting.has_come) {
            return Poll::Ready(());
        }
        // A signal that comes from here on finds the waker, because the lock is held since the look.
        waiting.waker = Some(cx.waker().clone());
        Poll::Pending
    }
}
