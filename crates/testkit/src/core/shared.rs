//! How tasks get at the state machine.
//!
//! While a run goes on, its state lies with the thread that polls its tasks, and a call borrows the state there: [`Shared::with`] is the only way to it. A borrow takes a few
//! instructions, where a mutex takes two atomic operations, and a datagram borrows three times: to be sent, to be received, and when its reader waits again. Other
//! threads have no part in a run: see [`elsewhere`](super::elsewhere).
//!
//! Before and after the run the state lies behind a mutex, in `home`. The state of a run that others look at stays there all the time: the watchdog looks at the record while a
//! task has the thread.

use std::cell::{Cell, RefCell};
use std::mem::ManuallyDrop;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};
use std::task::Waker;
use std::time::Duration;

use cohaptic_units::Instant;

use super::Core;
use super::elsewhere::Elsewhere;
use super::face::Face;
use crate::names::Names;
use crate::wire::Recorded;

thread_local! {
    /// The state of the run whose tasks this thread polls. Nothing is to be dropped with the thread, so that no access asks whether that was done: [`Stay`] has taken
    /// the state away before.
    static HERE: RefCell<ManuallyDrop<Option<Box<Core>>>> = const { RefCell::new(ManuallyDrop::new(None)) };
    /// The run whose state lies here, at the time of its clock; 0 if there is none.
    static AT_HAND: Cell<u64> = const { Cell::new(0) };
}

/// The state machine, and how what belongs to tasks gets at it.
pub(crate) struct Shared {
    /// The state while it does not lie with the thread of the run.
    home: Mutex<Option<Box<Core>>>,
    /// Acts that other threads have left for the thread of the run.
    pub(super) elsewhere: Elsewhere,
    /// The run is over: a value of the run, such as a socket, may lock the state from any thread to be let go.
    has_ended: AtomicBool,
    names: Arc<Names>,
    /// Which run it is of.
    run: u64,
    /// Whether the state stays in `home`, where other threads see it.
    stays: bool,
    /// Whether the time is that of the clock, so that it need not be asked. Tokio's clock is asked unless the executor of this crate polls: then only a task of its own could
    /// move it.
    #[cfg(feature = "tokio")]
    is_synced: AtomicBool,
    clock: Clock,
    face: Arc<Face>,
}

/// The source of the time.
pub(crate) enum Clock {
    /// The executor of this crate, by [`Core::pass`].
    Own,
    /// Tokio's paused clock.
    #[cfg(feature = "tokio")]
    Tokio {
        /// Its time at [`Instant::ZERO`].
        origin: tokio::time::Instant,
    },
}

impl Shared {
    pub(crate) fn new(core: Core, clock: Clock) -> Self {
        static RUNS: AtomicU64 = AtomicU64::new(1);
        let run = RUNS.fetch_add(1, Ordering::Relaxed);
        let (face, stays, names) = (Arc::clone(&core.face), core.is_looked_at(), Arc::clone(core.plan.shared_names()));
        Self {
            home: Mutex::new(Some(Box::new(Core { run, ..core }))),
            elsewhere: Elsewhere::default(),
            has_ended: AtomicBool::new(false),
            names,
            run,
            stays,
            #[cfg(feature = "tokio")]
            is_synced: AtomicBool::new(matches!(clock, Clock::Own)),
            clock,
            face,
        }
    }

    /// Whether this thread has the state for itself, at the time of its clock: until the executor goes on, nothing happens but by this thread.
    #[inline]
    pub(crate) fn is_at_hand(&self) -> bool {
        AT_HAND.get() == self.run
    }

    /// The number of the run.
    #[inline]
    pub(crate) const fn run(&self) -> u64 {
        self.run
    }

    /// The names of the hosts.
    pub(crate) const fn names(&self) -> &Arc<Names> {
        &self.names
    }

    /// The run is over, and its tasks are gone.
    pub(crate) fn end(&self) {
        self.has_ended.store(true, Ordering::Release);
    }

    pub(super) fn has_ended(&self) -> bool {
        self.has_ended.load(Ordering::Acquire)
    }

    #[inline]
    fn is_synced(&self) -> bool {
        #[cfg(feature = "tokio")]
        return self.is_synced.load(Ordering::Relaxed);
        #[cfg(not(feature = "tokio"))]
        true
    }

    /// The time.
    #[inline]
    pub(crate) fn now(&self) -> Instant {
        if self.is_synced() { self.face.now() } else { self.asked_now() }
    }

    /// The time of a clock that must be asked.
    #[inline(never)]
    fn asked_now(&self) -> Instant {
        self.with(|core| core.now())
    }

    /// Follows tokio's clock, and then not until the guard is dropped. `moved` is where the clock stands, if that is known: to ask it takes four atomic operations.
    #[cfg(feature = "tokio")]
    pub(crate) fn sync(&self, moved: Option<Instant>) -> Synced<'_> {
        if moved.is_none() {
            self.asked_now();
        }
        self.is_synced.store(true, Ordering::Relaxed);
        if !self.stays {
            AT_HAND.set(self.run);
        }
        if let Some(moved) = moved {
            self.with(|core| core.pass_until(moved));
        }
        Synced(self)
    }

    /// See [`Face::note_call`].
    #[inline]
    pub(crate) fn note_call(&self) {
        self.face.note_call();
    }

    /// See [`Face::count_poll`].
    #[cfg(feature = "tokio")]
    pub(crate) fn count_poll(&self) -> Option<u64> {
        self.face.count_poll()
    }

    /// The time, unless the state is held: for a look from another thread.
    pub(crate) fn try_now(&self) -> Option<Instant> {
        if self.stays { self.try_home(|core| core.now()) } else { Some(self.face.now()) }
    }

    /// What was recorded so far, unless the state is held.
    pub(crate) fn try_recorded(&self) -> Option<Recorded> {
        if self.stays { self.try_home(Core::recorded) } else { Some(Recorded { ended: self.face.now(), ..Recorded::default() }) }
    }

    /// Tries for half a second of the wall clock: a loop of tokio takes the state again and again, each time for a moment, on a thread that may have to wait for a processor.
    fn try_home<T>(&self, look: impl Fn(&Core) -> T) -> Option<T> {
        for _ in 0..500 {
            let home = match self.home.try_lock() {
                Ok(home) => Some(home),
                Err(TryLockError::Poisoned(home)) => Some(home.into_inner()),
                Err(TryLockError::WouldBlock) => None,
            };
            if let Some(core) = home.as_ref().and_then(|home| home.as_deref()) {
                return Some(look(core));
            }
            drop(home);
            // Nobody wakes the thread that watches: it looks again after a millisecond at least.
            std::thread::park_timeout(Duration::from_millis(1));
        }
        None
    }

    /// Asks the state at this instant. Tasks that are to be woken are woken when it has answered.
    ///
    /// # Panics
    ///
    /// On another thread while the run goes on; if the state is asked while it answers.
    #[inline(always)]
    pub(crate) fn with<T>(&self, ask: impl FnOnce(&mut Core) -> T) -> T {
        self.ask(if self.is_at_hand() { None } else { Some(self.visit()) }, ask)
    }

    /// Asks the state, which is at hand or has come for a visit.
    #[inline(always)]
    pub(super) fn ask<T>(&self, visit: Option<Visit<'_>>, ask: impl FnOnce(&mut Core) -> T) -> T {
        let (outcome, woken) = HERE.with_borrow_mut(|here| {
            let core = here.as_mut().expect("it was brought here");
            (ask(core), core.woken.take())
        });
        if let Some(visit) = visit {
            drop(visit);
        }
        if let Some(woken) = woken {
            wake(woken);
        }
        outcome
    }

    /// Whether [`Shared::with`] may be called: not on another thread while the run goes on, nor while a state answers on this one.
    pub(super) fn may_be_asked(&self) -> bool {
        (self.is_at_hand() || self.may_be_had()) && HERE.with(|here| here.try_borrow().is_ok())
    }

    /// As [`Shared::with`]; `None` if it may not be called.
    pub(crate) fn try_with<T>(&self, ask: impl FnOnce(&mut Core) -> T) -> Option<T> {
        self.may_be_asked().then(|| self.with(ask))
    }

    /// Brings the state here for one question, unless it lies here, and lets time pass to that of the clock.
    #[inline(never)]
    #[expect(clippy::panic, reason = "a misuse, and the way out")]
    pub(super) fn visit(&self) -> Visit<'_> {
        let is_here = HERE.with_borrow(|here| here.as_ref().is_some_and(|core| core.run == self.run));
        if !is_here && !self.may_be_had() {
            panic!("{}", self.note_misuse("a test bed"));
        }
        let mut visit = Visit { home: None, other: None };
        if !is_here {
            let mut home = self.lock_home();
            visit.other = HERE.with_borrow_mut(|here| std::mem::replace(&mut **here, home.take()));
            visit.home = Some(home);
        }
        HERE.with_borrow_mut(|here| self.follow(here.as_mut().expect("no other thread has it")));
        visit
    }

    /// Lets time pass up to that of tokio's clock, unless the state is at its time.
    #[cfg_attr(not(feature = "tokio"), expect(unused_variables, reason = "no other clock moves by itself"))]
    fn follow(&self, core: &mut Core) {
        match self.clock {
            Clock::Own => {}
            #[cfg(feature = "tokio")]
            Clock::Tokio { origin } => {
                // By its end this thread may have the clock of another test bed, and after `block_on` tokio's clock is that of the machine.
                if !self.is_synced() && !self.has_ended() && tokio::runtime::Handle::try_current().is_ok() {
                    core.pass_until(Instant::ZERO + origin.elapsed());
                }
            }
        }
    }

    fn lock_home(&self) -> MutexGuard<'_, Option<Box<Core>>> {
        self.home.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// This thread polls the tasks of the run until the guard is dropped: the state lies with it, unless others look at the state.
    pub(crate) fn stay(&self) -> Stay<'_> {
        if !self.stays {
            let core = self.lock_home().take();
            HERE.with_borrow_mut(|here| **here = core);
            if matches!(self.clock, Clock::Own) {
                AT_HAND.set(self.run);
            }
        }
        Stay(self)
    }
}

/// Wakes tasks that could not be woken while the state was asked.
#[cold]
#[inline(never)]
fn wake(woken: Vec<Waker>) {
    woken.into_iter().for_each(Waker::wake);
}

/// The state is here for one question, until this is dropped.
pub(super) struct Visit<'a> {
    /// Where the state goes back to; `None` if it stays here.
    home: Option<MutexGuard<'a, Option<Box<Core>>>>,
    /// The state of another run, which lay here: a task may drop a socket of a run that has ended.
    other: Option<Box<Core>>,
}

impl Drop for Visit<'_> {
    #[inline(never)]
    fn drop(&mut self) {
        if let Some(home) = &mut self.home {
            **home = HERE.with_borrow_mut(|here| std::mem::replace(&mut **here, self.other.take()));
        }
    }
}

/// The state lies with this thread until this is dropped.
pub(crate) struct Stay<'a>(&'a Shared);

impl Drop for Stay<'_> {
    fn drop(&mut self) {
        AT_HAND.set(0);
        if let Some(core) = HERE.with_borrow_mut(|here| here.take()) {
            *self.0.lock_home() = Some(core);
        }
    }
}

/// The time is that of tokio's clock until this is dropped.
#[cfg(feature = "tokio")]
pub(crate) struct Synced<'a>(&'a Shared);

#[cfg(feature = "tokio")]
impl Drop for Synced<'_> {
    fn drop(&mut self) {
        self.0.is_synced.store(false, Ordering::Relaxed);
        AT_HAND.set(0);
    }
}
