//! Tokio as the executor, with packets that arrive to the nanosecond.
//!
//! Tokio's paused clock jumps to the next of its timers whenever all tasks wait, and its timers are counted in whole milliseconds since the runtime was built. So
//! the clock must be moved by hand within a millisecond, and back to a whole one before tokio is left to jump:
//!
//! ```text
//!   all wait ──► something due within this millisecond? ── yes ─► advance to it
//!                        │ no
//!                within a millisecond (1.3 ms)? ── yes ─► advance to the next whole one (2 ms): what tokio has for it goes off
//!                        │ no
//!                let tokio jump: a timer of ours stands at the millisecond in which the next event is
//! ```
//!
//! That all wait, tokio tells by the hook that it calls before it parks its thread. The hook moves the clock, from event to event as long as none of them
//! wakes a task; so tokio does not park then. Where tokio is to jump, the hook wakes a task of ours, the pump, which sets the timer.

use std::cell::RefCell;
use std::future::{Future, poll_fn};
use std::panic::{AssertUnwindSafe, Location, catch_unwind, resume_unwind};
use std::pin::{Pin, pin};
use std::rc::Rc;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::task::{Context, Poll, Waker};
use std::time::Duration;

use cohaptic_units::Instant;
use tokio::task::LocalSet;

use super::own::{nothing_will_happen, time_stands_still};
use crate::bed::{Bed, Recorder};
use crate::context::Running;
use crate::core::{Clock, Core, Shared};
use crate::task::{Spawner, Task, Tasks};
use crate::watch::Watched;
use crate::wire::Recorded;

/// A millisecond \[ns\]: what tokio's timers are counted in.
const TICK: u64 = 1_000_000;

/// If tokio has jumped so far because there was nothing else to jump to, nothing will ever happen.
const NEVER: Duration = Duration::from_secs(365 * 24 * 3600);

/// What the hook and the pump share.
#[derive(Default)]
struct Idle(Mutex<IdleState>);

#[derive(Default)]
struct IdleState {
    /// The instant for which the pump has set its timer.
    armed: Option<Instant>,
    /// Wakes the pump.
    pump: Option<Waker>,
}

impl Idle {
    fn lock(&self) -> std::sync::MutexGuard<'_, IdleState> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Tokio is about to park its thread: all wait.
    fn notice(&self, shared: &Shared) {
        loop {
            let mut core = shared.lock();
            let (now, next) = (core.now(), core.next_event());
            // Tokio has jumped over it.
            let is_due = next.is_some_and(|next| next <= now);
            if is_due {
                core.pass(now);
            }
            if core.woken.is_any() {
                return;
            }
            drop(core);
            if is_due {
                continue;
            }
            match step(now, next) {
                Some(to) => {
                    advance(to.saturating_duration_since(now));
                    if floor(to) == to {
                        // What tokio has for this millisecond goes off first.
                        return;
                    }
                }
                None => {
                    let state = self.lock();
                    if state.armed != Some(armed(next))
                        && let Some(pump) = &state.pump
                    {
                        pump.wake_by_ref();
                    }
                    return;
                }
            }
        }
    }
}

/// The whole millisecond in which an instant lies.
const fn floor(at: Instant) -> Instant {
    Instant::from_nanos(at.as_nanos() / TICK * TICK)
}

/// For when the pump sets its timer if that is the next event; `Instant::ZERO` stands for never.
fn armed(next: Option<Instant>) -> Instant {
    next.map_or(Instant::ZERO, floor)
}

/// Up to when the clock is to be moved by hand; `None` if tokio may jump.
fn step(now: Instant, next: Option<Instant>) -> Option<Instant> {
    let whole = floor(now).saturating_add_nanos(TICK);
    match next {
        Some(next) if next < whole => Some(next.max(now)),
        _ if floor(now) < now => Some(whole),
        _ => None,
    }
}

/// Starts tasks in a set of tokio's that stays on this thread.
struct Local {
    shared: Arc<Shared>,
    set: Rc<LocalSet>,
    panic: Rc<RefCell<Panic>>,
}

/// The panic of a task, and the waker of the run that is to be told.
#[derive(Default)]
struct Panic {
    payload: Option<Box<dyn std::any::Any + Send>>,
    main: Option<Waker>,
}

impl Spawner for Local {
    fn start(&self, task: Rc<Task>) {
        let (panic, shared) = (Rc::clone(&self.panic), Arc::clone(&self.shared));
        self.set.spawn_local(poll_fn(move |cx| {
            // Tokio would keep a panic until the task is joined; a test is to fail.
            let poll = || {
                if let Some(patience) = shared.count_poll() {
                    time_stands_still(&shared, patience, Some(&task));
                }
                task.poll(cx)
            };
            catch_unwind(AssertUnwindSafe(poll)).unwrap_or_else(|payload| {
                let mut panic = panic.borrow_mut();
                panic.payload.get_or_insert(payload);
                panic.main.take().into_iter().for_each(Waker::wake);
                Poll::Ready(())
            })
        }));
    }
}

/// Runs a program on tokio.
///
/// # Panics
///
/// As [`Testbed::run`](crate::Testbed::run).
#[expect(clippy::panic, reason = "a misuse, and the way out")]
pub(crate) fn run<T, F>(
    core: Core,
    hosts: usize,
    program: impl FnOnce(Bed) -> F,
    origin: &'static Location<'static>,
    watched: &Watched,
    recorded: &mut Option<Recorded>,
) -> T
where
    F: Future<Output = T> + 'static,
    T: 'static,
{
    if tokio::runtime::Handle::try_current().is_ok() {
        panic!(
            "a test bed on tokio brings its own runtime, and this one runs inside another: use a plain `#[test]` in place of `#[tokio::test]`, and `Testbed::run` \
             outside of `block_on`"
        );
    }
    let idle = Arc::new(Idle::default());
    let known: Arc<OnceLock<Arc<Shared>>> = Arc::default();
    let (hook_idle, hook_known, pulse) = (Arc::clone(&idle), Arc::clone(&known), Arc::clone(&watched.pulse));
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_time()
        .start_paused(true)
        .on_thread_park(move || {
            pulse.turns();
            if let Some(shared) = hook_known.get() {
                hook_idle.notice(shared);
            }
        })
        .build()
        .unwrap_or_else(|error| panic!("tokio cannot be started: {error}"));
    let guard = runtime.enter();
    // The clock stands still, so this is the instant from which tokio counts milliseconds.
    let origin_of_time = tokio::time::Instant::now();
    let shared = Arc::new(Shared::new(core, Clock::Tokio { origin: origin_of_time }));
    drop(guard);
    watched.is_of(&shared);
    let panic = Rc::new(RefCell::new(Panic::default()));
    let set = Rc::new(LocalSet::new());
    let tasks = Rc::new(Tasks::new(
        Box::new(Local { shared: Arc::clone(&shared), set: Rc::clone(&set), panic: Rc::clone(&panic) }),
        hosts,
        Arc::clone(&watched.pulse),
    ));
    let _entered = Running { shared: Arc::clone(&shared), tasks: Rc::clone(&tasks) }.enter();
    let _recorder = Recorder { shared: Arc::clone(&shared), tasks: Rc::clone(&tasks), recorded };
    let _ = known.set(Arc::clone(&shared));
    runtime.block_on(set.run_until(async {
        let outcome = Rc::new(RefCell::new(None));
        let (future, slot) = (program(Bed::new(Arc::clone(&shared))), Rc::clone(&outcome));
        let main = tasks.spawn(None, origin, async move {
            let came_out = future.await;
            *slot.borrow_mut() = Some(came_out);
        });
        let mut main = pin!(main);
        let mut pump = pin!(pump(&shared, &tasks, &idle, origin_of_time));
        poll_fn(|cx| {
            {
                let mut panic = panic.borrow_mut();
                if let Some(payload) = panic.payload.take() {
                    drop(panic);
                    resume_unwind(payload);
                }
                panic.main = Some(cx.waker().clone());
            }
            if main.as_mut().poll(cx).is_ready() {
                return Poll::Ready(());
            }
            // It never ends.
            pump.as_mut().poll(cx)
        })
        .await;
        outcome.take().unwrap_or_else(|| panic!("the program was stopped before it was over: do not abort it, or the runtime"))
    }))
}

/// Sets the timer to which tokio may jump, and tells when nothing will ever happen.
async fn pump(shared: &Shared, tasks: &Tasks, idle: &Idle, origin: tokio::time::Instant) {
    let mut timer = pin!(tokio::time::sleep_until(origin + NEVER));
    let mut deadline = origin + NEVER;
    poll_fn(|cx| {
        loop {
            let (now, next) = {
                let mut core = shared.lock();
                (core.now(), core.next_event())
            };
            if next.is_some_and(|next| next <= now) {
                // Due: it was moved to, or has come by tokio's own jump.
                shared.lock().pass(now);
                continue;
            }
            {
                let mut state = idle.lock();
                if !state.pump.as_ref().is_some_and(|known| known.will_wake(cx.waker())) {
                    state.pump = Some(cx.waker().clone());
                }
                let wanted = armed(next);
                if state.armed != Some(wanted) {
                    state.armed = Some(wanted);
                    deadline = if next.is_some() {
                        origin + Duration::from_nanos(wanted.as_nanos())
                    } else {
                        origin + Duration::from_nanos(now.as_nanos()) + NEVER
                    };
                    timer.as_mut().reset(deadline);
                }
            }
            if timer.as_mut().poll(cx).is_ready() {
                if next.is_none() {
                    nothing_will_happen(shared, tasks);
                }
                // The millisecond of the next event has come, or one before it; the hook does the rest. The timer is not to go off again.
                timer.as_mut().reset(origin + NEVER);
                let _ = timer.as_mut().poll(cx);
            }
            return Poll::Pending;
        }
    })
    .await
}

/// Moves tokio's clock, now. Tokio does not park before it has looked at its timers.
fn advance(span: Duration) {
    // It moves the clock when it is polled first, and then only lets others go first.
    let mut moved = pin!(tokio::time::advance(span));
    let _: Poll<()> = Pin::as_mut(&mut moved).poll(&mut Context::from_waker(Waker::noop()));
}
