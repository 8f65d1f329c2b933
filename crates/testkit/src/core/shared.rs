//! Access of tasks to the state machine.
//!
//! During a run the state lies with the thread that polls the tasks. Each call takes the state out of its place there, and puts the state back.
//! [`Shared::with`] is the only way to the state. A call takes a few instructions and no atomic operation, where a mutex takes two. Each datagram asks three
//! times: for sending, for receiving, and for the next wait of the reader. Other threads have no part in a run: see [`elsewhere`](super::elsewhere).
//!
//! Before and after the run the state lies behind the mutex `home`. If other threads read the state during the run, the state stays in `home` all the time: the
//! watchdog reads the record while a task occupies the thread of the run.

use std::cell::Cell;
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
    /// State of the run whose tasks this thread polls; `None` while a state answers on this thread. `ManuallyDrop`, because a thread-local value that needs no
    /// drop is accessed without a check whether it was dropped. [`Stay`] takes the state away before the thread ends.
    static HERE: Cell<ManuallyDrop<Option<Box<Core>>>> = const { Cell::new(ManuallyDrop::new(None)) };
    /// `true` if a state lies in `HERE`, or was taken out of `HERE` or of its home to answer on this thread.
    static LIES: Cell<bool> = const { Cell::new(false) };
}

#[inline(always)]
fn take_here() -> Option<Box<Core>> {
    ManuallyDrop::into_inner(HERE.take())
}

#[inline(always)]
fn put_here(core: Option<Box<Core>>) {
    HERE.set(ManuallyDrop::new(core));
}

/// Calls `look` on the state that lies with this thread and does not answer at present, if any.
#[inline(always)]
fn look_here<T>(look: impl FnOnce(Option<&mut Core>) -> T) -> T {
    let mut core = take_here();
    let seen = look(core.as_deref_mut());
    put_here(core);
    seen
}

/// Counts a call of a program, and returns the time of the run whose state is at hand. Returns `None` if no state is at hand, or there are too many calls.
#[inline]
pub(crate) fn counted_now() -> Option<Instant> {
    look_here(|core| core.filter(|core| core.at_hand != 0 && core.face.count_call()).map(|core| core.now()))
}

/// Returns whether a state answers on this thread.
fn is_asked() -> bool {
    LIES.get() && look_here(|core| core.is_none())
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
        look_here(|core| {
            if let Some(core) = core {
                core.at_hand = self.run;
            }
        });
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

    /// Asks the state, at the present instant. Tasks that the question wakes are woken after the answer, when the state is back in its place.
    ///
    /// # Panics
    ///
    /// On another thread while the run goes on, or if `ask` itself asks the state.
    #[inline(always)]
    pub(crate) fn with<T>(&self, ask: impl FnOnce(&mut Core) -> T) -> T {
        self.at_hand().unwrap_or_else(|| self.visit()).answer(ask)
    }

    /// Takes the state for one answer, if the state lies with this thread at the time of the clock. Until the executor goes on, only this thread changes the
    /// state.
    #[inline(always)]
    pub(super) fn at_hand(&self) -> Option<Asked<'_>> {
        match take_here() {
            Some(core) if core.at_hand == self.run => Some(Asked { core: Some(core), visit: None }),
            other => {
                put_here(other);
                None
            }
        }
    }

    /// Returns whether [`Shared::with`] may be called. It may not on another thread while the run goes on, nor while a state answers on this thread.
    pub(super) fn may_be_asked(&self) -> bool {
        self.may_be_had() && !is_asked()
    }

    /// Like [`Shared::with`], but returns `None` if the state may not be accessed now.
    pub(crate) fn try_with<T>(&self, ask: impl FnOnce(&mut Core) -> T) -> Option<T> {
        self.may_be_asked().then(|| self.with(ask))
    }

    /// Takes the state for one answer where the state is not at hand, and lets time pass until the time of the clock.
    #[inline(never)]
    #[expect(clippy::panic, reason = "a misuse, and the way out")]
    pub(super) fn visit(&self) -> Asked<'_> {
        assert!(!is_asked(), "the state of a run is asked while a state answers on this thread");
        // The state may lie here and not be at hand: then only tokio's clock may have moved since the last access.
        let is_here = look_here(|core| core.is_some_and(|core| core.run == self.run));
        if !is_here && !self.may_be_had() {
            panic!("{}", self.note_misuse("a test bed"));
        }
        #[cfg(feature = "tokio")]
        let ahead = self.ahead();
        let (core, visit) = if is_here {
            (take_here(), None)
        } else {
            // The lock of `home` is held during the whole visit, so that another thread waits until the state is back.
            let mut home = self.lock_home();
            (home.take(), Some(Visit { home, other: take_here(), lies: LIES.replace(true) }))
        };
        let mut asked = Asked { core, visit };
        let core = asked.core();
        core.woken.is_work_left = true;
        #[cfg(feature = "tokio")]
        if let Some(now) = ahead {
            core.pass_until(now);
        }
        asked
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
            let mut core = self.lock_home().take();
            // With tokio's clock the state is at hand only while a guard of `sync` exists.
            if let Some(core) = &mut core
                && matches!(self.clock, Clock::Own)
            {
                core.at_hand = self.run;
            }
            put_here(core);
            LIES.set(true);
        }
        Stay(self)
    }
}

/// State of a run that was taken out of its place for one answer. Its place is empty meanwhile, so that a second question of the same thread finds no state.
pub(super) struct Asked<'a> {
    /// The state, until the end of the answer.
    core: Option<Box<Core>>,
    /// `None` if the state was taken out of `HERE`.
    visit: Option<Visit<'a>>,
}

/// Visit of a state that lies at home.
struct Visit<'a> {
    /// Lock of the home, to which the state returns.
    home: MutexGuard<'a, Option<Box<Core>>>,
    /// State of another run that lay here before. This happens when a task drops a socket of a run that has ended.
    other: Option<Box<Core>>,
    /// Value of `LIES` before the visit.
    lies: bool,
}

impl Asked<'_> {
    #[inline(always)]
    fn core(&mut self) -> &mut Core {
        self.core.as_mut().expect("the state is there until the end of the answer")
    }

    /// Asks the state, puts the state back, and calls the wakers of the tasks that the question woke.
    #[inline(always)]
    pub(super) fn answer<T>(mut self, ask: impl FnOnce(&mut Core) -> T) -> T {
        let core = self.core();
        let outcome = ask(core);
        if core.woken.is_work_left {
            self.end();
        } else {
            // The mark is set for each visit, so this state lay here. The usual end of an answer is this one check.
            put_here(self.core.take());
            std::mem::forget(self);
        }
        outcome
    }

    #[inline(never)]
    fn end(mut self) {
        let woken = self.core().woken.take();
        // The state goes back before the wakers run: a waker may ask the state.
        drop(self);
        woken.into_iter().for_each(Waker::wake);
    }
}

impl Drop for Asked<'_> {
    /// Puts the state back, also after a panic of the question.
    #[inline(never)]
    fn drop(&mut self) {
        let core = self.core.take();
        match self.visit.take() {
            None => put_here(core),
            Some(Visit { mut home, other, lies }) => {
                // The state goes home, and the state that lay here before the visit comes back.
                *home = core;
                put_here(other);
                LIES.set(lies);
            }
        }
    }
}

/// Guard of a run: the state lies with this thread until the guard is dropped.
pub(crate) struct Stay<'a>(&'a Shared);

impl Drop for Stay<'_> {
    fn drop(&mut self) {
        LIES.set(false);
        if let Some(mut core) = take_here() {
            core.at_hand = 0;
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
        look_here(|core| {
            if let Some(core) = core {
                core.at_hand = 0;
            }
        });
    }
}
