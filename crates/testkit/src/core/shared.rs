//! Access of tasks to the state machine.
//!
//! During a run the state lies with the thread that polls the tasks, and each call borrows the state there. [`Shared::with`] is the only way to the state. A
//! borrow takes a few instructions and no atomic operation, where a mutex takes two. Each datagram borrows three times: for sending, for receiving, and for
//! the next wait of the reader. Other threads have no part in a run: see [`elsewhere`](super::elsewhere).
//!
//! Before and after the run the state lies behind the mutex `home`. If other threads read the state during the run, the state stays in `home` all the time: the
//! watchdog reads the record while a task occupies the thread of the run.

use std::cell::{Cell, RefCell};
use std::mem::ManuallyDrop;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::Duration;

use cohaptic_units::Instant;

use super::Core;
use super::elsewhere::Elsewhere;
use super::face::Face;
use crate::names::Names;
use crate::wire::Recorded;

thread_local! {
    /// State of the run whose tasks this thread polls. `ManuallyDrop`, because a thread-local value that needs no drop is accessed without a check whether it
    /// was dropped. [`Stay`] takes the state away before the thread ends.
    static HERE: RefCell<ManuallyDrop<Option<Box<Core>>>> = const { RefCell::new(ManuallyDrop::new(None)) };
    /// Number of the run whose state lies in `HERE` at the time of the run's clock; 0 if there is no such run.
    static AT_HAND: Cell<u64> = const { Cell::new(0) };
}

/// Owner of the state machine. The values of tasks, such as sockets, reach the state through this type.
pub(crate) struct Shared {
    /// The state, while it does not lie with the thread of the run.
    home: Mutex<Option<Box<Core>>>,
    /// Acts left by other threads for the thread of the run.
    pub(super) elsewhere: Elsewhere,
    /// `true` if the run is over. From then on any thread may lock the state, so that a socket or another value of the run can be dropped there.
    has_ended: AtomicBool,
    names: Arc<Names>,
    /// Number of the run, from 1 on.
    run: u64,
    /// `true` if the state stays in `home` during the run, because other threads read the state.
    stays: bool,
    /// `true` if the time of the state is that of the clock, so that the clock need not be asked. Always true with the clock of this crate. Tokio's clock must
    /// be asked, except while the executor of this crate polls tasks: tokio's clock could then be moved only by a task itself.
    #[cfg(feature = "tokio")]
    is_synced: AtomicBool,
    clock: Clock,
    face: Arc<Face>,
    /// `true` if the address of IPv6 comes first when a name is looked up.
    #[cfg(feature = "facade")]
    six_first: bool,
    /// Parts of the system that the test bed stands in for.
    #[cfg(feature = "facade")]
    pub(crate) standard: crate::settings::Standard,
    /// Number of pieces of work on other threads during which time does not pass.
    #[cfg(feature = "facade")]
    pub(super) holds: Arc<std::sync::atomic::AtomicUsize>,
}

/// Source of the time.
pub(crate) enum Clock {
    /// The executor of this crate, which calls [`Core::pass`].
    Own,
    /// Tokio's paused clock.
    #[cfg(feature = "tokio")]
    Tokio {
        /// Reading of tokio's clock at [`Instant::ZERO`].
        origin: tokio::time::Instant,
    },
}

impl Shared {
    pub(crate) fn new(core: Core, clock: Clock) -> Self {
        static RUNS: AtomicU64 = AtomicU64::new(1);
        let run = RUNS.fetch_add(1, Ordering::Relaxed);
        let (face, stays, names) = (Arc::clone(&core.face), core.is_looked_at(), Arc::clone(core.plan.shared_names()));
        #[cfg(feature = "facade")]
        let (six_first, standard) = (core.settings.six_first, core.settings.standard);
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
            #[cfg(feature = "facade")]
            six_first,
            #[cfg(feature = "facade")]
            standard,
            #[cfg(feature = "facade")]
            holds: Arc::default(),
        }
    }

    /// Returns the addresses of the host named `name`, and whether the address of IPv6 comes first. Every thread may ask.
    #[cfg(feature = "facade")]
    pub(crate) fn addresses(&self, name: &str) -> Option<(crate::address::Addresses, bool)> {
        self.face.addresses(name).map(|addresses| (addresses, self.six_first))
    }

    /// Returns the time of the run without letting time pass, so that no task is woken: tokio itself reads a clock of the standard library between a poll and
    /// its driver, when tokio drops a task that is woken.
    #[cfg(feature = "facade")]
    pub(crate) fn any_now(&self) -> Instant {
        self.ahead().unwrap_or_else(|| self.face.now())
    }

    /// Returns the reading of the monotonic clock that stands for [`Instant::ZERO`].
    #[cfg(feature = "facade")]
    pub(crate) fn origin(&self) -> std::time::Instant {
        match self.clock {
            Clock::Own => crate::origin::base(),
            Clock::Tokio { origin } => origin.into_std(),
        }
    }

    /// Returns whether the state lies with this thread, at the time of the clock. Until the executor goes on, only this thread changes the state.
    #[inline]
    pub(crate) fn is_at_hand(&self) -> bool {
        AT_HAND.get() == self.run
    }

    /// Returns the number of the run.
    pub(crate) const fn run(&self) -> u64 {
        self.run
    }

    /// Returns the names of the hosts.
    pub(crate) const fn names(&self) -> &Arc<Names> {
        &self.names
    }

    /// Notes that the run is over and all tasks are dropped.
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

    /// Returns the time of the run.
    #[inline]
    pub(crate) fn now(&self) -> Instant {
        if self.is_synced() { self.face.now() } else { self.asked_now() }
    }

    /// Counts a call of a program, and returns the time of the run. Returns `None` if the clock must be asked, or there are too many calls.
    #[inline]
    pub(crate) fn counted_now(&self) -> Option<Instant> {
        (self.is_synced() && self.face.count_call()).then(|| self.face.now())
    }

    /// Returns the time of the run after asking the clock.
    #[inline(never)]
    fn asked_now(&self) -> Instant {
        self.with(|core| core.now())
    }

    /// Brings the state to the time of tokio's clock. Until the guard is dropped the clock is not asked again. `moved` is the reading of the clock if the
    /// caller knows the reading; asking takes four atomic operations.
    #[cfg(feature = "tokio")]
    pub(crate) fn sync(&self, moved: Option<Instant>) -> Synced<'_> {
        if moved.is_none() {
            self.asked_now();
        }
        self.is_synced.store(true, Ordering::Relaxed);
        // A state that other threads read stays behind the lock and is never at hand.
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

    /// Returns the time for a look from another thread, or `None` if the state is held.
    pub(crate) fn try_now(&self) -> Option<Instant> {
        if self.stays { self.try_home(|core| core.now()) } else { Some(self.face.now()) }
    }

    /// Returns the record of the run so far, or `None` if the state is held.
    pub(crate) fn try_recorded(&self) -> Option<Recorded> {
        if self.stays { self.try_home(Core::recorded) } else { Some(Recorded { ended: self.face.now(), ..Recorded::default() }) }
    }

    /// Tries to lock the state, for about half a second of the wall clock. A loop of tokio takes the state again and again, each time for a moment, on a thread
    /// that may have to wait for a processor.
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
            // No thread wakes the watching thread, so it tries again after a millisecond.
            std::thread::park_timeout(Duration::from_millis(1));
        }
        None
    }

    /// Asks the state, at the present instant. Tasks that the question wakes are woken after the answer, when the borrow has ended.
    ///
    /// # Panics
    ///
    /// On another thread while the run goes on, or if `ask` itself asks the state.
    #[inline(always)]
    pub(crate) fn with<T>(&self, ask: impl FnOnce(&mut Core) -> T) -> T {
        self.ask(if self.is_at_hand() { None } else { Some(self.visit()) }, ask)
    }

    /// Asks the state, which is at hand or here for a visit.
    #[inline(always)]
    pub(super) fn ask<T>(&self, visit: Option<Visit<'_>>, ask: impl FnOnce(&mut Core) -> T) -> T {
        let mut woken = None;
        let outcome = HERE.with_borrow_mut(|here| {
            let core = here.as_mut().expect("the state was brought here");
            let outcome = ask(core);
            woken = core.woken.take();
            outcome
        });
        // The state goes home before the wakers run: a waker may ask the state.
        if let Some(visit) = visit {
            drop(visit);
        }
        if let Some(woken) = woken {
            woken.wake();
        }
        outcome
    }

    /// Returns whether [`Shared::with`] may be called. It may not on another thread while the run goes on, nor while a state answers on this thread.
    pub(super) fn may_be_asked(&self) -> bool {
        (self.is_at_hand() || self.may_be_had()) && HERE.with(|here| here.try_borrow().is_ok())
    }

    /// Like [`Shared::with`], but returns `None` if the state may not be accessed now.
    pub(crate) fn try_with<T>(&self, ask: impl FnOnce(&mut Core) -> T) -> Option<T> {
        self.may_be_asked().then(|| self.with(ask))
    }

    /// Brings the state to this thread for one access, unless the state is on this thread already, and lets time pass until the time of the clock.
    #[inline(never)]
    #[expect(clippy::panic, reason = "a misuse, and the way out")]
    pub(super) fn visit(&self) -> Visit<'_> {
        // The state may lie here and not be at hand: then only tokio's clock may have moved since the last access.
        let is_here = HERE.with_borrow(|here| here.as_ref().is_some_and(|core| core.run == self.run));
        if !is_here && !self.may_be_had() {
            panic!("{}", self.note_misuse("a test bed"));
        }
        let mut visit = Visit { home: None, other: None };
        if !is_here {
            // The lock of `home` is held during the whole visit, so that another thread waits until the state is back.
            let mut home = self.lock_home();
            visit.other = HERE.with_borrow_mut(|here| std::mem::replace(&mut **here, home.take()));
            visit.home = Some(home);
        }
        #[cfg(feature = "tokio")]
        if let Some(now) = self.ahead() {
            HERE.with_borrow_mut(|here| here.as_mut().expect("no other thread has the state").pass_until(now));
        }
        visit
    }

    /// Returns the time of tokio's clock if the clock may be ahead of the state.
    #[cfg(feature = "tokio")]
    fn ahead(&self) -> Option<Instant> {
        let Clock::Tokio { origin } = self.clock else { return None };
        // After the end of the run this thread may have the clock of another test bed, and after `block_on` tokio's clock is that of the machine. Both clocks
        // would move the state to a wrong time.
        let is_running = !self.is_synced() && !self.has_ended() && tokio::runtime::Handle::try_current().is_ok();
        is_running.then(|| Instant::ZERO + origin.elapsed())
    }

    fn lock_home(&self) -> MutexGuard<'_, Option<Box<Core>>> {
        self.home.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Declares that this thread polls the tasks of the run until the guard is dropped. The state lies with this thread for so long, unless other threads read
    /// the state.
    pub(crate) fn stay(&self) -> Stay<'_> {
        if !self.stays {
            let core = self.lock_home().take();
            HERE.with_borrow_mut(|here| **here = core);
            // With tokio's clock the state is at hand only while a guard of `sync` exists.
            if matches!(self.clock, Clock::Own) {
                AT_HAND.set(self.run);
            }
        }
        Stay(self)
    }
}

/// Guard of one access to the state of the run. The state stays on this thread until the guard is dropped.
pub(super) struct Visit<'a> {
    /// Lock of the place to which the state returns; `None` if the state stays here.
    home: Option<MutexGuard<'a, Option<Box<Core>>>>,
    /// State of another run that lay here before. This happens when a task drops a socket of a run that has ended.
    other: Option<Box<Core>>,
}

impl Drop for Visit<'_> {
    #[inline(never)]
    fn drop(&mut self) {
        if let Some(home) = &mut self.home {
            // The state goes home, and the state that lay here before the visit comes back.
            **home = HERE.with_borrow_mut(|here| std::mem::replace(&mut **here, self.other.take()));
        }
    }
}

/// Guard of a run: the state lies with this thread until the guard is dropped.
pub(crate) struct Stay<'a>(&'a Shared);

impl Drop for Stay<'_> {
    fn drop(&mut self) {
        AT_HAND.set(0);
        if let Some(core) = HERE.with_borrow_mut(|here| here.take()) {
            *self.0.lock_home() = Some(core);
        }
    }
}

/// Guard of a time: the state is at the time of tokio's clock until the guard is dropped.
#[cfg(feature = "tokio")]
pub(crate) struct Synced<'a>(&'a Shared);

#[cfg(feature = "tokio")]
impl Drop for Synced<'_> {
    fn drop(&mut self) {
        self.0.is_synced.store(false, Ordering::Relaxed);
        AT_HAND.set(0);
    }
}
