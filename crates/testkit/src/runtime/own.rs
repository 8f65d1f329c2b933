//! Executor of this crate: one thread, and a clock that jumps to the next event, to the nanosecond.
//!
//! The executor polls all runnable tasks, in the order of waking, until no task is runnable. Then time jumps to the next arrival or timer. At
//! one instant packets arrive first, then timers go off, in the order of setting.

use std::cell::{Cell, RefCell};
use std::mem::ManuallyDrop;
use std::ops::Deref;
use std::panic::Location;
use std::rc::Rc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Wake, Waker};

use cohaptic_units::Instant;
use cohaptic_units::print::Seconds;

use super::entered::enter;
use super::limits::{goes_on, nothing_will_happen};
use super::recorder::Recorder;
use crate::core::{Clock, Core, Shared};
use crate::task::{Program, Spawner, Task, Tasks};
use crate::watch::Watched;
use crate::wire::Recorded;

thread_local! {
    /// `ManuallyDrop`, because a thread-local value that needs no drop is accessed without a check whether it was dropped. [`Inner`] empties the value when the
    /// executor is dropped.
    static HERE: ManuallyDrop<Here> = const {
        ManuallyDrop::new(Here { executor: Cell::new(0), ready: RefCell::new(Vec::new()), main: RefCell::new(None), waits: Cell::new(false) })
    };
}

/// State of a thread for the executor that runs on the thread.
struct Here {
    /// Number of the executor; 0 if none has run here.
    executor: Cell<u64>,
    /// Indices of the runnable tasks, in the order of waking.
    ready: RefCell<Vec<usize>>,
    /// Wakes the executor if the executor is itself a task of another executor.
    main: RefCell<Option<Waker>>,
    /// `true` if the executor waits to be woken.
    waits: Cell<bool>,
}

impl Here {
    #[inline]
    fn push(&self, number: usize) {
        let mut ready = self.ready.borrow_mut();
        // A queue that must grow is left to another function, so that waking saves no registers.
        if ready.len() == ready.capacity() {
            drop(ready);
            return self.push_growing(number);
        }
        ready.push(number);
        drop(ready);
        if self.waits.get() {
            self.wake_main();
        }
    }

    #[inline(never)]
    fn push_growing(&self, number: usize) {
        self.ready.borrow_mut().reserve(1);
        self.push(number);
    }

    #[inline(never)]
    fn wake_main(&self) {
        self.waits.set(false);
        if let Some(main) = &*self.main.borrow() {
            main.wake_by_ref();
        }
    }
}

/// Returns whether a task of the executor of this thread can go on.
#[cfg(feature = "tokio")]
pub(crate) fn is_any_ready() -> bool {
    HERE.with(|here| !here.ready.borrow().is_empty())
}

/// Tasks woken by other threads.
#[derive(Default)]
struct Elsewhere {
    /// `true` if `woken` may hold tasks. Read without the lock.
    is_any: AtomicBool,
    woken: Mutex<WokenElsewhere>,
}

#[derive(Default)]
struct WokenElsewhere {
    /// Indices of the woken tasks.
    numbers: Vec<usize>,
    /// Wakes the executor if the executor is itself a task of another executor.
    main: Option<Waker>,
}

impl Elsewhere {
    fn lock(&self) -> MutexGuard<'_, WokenElsewhere> {
        self.woken.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Waker of a task: the index of the task, and the executor to which the task belongs.
struct Place {
    number: usize,
    /// `true` if the task is in a queue already. A task is queued at most once.
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
        HERE.with(|here| {
            if here.executor.get() != self.executor {
                return self.wake_elsewhere();
            }
            // Another thread may set the mark between these two lines. The task is then polled once too often; no wake-up is lost.
            if !self.is_queued.load(Ordering::Relaxed) {
                self.is_queued.store(true, Ordering::Relaxed);
                here.push(self.number);
            }
        });
    }
}

impl Place {
    /// Wakes the task from another thread. Not inlined, so that waking on the thread of the executor saves no registers for this path.
    #[inline(never)]
    fn wake_elsewhere(&self) {
        // The task is in a queue and has not been polled since, so the coming poll also sees the reason of this wake.
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

/// Executor with its tasks.
#[derive(Clone)]
pub(crate) struct Executor(Rc<Inner>);

pub(crate) struct Inner {
    /// Number of the executor, from 1 on.
    number: u64,
    elsewhere: Arc<Elsewhere>,
    /// Tasks, by index; `None` at free indices.
    slots: RefCell<Vec<Option<Rc<Slot>>>>,
    /// Free indices of `slots`.
    free: RefCell<Vec<usize>>,
    /// Index of the task that was polled last.
    last: Cell<usize>,
    /// Empty batch, kept for its memory.
    #[cfg(feature = "tokio")]
    batch: Cell<Batch>,
}

/// Tasks to poll before the tasks woken meanwhile. The batch is taken out of the thread-local queue as a whole, so that most polls do not touch the queue.
#[derive(Default)]
struct Batch {
    numbers: Vec<usize>,
    /// Index in `numbers` of the next task.
    next: usize,
}

impl Batch {
    #[inline]
    fn take(&mut self) -> Option<usize> {
        let number = *self.numbers.get(self.next)?;
        self.next += 1;
        Some(number)
    }

    /// Puts the tasks that were not polled back to the front of the queue, where [`is_any_ready`] sees them.
    #[cfg(feature = "tokio")]
    fn give_back(&mut self) {
        let left = self.numbers.drain(..).skip(std::mem::take(&mut self.next));
        HERE.with(|here| here.ready.borrow_mut().splice(..0, left).for_each(drop));
    }
}

impl Deref for Executor {
    type Target = Inner;

    fn deref(&self) -> &Inner {
        &self.0
    }
}

impl Drop for Inner {
    fn drop(&mut self) {
        HERE.with(|here| {
            // A later executor may have taken the place of this executor.
            if here.executor.get() == self.number {
                here.executor.set(0);
                here.waits.set(false);
                // Tasks and main waker are dropped without a borrow: a foreign waker may have a destructor that wakes.
                drop((here.ready.take(), here.main.take()));
            }
        });
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
        // The first wake puts the task into the queue, so a new task is polled after the tasks that are runnable already.
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

    /// Returns a waker of the same kind as the wakers of tasks. Such a waker only notes a task, and calls no foreign code.
    pub(crate) fn waker(&self) -> Waker {
        Waker::from(self.place(usize::MAX))
    }

    /// Polls tasks and lets time pass until `is_over` returns true. `is_over` is called whenever a task is over.
    ///
    /// # Panics
    ///
    /// If nothing will ever happen any more, if time cannot pass because tasks are polled again and again, or if a limit of the run is reached.
    pub(crate) fn run(&self, shared: &Shared, tasks: &Tasks, is_over: impl Fn() -> bool) {
        let (patience, limits) = shared.with(|core| (core.settings.patience, core.settings.limits));
        let (mut polls, mut steps, mut batch) = (0, 0, Batch::default());
        let (mut now, until) = (shared.now(), limits.until());
        self.begin(None);
        loop {
            // Each poll reports to the watchdog by itself. Where no task was polled, `tasks.turns` reports below.
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
                // Polls at one instant count against the patience, and become steps when time passes. Events at the present instant are no progress of time.
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
                None => nothing_will_happen(shared, tasks, now),
                Some(Err(limit)) => goes_on(shared, tasks, limit),
                Some(Ok(now)) => now,
            };
        }
    }

    /// Makes this executor the executor of this thread. `main` wakes the executor if the executor is itself a task of another executor.
    pub(crate) fn begin(&self, main: Option<&Waker>) {
        HERE.with(|here| {
            // Tasks of another executor, such as of an earlier run, are of no use here.
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

    /// Polls tasks until none can go on, or until `goes_on` returns false after a poll. Returns whether no task can go on.
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
        // From now on a wake must also wake the task of the executor, because nobody looks at the queue before.
        if all_wait {
            HERE.with(|here| here.waits.set(true));
        }
        all_wait
    }

    /// Returns the last polled task, or `None` if the task is over.
    pub(crate) fn last(&self) -> Option<Rc<Task>> {
        self.slots.borrow().get(self.last.get()).and_then(Option::as_ref).map(|slot| Rc::clone(&slot.task))
    }

    /// Polls the first task of the batch. Returns whether the task is over, or `None` if no task can go on.
    #[inline(always)]
    fn poll_one(&self, batch: &mut Batch, now: Instant) -> Option<Poll<()>> {
        let number = match batch.take() {
            Some(number) => number,
            None => self.next_batch(batch)?,
        };
        self.last.set(number);
        // The borrow ends before the poll: the polled task may start further tasks, which get other indices.
        let Some(slot) = self.slots.borrow().get(number).and_then(Clone::clone) else { return Some(Poll::Pending) };
        slot.place.is_queued.store(false, Ordering::Relaxed);
        // A waker of an earlier task with the same index wakes the present task once in vain.
        let polled = slot.task.poll(now, &mut Context::from_waker(&slot.waker));
        if polled.is_ready() {
            self.forget(number);
        }
        Some(polled)
    }

    /// Removes a task that is over. The index is free afterwards.
    #[inline(never)]
    fn forget(&self, number: usize) {
        let over = self.slots.borrow_mut()[number].take();
        // Dropped after the borrow has ended: dropping a task may start further tasks.
        drop(over);
        self.free.borrow_mut().push(number);
    }

    /// Takes all tasks that were woken since the last call. Returns the first task.
    #[inline(never)]
    fn next_batch(&self, batch: &mut Batch) -> Option<usize> {
        batch.numbers.clear();
        batch.next = 0;
        HERE.with(|here| std::mem::swap(&mut batch.numbers, &mut here.ready.borrow_mut()));
        if self.elsewhere.is_any.load(Ordering::Relaxed) {
            // The mark is set and cleared under the lock, so no task is left behind without a mark.
            let mut woken = self.elsewhere.lock();
            self.elsewhere.is_any.store(false, Ordering::Relaxed);
            // Tasks woken by other threads come last: the order of such wakes depends on the machine, and must not move the tasks woken on this thread.
            batch.numbers.append(&mut woken.numbers);
        }
        batch.take()
    }

    /// Fails the run, because time does not pass.
    #[cold]
    fn give_up(&self, shared: &Shared, polls: u64) -> ! {
        time_stands_still(shared, polls, self.last().as_deref())
    }
}

/// Runs a program on the executor of this crate.
pub(crate) fn run(
    core: Core,
    hosts: usize,
    program: impl FnOnce(Arc<Shared>) -> Program,
    origin: &'static Location<'static>,
    watched: &Watched,
    recorded: &mut Option<Recorded>,
) {
    let executor = Executor::new();
    let mut core = core;
    core.woken.trust(&executor.waker());
    let shared = Arc::new(Shared::new(core, Clock::Own));
    let tasks = Rc::new(Tasks::new(Box::new(executor.clone()), hosts, Arc::clone(&watched.pulse)));
    watched.is_of(&shared);
    let _entered = enter(&shared, &tasks);
    // The drop of the recorder ends the run. By then the guard below has put the state back, where other threads find it.
    let _recorder = Recorder { shared: Arc::clone(&shared), tasks: Rc::clone(&tasks), recorded };
    // After `enter`, because `enter` checks that no second test bed runs on this thread.
    let _here = shared.stay();
    let is_over = Rc::new(Cell::new(false));
    let (program, over) = (program(Arc::clone(&shared)), Rc::clone(&is_over));
    let _main = tasks.spawn(None, origin, async move {
        program.await;
        over.set(true);
    });
    executor.run(&shared, &tasks, || is_over.get());
}

/// Fails the run, because tasks are polled again and again and time does not pass. `last` is the task that was polled last.
///
/// # Panics
///
/// Always.
#[expect(clippy::panic, reason = "time cannot pass; says why, and the way out")]
pub(crate) fn time_stands_still(shared: &Shared, polls: u64, last: Option<&Task>) -> ! {
    let now = shared.with(|core| core.now());
    let who = last.map_or_else(|| "a task that is over now".to_owned(), |task| task.words(shared.names()));
    panic!(
        "time stands still at {} s: tasks were polled {polls} times at this instant, the last of them {who}. That task wakes itself, or others, again and \
         again: let the task wait for a socket or a `sleep`",
        Seconds(now)
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Task of another executor, which this executor is.
    struct Main;

    impl Wake for Main {
        fn wake(self: Arc<Self>) {}
    }

    #[test]
    fn an_executor_leaves_nothing_on_its_thread() {
        let mains = [Arc::new(Main), Arc::new(Main)];
        let count = || mains.each_ref().map(Arc::strong_count);
        let [first, second] = mains.each_ref().map(|main| {
            let executor = Executor::new();
            executor.begin(Some(&Waker::from(Arc::clone(main))));
            executor
        });
        // The thread holds the waker of the second executor, and each executor holds its own.
        assert_eq!(count(), [2, 3]);
        drop(first);
        assert_eq!(count(), [1, 3]);
        second.waker().wake_by_ref();
        drop(second);
        assert_eq!(count(), [1, 1]);
    }
}
