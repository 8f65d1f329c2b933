//! Access to the state of a run: by the thread of the run while the run goes on, and by any thread after its end, to drop values of the run.
//!
//! A socket used on another thread would act at an instant that depends on the machine. The other thread would also have to wait until the thread of the run
//! releases the state, and would wait for ever if a task waits for that other thread. Hence such a use is an error at once, and the run fails with the text of
//! the error.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use cohaptic_wan::NodeId;

use super::{Core, Shared};
use crate::current;

/// Acts of other threads, left for the thread of a run.
#[derive(Default)]
pub(super) struct Elsewhere {
    /// `true` if `left` may hold something. Read without the lock between two polls of tasks.
    is_any: AtomicBool,
    left: Mutex<Left>,
}

#[derive(Default)]
struct Left {
    /// Text of the first fault of the test: another thread used a value of the run, or a task without a host made a socket.
    misuse: Option<String>,
    /// Acts, in the order of leaving.
    acts: Vec<Act>,
}

/// An act on the state.
type Act = Box<dyn FnOnce(&mut Core) + Send>;

impl Elsewhere {
    fn leave(&self, leave: impl FnOnce(&mut Left)) {
        leave(&mut self.left.lock().unwrap_or_else(PoisonError::into_inner));
        self.is_any.store(true, Ordering::Release);
    }

    fn take(&self) -> Left {
        // The mark goes before the lock is taken. An act left in between is either taken here, or marks again; no act is forgotten.
        self.is_any.store(false, Ordering::Relaxed);
        std::mem::take(&mut self.left.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Shared {
    /// Returns whether this thread runs the test bed of this state.
    #[inline]
    fn is_running(&self) -> bool {
        current::run() == self.run()
    }

    /// Returns whether this thread may take the state out of `home`: this thread runs the test bed, or the run has ended.
    pub(super) fn may_be_had(&self) -> bool {
        self.is_running() || self.has_ended()
    }

    /// Asks the state about a value of the host `host`. `kind` names the value in errors, such as "a UDP socket".
    ///
    /// # Errors
    ///
    /// As [`Shared::check_open`].
    #[inline(always)]
    pub(crate) fn open<T>(&self, host: NodeId, kind: &str, ask: impl FnOnce(&mut Core) -> T) -> io::Result<T> {
        let asked = match self.at_hand() {
            Some(asked) => asked,
            None => self.check_open(host, kind).map(|()| self.visit())?,
        };
        Ok(asked.answer(ask))
    }

    /// Checks that a value of the host `host` may be used on this thread now. `kind` names the value in the error.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::ConnectionAborted`] after the end of the run; [`io::ErrorKind::Unsupported`] outside of the thread of the run, and the run
    /// then fails as well.
    #[inline]
    pub(crate) fn check_open(&self, host: NodeId, kind: &str) -> io::Result<()> {
        if self.is_running() { Ok(()) } else { self.refuse(host, kind) }
    }

    #[cold]
    fn refuse(&self, host: NodeId, kind: &str) -> io::Result<()> {
        let name = &self.names()[host.index()];
        if self.has_ended() {
            let place = if current::run() != 0 { ", in the run of another test bed" } else { "" };
            let text = format!("{kind} of host `{name}` was used after the end of its run{place}: make a new one on a host of the present run");
            return Err(io::Error::new(io::ErrorKind::ConnectionAborted, text));
        }
        Err(io::Error::new(io::ErrorKind::Unsupported, self.note_misuse(&format!("{kind} of host `{name}`"))))
    }

    /// Notes that another thread uses the value `what`, so that the run fails. Returns the text of the fault.
    pub(super) fn note_misuse(&self, what: &str) -> String {
        let text = format!(
            "{what} was used on another thread{}: sockets of a test bed work only on the thread that runs the test bed. Use sockets in tasks of the run; \
             other threads send their data to these tasks through a channel",
            std::thread::current().name().map_or_else(String::new, |name| format!(" (`{name}`)"))
        );
        self.note_fault(&text);
        text
    }

    /// Notes a fault of the test. The run fails with the first noted fault, after the polled task has returned.
    pub(crate) fn note_fault(&self, text: &str) {
        self.elsewhere.leave(|left| {
            left.misuse.get_or_insert_with(|| text.to_owned());
        });
    }

    /// Returns whether [`Shared::attend`] has something to do.
    #[cfg(feature = "tokio")]
    pub(crate) fn is_left_something(&self) -> bool {
        self.elsewhere.is_any.load(Ordering::Acquire)
    }

    /// Releases a value of the run with `act`: now if this thread may ask the state, otherwise when the task polled by the thread of the run has returned.
    pub(crate) fn release(&self, act: impl FnOnce(&mut Core) + Send + 'static) {
        // A destructor may run on another thread, or in the middle of a borrow of the state. The act then waits.
        if self.may_be_asked() {
            self.with(act);
        } else {
            self.elsewhere.leave(|left| left.acts.push(Box::new(act)));
        }
    }

    /// Performs the acts left by other threads. Called between two polls of tasks.
    ///
    /// # Panics
    ///
    /// If a fault of the test was noted, such as a use of the run on another thread.
    #[inline]
    pub(crate) fn attend(&self) {
        if self.elsewhere.is_any.load(Ordering::Acquire) {
            self.attend_now();
        }
    }

    #[cold]
    #[expect(clippy::panic, reason = "a misuse, and the way out")]
    fn attend_now(&self) {
        // The acts come first: they release values even if the run fails.
        let Left { misuse, acts } = self.elsewhere.take();
        acts.into_iter().for_each(|act| self.with(act));
        if let Some(text) = misuse {
            panic!("{text}");
        }
    }
}
