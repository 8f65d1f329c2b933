//! The executor of this crate: one thread, and a clock that jumps to the next event, to the nanosecond.
//!
//! All tasks that can go on are polled, in the order in which they were woken, until none can. Then time jumps to the next arrival or timer. At one instant
//! packets arrive first, then timers go off, in the order in which they were set.

use std::cell::{Cell, RefCell};
use std::ops::Deref;
use std::panic::Location;
use std::rc::Rc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Wake, Waker};

use cohaptic_units::Instant;
use cohaptic_units::print::Seconds;

use super::limits::{goes_on, nothing_will_happen};
use super::recorder::Recorder;
use crate::context::Running;
use crate::core::{Clock, Core, Shared};
use crate::task::{Spawner, Task, Tasks};
use crate::watch::Watched;
use crate::wire::Recorded;

thread_local! {
    static HERE: Here = const { Here { executor: Cell::new(0), ready: RefCell::new(Vec::new()), main: RefCell::new(None), waits: Cell::new(false) } };
}

/// What the executor that runs on a thread has there.
struct Here {
    /// Its number.
    executor: Cell<u64>,
    /// The tasks that can go on.
    ready: RefCell<Vec<usize>>,
    /// Wakes the executor, where it is itself a task of another one.
    main: RefCell<Option<Waker>>,
    /// Whether it waits to be woken.
    waits: Cell<bool>,
}

impl Here {
    #[inline]
    fn push(&self, number: usize) {
        self.ready.borrow_mut().push(number);
        if self.waits.get() {
            self.wake_main();
        }
    }

    #[inline(never)]
    fn wake_main(&self) {
        self.waits.set(false);
        if let Some(main) = &*self.main.borrow() {
            main.wake_by_ref();
        }
    }
}

/// Whether a task can go on of the executor that runs on this thread.
#[cfg(feature = "tokio")]
pub(crate) fn is_any_ready() -> bool {
    HERE.with(|here| !here.ready.borrow().is_empty())
}

/// The tasks that other threads have woken.
#[derive(Default)]
struct Elsewhere {
    is_any: AtomicBool,
    woken: Mutex<WokenElsewhere>,
}

#[derive(Default)]
struct WokenElsewhere {
    numbers: Vec<usize>,
    /// Wakes the executor, where it is itself a task of another one.
    main: Option<Waker>,
}

impl Elsewhere {
    fn lock(&self) -> MutexGuard<'_, WokenElsewhere> {
        self.woken.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Where a task is.
struct Place {
    number: usize,
    is_queued: AtomicBool,
    executor: u64,
    elsewhere: Arc<Elsewhere>,
}

impl Wake for Place {
    fn wake(self: Arc<Self>) {
        Self::wake_by_ref(&self);
    }

    #[inline]
    fn wake_by_ref(self: &Arc<Self>) {
        let is_here = HERE.try_with(|here| {
            let is_here = here.executor.get() == self.executor;
            // What another thread does meanwhile to the mark polls the task once in vain, and not too seldom.
            if is_here && !self.is_queued.load(Ordering::Relaxed) {
                self.is_queued.store(true, Ordering::Relaxed);
                here.push(self.number);
            }
            is_here
        });
        if is_here != Ok(true) {
            self.wake_elsewhere();
        }
    }
}

impl Place {
    /// Wakes from another thread. It is a function of its own, so that a task that is woken from this one saves no registers for it.
    #[inline(never)]
    fn wake_elsewhere(&self) {
        if self.is_queued.swap(true, Ordering::Relaxed) {
            return;
        }
        let main = {
            let mut woken = self.elsewhere.lock();
            woken.numbers.push(self.number);
            self.elsewhere.is_any.store(true, Ordering::Relaxed);
            woken.main.clone()
        };
        main.into_iter().for_each(Waker::wake);
    }
}

/// The executor.
#[derive(Clone)]
pub(crate) struct Executor(Rc<Inner>);

pub(crate) struct Inner {
    number: u64,
    elsewhere: Arc<Elsewhere>,
    slots: RefCell<Vec<Option<Rc<Slot>>>>,
    free: RefCell<Vec<usize>>,
    last: Cell<usize>,
    /// An empty one, for its memory.
    #[cfg(feature = "tokio")]
    batch: Cell<Batch>,
}

/// The tasks that are polled before those that are woken meanwhile. They are taken from the thread at once: to look there for each took a third of a poll's instructions.
#[derive(Default)]
struct Batch {
    numbers: Vec<usize>,
    /// The place of the next one.
    next: usize,
}

impl Batch {
    #[inline]
    fn take(&mut self) -> Option<usize> {
        let number = *self.numbers.get(self.next)?;
        self.next += 1;
        Some(number)
    }

    /// Gives back those that were not polled: they come first again, and [`is_any_ready`] sees them.
    #[cfg(feature = "tokio")]
    fn give_back(&mut self) {
        let left = self.numbers.drain(..).skip(std::mem::take(&mut self.next));
        HERE.with(|here| here.ready.borrow_mut().splice(..0, left).for_each(drop));
    }
}

impl Deref for Executor {
    type Target = Inner;

    #[inline]
    fn deref(&self) -> &Inner {
        &self.0
    }
}

struct Slot {
    task: Rc<Task>,
    place: Arc<Place>,
    waker: Waker,
}

impl Spawner for Executor {
    fn start(&self, task: Rc<Task>) {
        let mut slots = self.slots.borrow_mut();
        let number = self.free.borrow_mut().pop().unwrap_or_else(|| {
            slots.push(None);
            slots.len() - 1
        });
        let place = self.place(number);
        let waker = Waker::from(Arc::clone(&place));
        waker.wake_by_ref();
        task.is_woken_by(waker.clone());
        slots[number] = Some(Rc::new(Slot { task, place, waker }));
    }
}

impl Executor {
    pub(crate) fn new() -> Self {
        static NUMBERS: AtomicU64 = AtomicU64::new(1);
        let number = NUMBERS.fetch_add(1, Ordering::Relaxed);
        Self(Rc::new(Inner {
            number,
            elsewhere: Arc::default(),
            slots: RefCell::default(),
            free: RefCell::default(),
            last: Cell::default(),
            #[cfg(feature = "tokio")]
            batch: Cell::default(),
        }))
    }

    fn place(&self, number: usize) -> Arc<Place> {
        Arc::new(Place { number, is_queued: AtomicBool::new(false), executor: self.number, elsewhere: Arc::clone(&self.elsewhere) })
    }

    /// A waker as tasks have: it only notes that a task goes on, and calls nothing.
    pub(crate) fn waker(&self) -> Waker {
        Waker::from(self.place(usize::MAX))
    }

    /// Polls tasks and lets time pass until `is_over`, which is asked when a task is over.
    ///
    /// # Panics
    ///
    /// If nothing will ever happen any more, if time cannot pass because tasks are polled again and again, or at a limit of the run.
    pub(crate) fn run(&self, shared: &Shared, tasks: &Tasks, is_over: impl Fn() -> bool) {
        let (patience, limits) = shared.with(|core| (core.settings.patience, core.settings.limits));
        let (mut polls, mut steps, mut batch) = (0, 0, Batch::default());
        let (mut now, until) = (shared.now(), limits.until());
        self.begin(None);
        loop {
            // A task that is polled tells by itself that the executor does not stand.
            if let Some(polled) = self.poll_one(&mut batch, now) {
                shared.attend();
                polls += 1;
                if polls > patience {
                    self.give_up(shared, polls);
                }
                if polled.is_ready() && is_over() {
                    return;
                }
                continue;
            }
            tasks.turns();
            let passed = shared.with(|core| {
                let next = core.next_event()?;
                if next > now {
                    steps += std::mem::take(&mut polls);
                    if next > until || steps > limits.steps {
                        return Some(Err(limits.reached(steps)));
                    }
                }
                core.pass(next);
                Some(Ok(core.now()))
            });
            now = match passed {
                None => nothing_will_happen(shared, tasks),
                Some(Err(limit)) => goes_on(shared, tasks, limit),
                Some(Ok(now)) => now,
            };
        }
    }

    /// Runs on this thread from now on. `main` wakes it, where it is itself a task of another executor.
    pub(crate) fn begin(&self, main: Option<&Waker>) {
        HERE.with(|here| {
            if here.executor.replace(self.number) != self.number {
                here.ready.borrow_mut().clear();
            }
            here.main.replace(main.cloned());
            here.waits.set(false);
        });
        if let Some(main) = main {
            self.elsewhere.lock().main = Some(main.clone());
        }
    }

    /// Polls tasks until none can go on, or `goes_on` says no after one of them; says whether none can.
    #[cfg(feature = "tokio")]
    pub(crate) fn run_some(&self, now: Instant, mut goes_on: impl FnMut() -> bool) -> bool {
        let mut batch = self.batch.take();
        let mut all_wait = true;
        while self.poll_one(&mut batch, now).is_some() {
            if !goes_on() {
                batch.give_back();
                all_wait = false;
                break;
            }
        }
        self.batch.set(batch);
        if all_wait {
            HERE.with(|here| here.waits.set(true));
        }
        all_wait
    }

    /// The task that was polled last, unless it is over.
    pub(crate) fn last(&self) -> Option<Rc<Task>> {
        self.slots.borrow().get(self.last.get()).and_then(Option::as_ref).map(|slot| Rc::clone(&slot.task))
    }

    /// Polls the task that has waited longest, if there is one; says whether it is over.
    #[inline(always)]
    fn poll_one(&self, batch: &mut Batch, now: Instant) -> Option<Poll<()>> {
        let number = batch.take().or_else(|| self.next_batch(batch))?;
        self.last.set(number);
        // The task may start others while it is polled, which get other places.
        let Some(slot) = self.slots.borrow().get(number).and_then(Clone::clone) else { return Some(Poll::Pending) };
        slot.place.is_queued.store(false, Ordering::Relaxed);
        // A place that was given to another task wakes that one in vain, once.
        let polled = slot.task.poll(now, &mut Context::from_waker(&slot.waker));
        if polled.is_ready() {
            self.forget(number);
        }
        Some(polled)
    }

    /// A task is over: its place is free.
    #[inline(never)]
    fn forget(&self, number: usize) {
        let over = self.slots.borrow_mut()[number].take();
        drop(over);
        self.free.borrow_mut().push(number);
    }

    /// Takes all tasks that were woken since this was last asked, and gives the first.
    #[inline(never)]
    fn next_batch(&self, batch: &mut Batch) -> Option<usize> {
        batch.numbers.clear();
        batch.next = 0;
        HERE.with(|here| std::mem::swap(&mut batch.numbers, &mut here.ready.borrow_mut()));
        if self.elsewhere.is_any.load(Ordering::Relaxed) {
            let mut woken = self.elsewhere.lock();
            self.elsewhere.is_any.store(false, Ordering::Relaxed);
            batch.numbers.append(&mut woken.numbers);
        }
        batch.take()
    }

    /// Gives up, because time does not pass.
    #[cold]
    fn give_up(&self, shared: &Shared, polls: u64) -> ! {
        time_stands_still(shared, polls, self.last().as_deref())
    }
}

/// Runs a program on the executor of this crate.
pub(crate) fn run<T, F>(
    core: Core,
    hosts: usize,
    program: impl FnOnce(Arc<Shared>) -> F,
    origin: &'static Location<'static>,
    watched: &Watched,
    recorded: &mut Option<Recorded>,
) -> T
where
    F: Future<Output = T> + 'static,
    T: 'static,
{
    let executor = Executor::new();
    let mut core = core;
    core.woken.trust(&executor.waker());
    let shared = Arc::new(Shared::new(core, Clock::Own));
    let tasks = Rc::new(Tasks::new(Box::new(executor.clone()), hosts, Arc::clone(&watched.pulse)));
    watched.is_of(&shared);
    let _entered = Running { shared: Arc::clone(&shared), tasks: Rc::clone(&tasks) }.enter();
    // The run has ended when the recorder is dropped: the state is back by then, where other threads find it.
    let _recorder = Recorder { shared: Arc::clone(&shared), tasks: Rc::clone(&tasks), recorded };
    // After it is known that no other one runs on this thread.
    let _here = shared.stay();
    let outcome = Rc::new(RefCell::new(None));
    // In a box: a program may hold arrays, and without optimisation each call that a future is handed to has a copy of it on the stack.
    let (future, slot) = (Box::pin(program(Arc::clone(&shared))), Rc::clone(&outcome));
    let _main = tasks.spawn(None, origin, async move {
        let came_out = future.await;
        *slot.borrow_mut() = Some(came_out);
    });
    executor.run(&shared, &tasks, || outcome.borrow().is_some());
    outcome.take().expect("the executor runs until the program is over")
}

/// Tells that time does not pass, because tasks are polled again and again.
///
/// # Panics
///
/// Always.
#[expect(clippy::panic, reason = "time cannot pass; says why, and the way out")]
pub(crate) fn time_stands_still(shared: &Shared, polls: u64, last: Option<&Task>) -> ! {
    let now = shared.with(|core| core.now());
    let who = last.map_or_else(|| "a task that is over now".to_owned(), |task| task.words(shared.names()));
    panic!(
        "time stands still at {} s: tasks were polled {polls} times without waiting for it to pass, {who} the last. It wakes itself, or others, again and again: let \
         it wait for a socket or a `sleep`",
        Seconds(now)
    );
}
