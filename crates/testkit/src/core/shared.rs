//! How tasks get at the state machine.
//!
//! The state lies with the thread that polls the tasks of a run: each call takes it from there and puts it back, which costs a few moves where a mutex costs two
//! atomic operations. A datagram makes six or seven calls, and they were a quarter of its time. Other threads have no part in a run: see
//! [`elsewhere`](super::elsewhere). Where the watchdog looks at the record of a run while a task has the thread, the state lies behind the mutex all the time.

use std::cell::Cell;
use std::mem::ManuallyDrop;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::task::Waker;
use std::time::Duration;

use cohaptic_units::Instant;

use super::Core;
use super::elsewhere::Elsewhere;
use super::face::Face;
use crate::bed::Names;
use crate::wire::Recorded;

thread_local! {
    /// The state of the run whose tasks this thread polls, unless it is in use. Nothing is to be dropped with the thread, so that no access asks whether that was
    /// done: [`Stay`] has taken the state away before.
    static HERE: Cell<ManuallyDrop<Option<Box<Core>>>> = const { Cell::new(ManuallyDrop::new(None)) };
    /// The run whose state this thread has for itself, at the time of its clock; 0 if there is none. In use or not, no other thread has the state then.
    static AT_HAND: Cell<u64> = const { Cell::new(0) };
}

#[inline]
fn take_here() -> Option<Box<Core>> {
    ManuallyDrop::into_inner(HERE.with(|here| here.replace(ManuallyDrop::new(None))))
}

#[inline]
fn put_here(core: Box<Core>) {
    HERE.with(|here| here.set(ManuallyDrop::new(Some(core))));
}

/// The time, if the state of a run lies here at the time of its clock: for a program that asks. `None` too if it has asked too often; see [`Face::note_call`].
#[inline]
pub(crate) fn asked_here() -> Option<Instant> {
    let core = take_here()?;
    let now = (core.at_hand != 0 && core.face.count_call()).then(|| core.now());
    put_here(core);
    now
}

/// The state machine, and how what belongs to tasks gets at it.
pub(crate) struct Shared {
    /// The state while it does not lie with the thread of the run.
    home: Mutex<Option<Box<Core>>>,
    /// Somebody has put the state into `home`.
    returned: Condvar,
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
    #[cfg_attr(not(feature = "tokio"), expect(dead_code, reason = "there is one clock"))]
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
        let at_hand = if matches!(clock, Clock::Own) { run } else { 0 };
        let home = Mutex::new(Some(Box::new(Core { run, at_hand, ..core })));
        Self {
            home,
            returned: Condvar::new(),
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
        self.lock().now()
    }

    /// Follows tokio's clock, and then not until the guard is dropped. `moved` is where the clock stands, if that is known: to ask it takes four atomic operations.
    #[cfg(feature = "tokio")]
    pub(crate) fn sync(&self, moved: Option<Instant>) -> Synced<'_> {
        if moved.is_none() {
            drop(self.lock());
        }
        self.is_synced.store(true, Ordering::Relaxed);
        let mut core = self.lock();
        core.at_hand = self.run;
        if !core.is_from_home {
            AT_HAND.set(self.run);
        }
        if let Some(moved) = moved.filter(|moved| *moved > core.now()) {
            core.pass_until(moved);
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
            if let Some(core) = self.lock_home().as_deref() {
                return Some(look(core));
            }
            // Nobody wakes the thread that watches: it looks again after a millisecond at least.
            std::thread::park_timeout(Duration::from_millis(1));
        }
        None
    }

    /// The state at this instant. Tasks that are to be woken are woken when the guard is dropped.
    ///
    /// # Panics
    ///
    /// On another thread while the run goes on.
    #[inline]
    pub(crate) fn lock(&self) -> Guard<'_> {
        Guard { core: Some(self.take()), shared: self }
    }

    /// As [`Shared::lock`]; `None` on another thread while the run goes on.
    pub(crate) fn try_lock(&self) -> Option<Guard<'_>> {
        (self.is_at_hand() || self.may_be_had()).then(|| self.lock())
    }

    #[inline(always)]
    fn take(&self) -> Box<Core> {
        match take_here() {
            Some(core) if core.at_hand == self.run => core,
            other => self.fetch(other),
        }
    }

    #[inline(always)]
    fn put(&self, core: Box<Core>) {
        if core.is_from_home || core.woken.is_any() {
            self.give_back(core);
        } else {
            put_here(core);
        }
    }

    /// Asks the state, as [`Shared::lock`] gives it, and gives it back without a call. Nothing has the address of the guard, so that it lies in registers: together this
    /// took more than half off the instructions of a guard.
    #[inline(always)]
    pub(crate) fn with<T>(&self, ask: impl FnOnce(&mut Core) -> T) -> T {
        let mut lent = Lent { core: Some(self.take()), shared: self };
        ask(lent.core.as_mut().expect("it is there until it is given back"))
    }

    /// Takes the state from where others find it, unless it lay here, and lets time pass to that of the clock. The state of another run, which may lie here, stays here.
    #[inline(never)]
    #[expect(clippy::panic, reason = "a misuse, and the way out")]
    fn fetch(&self, here: Option<Box<Core>>) -> Box<Core> {
        #[cfg_attr(not(feature = "tokio"), expect(unused_mut, reason = "only tokio's clock moves by itself"))]
        let mut core = match here {
            Some(core) if core.run == self.run => core,
            other => {
                if let Some(other) = other {
                    put_here(other);
                }
                if !self.may_be_had() {
                    panic!("{}", self.note_misuse("a test bed"));
                }
                let mut core = self.take_home();
                core.is_from_home = true;
                core
            }
        };
        #[cfg(feature = "tokio")]
        if !self.is_synced()
            // By then this thread may have the clock of another test bed.
            && !self.has_ended()
            && let Clock::Tokio { origin } = self.clock
        {
            follow(&mut core, origin);
        }
        core
    }

    /// Waits until nobody else has the state.
    fn take_home(&self) -> Box<Core> {
        let mut home = self.lock_home();
        loop {
            if let Some(core) = home.take() {
                return core;
            }
            home = self.returned.wait(home).unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn lock_home(&self) -> MutexGuard<'_, Option<Box<Core>>> {
        self.home.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// This thread polls the tasks of the run until the guard is dropped.
    pub(crate) fn stay(&self) -> Stay<'_> {
        self.bring_here();
        Stay(self)
    }

    /// The state lies with this thread, unless others look at it.
    fn bring_here(&self) {
        if !self.stays {
            let core = self.take_home();
            AT_HAND.set(core.at_hand);
            put_here(core);
        }
    }

    /// Others may have the state.
    fn bring_home(&self) {
        if let Some(core) = take_here() {
            AT_HAND.set(0);
            self.return_home(core);
        }
    }

    /// Gives the state back, and then wakes the tasks that could not be woken while it was held.
    #[inline(never)]
    fn give_back(&self, mut core: Box<Core>) {
        let woken = core.woken.take();
        if std::mem::take(&mut core.is_from_home) {
            self.return_home(core);
        } else {
            put_here(core);
        }
        woken.into_iter().for_each(Waker::wake);
    }

    fn return_home(&self, core: Box<Core>) {
        *self.lock_home() = Some(core);
        self.returned.notify_one();
    }
}

/// The state lies with this thread until this is dropped.
pub(crate) struct Stay<'a>(&'a Shared);

impl Drop for Stay<'_> {
    fn drop(&mut self) {
        self.0.bring_home();
    }
}

/// The time is that of tokio's clock until this is dropped.
#[cfg(feature = "tokio")]
pub(crate) struct Synced<'a>(&'a Shared);

#[cfg(feature = "tokio")]
impl Drop for Synced<'_> {
    fn drop(&mut self) {
        self.0.is_synced.store(false, Ordering::Relaxed);
        self.0.lock().at_hand = 0;
        AT_HAND.set(0);
    }
}

/// The state, as long as it is held.
pub(crate) struct Guard<'a> {
    core: Option<Box<Core>>,
    shared: &'a Shared,
}

/// Lets time pass up to that of tokio's clock.
#[cfg(feature = "tokio")]
#[inline(never)]
fn follow(core: &mut Core, origin: tokio::time::Instant) {
    // After `block_on` tokio's clock is that of the machine.
    if !core.is_from_home || tokio::runtime::Handle::try_current().is_ok() {
        let now = Instant::ZERO + origin.elapsed();
        if now > core.now() {
            core.pass_until(now);
        }
    }
}

impl std::ops::Deref for Guard<'_> {
    type Target = Core;

    #[inline]
    fn deref(&self) -> &Core {
        self.core.as_ref().expect("it is there until the guard is dropped")
    }
}

impl std::ops::DerefMut for Guard<'_> {
    #[inline]
    fn deref_mut(&mut self) -> &mut Core {
        self.core.as_mut().expect("it is there until the guard is dropped")
    }
}

impl Drop for Guard<'_> {
    fn drop(&mut self) {
        if let Some(core) = self.core.take() {
            self.shared.put(core);
        }
    }
}

/// The state for one question: a [`Guard`] that is compiled into the function that asks.
struct Lent<'a> {
    core: Option<Box<Core>>,
    shared: &'a Shared,
}

impl Drop for Lent<'_> {
    #[inline(always)]
    fn drop(&mut self) {
        if let Some(core) = self.core.take() {
            self.shared.put(core);
        }
    }
}
