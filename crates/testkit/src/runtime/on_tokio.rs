//! Tokio as the executor of a run. Packets arrive to the nanosecond all the same.
//!
//! Tokio's paused clock jumps to the next of tokio's timers whenever all tasks wait. Tokio's timers count whole milliseconds since the runtime was built. Hence
//! the clock must be moved by hand within a millisecond, and to a whole millisecond before tokio may jump:
//!
//! ```text
//!   all wait ──► event due within this millisecond? ── yes ─► advance to the event
//!                        │ no
//!                clock within a millisecond (1.3 ms)? ── yes ─► advance to the next whole millisecond (2 ms), for the timers of tokio
//!                        │ no
//!                let tokio jump: the timer of the pump stands at the millisecond of the next event
//! ```
//!
//! Tokio calls a hook before parking its thread, when all tasks wait. The hook moves the clock from event to event until an event wakes a task, so tokio does
//! not park meanwhile. Before a jump of tokio, the hook wakes a task of this module, the pump. The pump sets the timer for the jump.

use std::cell::Cell;
use std::future::{Future, poll_fn};
use std::panic::Location;
use std::pin::{Pin, pin};
use std::rc::Rc;
#[cfg(feature = "loopback")]
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll, Wake, Waker};
use std::time::Duration;

use cohaptic_units::Instant;
use tokio::runtime::Builder;
use tokio::task::LocalSet;

use super::entered::{Entered, enter};
use super::limits::{goes_on, nothing_will_happen};
use super::own::{Executor, is_any_ready, time_stands_still};
use super::recorder::Recorder;
use crate::core::{Clock, Core, Shared};
use crate::failure::__rust_begin_short_backtrace;
use crate::task::{JoinHandle, Program, Tasks};
use crate::watch::{Pulse, Watched};
use crate::wire::Recorded;

/// Unit of tokio's timers: a millisecond \[ns\].
const TICK: u64 = 1_000_000;

/// Distance of the timer for a run without a next event. If tokio jumps this far, nothing will ever happen.
const NEVER: Duration = Duration::from_secs(365 * 24 * 3600);

/// Value of an atomic instant that stands for "no instant".
const NO_INSTANT: u64 = u64::MAX;

/// Maximum number of tasks polled before tokio goes on. Equal to the number of tasks that tokio polls of a `LocalSet` in a row.
const POLLS: u32 = 61;

/// State shared by the hook and the pump.
struct Idle {
    /// Instant for which the pump has set its timer \[ns\], or [`NO_INSTANT`].
    armed: AtomicU64,
    /// `true` if the pump must set its timer anew.
    is_wanted: AtomicBool,
    /// Reading at which the hook has left the clock \[ns\], if nothing between the hook and the executor can move the clock; otherwise [`NO_INSTANT`].
    moved: AtomicU64,
    /// Last instant of the run: its time limit.
    until: Instant,
    /// Instant of tokio's last parking, before a jump to the timer for a run without a next event \[ns\].
    parked: AtomicU64,
    /// `true` if tokio is jumping to the timer for a run without a next event. Tokio's timers do not reach as far as [`NEVER`], so tokio takes several jumps.
    is_idle: AtomicBool,
    /// Wakes the pump and the executor. Both share a task.
    main: Mutex<Option<Waker>>,
}

impl Idle {
    fn new(until: Instant) -> Self {
        Self {
            armed: AtomicU64::new(NO_INSTANT - 1),
            is_wanted: AtomicBool::new(true),
            moved: AtomicU64::new(NO_INSTANT),
            until,
            parked: AtomicU64::new(0),
            is_idle: AtomicBool::new(false),
            main: Mutex::new(None),
        }
    }

    /// Wakes the executor. Tokio polls the executor next, because the future of `block_on` comes before tokio's tasks. `now` is the reading of the clock.
    fn wake(&self, now: Instant) {
        self.moved.store(now.as_nanos(), Ordering::Relaxed);
        if let Some(main) = &*self.main.lock().unwrap_or_else(PoisonError::into_inner) {
            main.wake_by_ref();
        }
    }

    /// Returns whether the run is beyond its time limit. Tasks of tokio alone may keep the run going, and the executor does not see such tasks.
    fn must_end(&self, core: &mut Core) -> bool {
        let (parked, now) = (self.parked.load(Ordering::Relaxed), core.now());
        let is_beyond = now > self.until;
        // A jump this long without a next event is taken for a jump to the timer for "no event". The run then fails as waiting for ever, not as beyond its
        // limit, and the message names the instant before the jump.
        if is_beyond && now.saturating_duration_since(Instant::from_nanos(parked)) > NEVER / 2 && core.next_event().is_none() {
            self.is_idle.store(true, Ordering::Relaxed);
        } else {
            self.parked.store(now.as_nanos(), Ordering::Relaxed);
        }
        is_beyond && !self.is_idle.load(Ordering::Relaxed)
    }

    /// Called when tokio is about to park its thread, because all tasks wait.
    fn notice(&self, shared: &Shared) {
        // Work on another thread takes no time. The end of the work wakes a task, and tokio parks again after the poll of this task.
        #[cfg(feature = "facade")]
        if shared.is_held() {
            return;
        }
        let is_left_something = shared.is_left_something();
        if let Some(now) = shared.with(|core| self.move_clock(core, is_left_something)) {
            self.wake(now);
        }
    }

    /// Moves the clock from event to event, as long as none of the events wakes a task. Returns the time if the executor must be woken.
    fn move_clock(&self, core: &mut Core, is_left_something: bool) -> Option<Instant> {
        if self.must_end(core) || is_left_something {
            return Some(core.now());
        }
        loop {
            let (now, next) = (core.now(), core.next_event());
            // An event is due if tokio has jumped over the event, or the clock was moved to the event below.
            let is_due = next.is_some_and(|next| next <= now);
            if is_due {
                core.pass(now);
            }
            if is_any_ready() {
                // The waker of the task has woken the executor as well.
                self.moved.store(core.now().as_nanos(), Ordering::Relaxed);
                return None;
            }
            // Foreign wakers are called after the borrow of the state has ended. The woken tasks run before tokio parks again.
            if core.woken.is_any() {
                return None;
            }
            if is_due {
                continue;
            }
            let Some(to) = step(now, next) else {
                if !self.is_idle.load(Ordering::Relaxed) {
                    self.parked.store(now.as_nanos(), Ordering::Relaxed);
                }
                break;
            };
            advance(to.saturating_duration_since(now));
            if floor(to) == to {
                // Tokio's own timers of this millisecond go off first.
                return Some(to);
            }
            core.pass(to);
        }
        // The timer stands at the right millisecond already, so tokio may jump without a poll of the pump.
        if self.armed.load(Ordering::Relaxed) == armed(core.next_event()) {
            return None;
        }
        self.is_wanted.store(true, Ordering::Relaxed);
        Some(core.now())
    }
}

/// Returns the whole millisecond at or before an instant.
const fn floor(at: Instant) -> Instant {
    Instant::from_nanos(at.as_nanos() / TICK * TICK)
}

/// Returns the instant for which the pump sets its timer \[ns\] if `next` is the next event.
fn armed(next: Option<Instant>) -> u64 {
    next.map_or(NO_INSTANT, |next| floor(next).as_nanos())
}

/// Returns the instant to which the clock must be moved by hand, or `None` if tokio may jump.
fn step(now: Instant, next: Option<Instant>) -> Option<Instant> {
    let whole = floor(now).saturating_add_nanos(TICK);
    match next {
        Some(next) if next < whole => Some(next.max(now)),
        _ if floor(now) < now || next == Some(whole) => Some(whole),
        _ => None,
    }
}

/// Hook for tokio, called before tokio parks its thread. The hook acts while a run goes on.
#[derive(Default)]
pub(crate) struct Hook(Mutex<Option<Arc<Parking>>>);

/// State of a run for the hook.
struct Parking {
    idle: Arc<Idle>,
    shared: Arc<Shared>,
    pulse: Arc<Pulse>,
}

impl Hook {
    fn set(&self, parking: Option<Parking>) {
        let before = std::mem::replace(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner), parking.map(Arc::new));
        // Dropped after the lock has ended: the state of the run has destructors of programs.
        drop(before);
    }

    fn park(&self) {
        let parking = self.0.lock().unwrap_or_else(PoisonError::into_inner).clone();
        if let Some(Parking { idle, shared, pulse }) = parking.as_deref() {
            pulse.turns();
            idle.notice(shared);
        }
    }
}

/// Prepares a builder of runtimes with one thread for runs that begin with `hook`.
pub(crate) fn prepare<'a>(builder: &'a mut Builder, hook: &Arc<Hook>) -> &'a mut Builder {
    let hook = Arc::clone(hook);
    builder.enable_time().start_paused(true).on_thread_park(move || hook.park())
}

/// Hook that acts for a run until this value is dropped. The hook and the state of the run hold each other, by the waker of the runtime whose builder keeps the
/// hook, so that a run left in its hook would stay in memory for ever.
struct Hooked<'a>(&'a Hook);

impl Drop for Hooked<'_> {
    fn drop(&mut self) {
        self.0.set(None);
    }
}

/// Run that has begun. The parts of the run are dropped in the order of the fields.
struct Begun<'a> {
    _hooked: Hooked<'a>,
    _recorder: Recorder<'a>,
    _entered: Entered,
    tasks: Rc<Tasks>,
    shared: Arc<Shared>,
    executor: Executor,
    idle: Arc<Idle>,
    /// Reading of tokio's clock at [`Instant::ZERO`].
    origin: tokio::time::Instant,
}

impl<'a> Begun<'a> {
    /// Begins a run on this thread.
    fn new(
        mut core: Core,
        hosts: usize,
        origin: tokio::time::Instant,
        hook: &'a Hook,
        watched: &Watched,
        recorded: &'a mut Option<Recorded>,
    ) -> Self {
        let idle = Arc::new(Idle::new(core.settings.limits.until()));
        let executor = Executor::new();
        core.woken.trust(&executor.waker());
        let shared = Arc::new(Shared::new(core, Clock::Tokio { origin }));
        watched.is_of(&shared);
        let tasks = Rc::new(Tasks::new(Box::new(executor.clone()), hosts, Arc::clone(&watched.pulse)));
        let entered = enter(&shared, &tasks);
        let recorder = Recorder { shared: Arc::clone(&shared), tasks: Rc::clone(&tasks), recorded };
        hook.set(Some(Parking { idle: Arc::clone(&idle), shared: Arc::clone(&shared), pulse: Arc::clone(&watched.pulse) }));
        Self { _hooked: Hooked(hook), _recorder: recorder, _entered: entered, tasks, shared, executor, idle, origin }
    }
}

/// Runs a program on tokio.
///
/// # Panics
///
/// As [`Testbed::run`](crate::Testbed::run).
#[expect(clippy::panic, reason = "a misuse, and the way out")]
pub(crate) fn run(
    core: Core,
    hosts: usize,
    program: impl FnOnce(Arc<Shared>) -> Program,
    origin: &'static Location<'static>,
    watched: &Watched,
    recorded: &mut Option<Recorded>,
) {
    if tokio::runtime::Handle::try_current().is_ok() {
        panic!(
            "a test bed on tokio starts a runtime, which cannot run inside another runtime: use a plain `#[test]` in place of `#[tokio::test]`, and call \
             `Testbed::run` outside of `block_on`"
        );
    }
    let hook = Arc::default();
    let runtime = prepare(&mut Builder::new_current_thread(), &hook).build().unwrap_or_else(|error| panic!("tokio cannot be started: {error}"));
    let guard = runtime.enter();
    // The clock stands still, so the reading is the instant from which tokio counts its milliseconds.
    let begun = Begun::new(core, hosts, tokio::time::Instant::now(), &hook, watched, recorded);
    drop(guard);
    runtime.block_on(async {
        // Tasks started by the program with tokio's `spawn_local` live in this set. As in `LocalSet::run_until`, the set is polled whenever the set was woken.
        let mut set = LocalSet::new();
        let _local = set.enter();
        let _here = begun.shared.stay();
        let is_over = Rc::new(Cell::new(false));
        let (program, over) = (program(Arc::clone(&begun.shared)), Rc::clone(&is_over));
        let main = begun.tasks.spawn(None, origin, async move {
            program.await;
            over.set(true);
        });
        let mut beside = pin!(poll_fn(|cx| {
            // A set without tasks is ready. The set is polled again once the set has a task.
            let _: Poll<()> = Pin::new(&mut set).poll(cx);
            Poll::Pending
        }));
        drive(&begun, Some(main), beside.as_mut()).await;
        assert!(is_over.get(), "the program was stopped before its end: do not abort the program or the runtime");
    });
}

/// Runs a future of another program as a task of `host` until the future is over. `block_on` runs the given future on a runtime whose builder was prepared by
/// [`prepare`] with `hook`. `origin` is the reading of the clock when the runtime was built, as found out by the first run.
///
/// # Panics
///
/// As [`Testbed::run`](crate::Testbed::run); and if `block_on` returns before the given future is over.
#[cfg(feature = "loopback")]
#[expect(clippy::panic, reason = "a misuse, and the way out")]
pub(crate) fn run_beside<F: Future>(
    (core, hosts, host): (Core, usize, cohaptic_wan::NodeId),
    future: F,
    block_on: impl FnOnce(Pin<&mut dyn Future<Output = ()>>),
    (hook, origin): (&Hook, &OnceLock<tokio::time::Instant>),
    watched: &Watched,
    recorded: &mut Option<Recorded>,
) -> F::Output {
    let mut outcome = None;
    let run = async {
        // The clock stands still until something runs on the runtime.
        let origin = *origin.get_or_init(tokio::time::Instant::now);
        let begun = Begun::new(core, hosts, origin, hook, watched, recorded);
        let _here = begun.shared.stay();
        let mut beside = pin!(async { outcome = Some(future.await) });
        drive(&begun, None, beside.as_mut()).await;
    };
    // All tasks of the runtime live on the host, wherever the tasks were started.
    crate::current::on_host(Some(host), || block_on(pin!(run)));
    outcome.unwrap_or_else(|| panic!("the runtime was stopped before the end of the program"))
}

/// Polls tasks until `main` or `beside` is over. `beside` is polled whenever `beside` was woken. Unlike [`run`], `drive` is not generic, so that the compiler
/// translates `drive` only once, with the test kit.
async fn drive(begun: &Begun<'_>, main: Option<JoinHandle<()>>, mut beside: Pin<&mut dyn Future<Output = ()>>) {
    let Begun { executor, shared, tasks, idle, origin, .. } = begun;
    let mut main = pin!(main);
    let mut pump = pin!(pump(shared, tasks, idle, *origin));
    let mut woken: Option<Arc<BesideWaker>> = None;
    let limits = shared.with(|core| core.settings.limits);
    let mut steps = 0;
    let mut turn = |cx: &mut Context<'_>| {
        let woken = woken.get_or_insert_with(|| {
            executor.begin(Some(cx.waker()));
            *idle.main.lock().unwrap_or_else(PoisonError::into_inner) = Some(cx.waker().clone());
            Arc::new(BesideWaker { is_woken: AtomicBool::new(true), main: cx.waker().clone() })
        });
        let moved = idle.moved.swap(NO_INSTANT, Ordering::Relaxed);
        // The executor is polled, so a task goes on or the timer of the pump is over. Either way the jump of tokio has ended.
        idle.is_idle.store(false, Ordering::Relaxed);
        let synced = shared.sync((moved != NO_INSTANT).then(|| Instant::from_nanos(moved)));
        // Time does not pass before the end of this turn.
        let now = shared.now();
        // Tasks of tokio itself must get their turn between, as with a `LocalSet`.
        let mut left = POLLS;
        let all_wait = executor.run_some(now, || {
            shared.attend();
            if let Some(patience) = shared.count_poll() {
                time_stands_still(shared, patience, executor.last().as_deref());
            }
            left -= 1;
            steps += 1;
            left > 0 && tokio::task::coop::has_budget_remaining()
        });
        if let Some(main) = main.as_mut().as_pin_mut()
            && main.is_finished()
            && main.poll(cx).is_ready()
        {
            return Poll::Ready(());
        }
        if all_wait {
            // The pump is a future that never ends.
            let _: Poll<()> = pump.as_mut().poll(cx);
            // `attend` runs after each polled task. If no task was polled, acts of other threads and of tasks of tokio have not been looked at yet.
            if left == POLLS {
                shared.attend();
            }
        } else {
            cx.waker().wake_by_ref();
        }
        if now > idle.until || steps > limits.steps {
            goes_on(shared, tasks, limits.reached(steps));
        }
        drop(synced);
        if woken.is_woken.swap(false, Ordering::Relaxed) {
            return beside.as_mut().poll(&mut Context::from_waker(&Arc::clone(woken).into()));
        }
        Poll::Pending
    };
    poll_fn(|cx| __rust_begin_short_backtrace(|| turn(cx))).await;
}

/// Waker of the future beside the tasks: marks the future and wakes the executor, which then polls the future.
struct BesideWaker {
    is_woken: AtomicBool,
    main: Waker,
}

impl Wake for BesideWaker {
    fn wake(self: Arc<Self>) {
        Self::wake_by_ref(&self);
    }

    fn wake_by_ref(self: &Arc<Self>) {
        self.is_woken.store(true, Ordering::Relaxed);
        self.main.wake_by_ref();
    }
}

/// Sets the timer to which tokio may jump. Fails the run when nothing will ever happen.
async fn pump(shared: &Shared, tasks: &Tasks, idle: &Idle, origin: tokio::time::Instant) {
    let mut timer = pin!(tokio::time::sleep_until(origin + NEVER));
    // Deadline of the timer, since the beginning of the run.
    let mut due = NEVER;
    poll_fn(|cx| {
        let since = Duration::from_nanos(shared.now().as_nanos());
        // Most often the hook has moved the clock by hand, and the timer stays as before.
        if !idle.is_wanted.load(Ordering::Relaxed) && since < due {
            return Poll::Pending;
        }
        idle.is_wanted.store(false, Ordering::Relaxed);
        let next = shared.with(Core::next_event);
        let wanted = armed(next);
        if idle.armed.swap(wanted, Ordering::Relaxed) != wanted {
            due = if next.is_some() { Duration::from_nanos(wanted) } else { since + NEVER };
            timer.as_mut().reset(origin + due);
        }
        if timer.as_mut().poll(cx).is_ready() {
            if next.is_none() {
                nothing_will_happen(shared, tasks, Instant::from_nanos(idle.parked.load(Ordering::Relaxed)));
            }
            // The clock has reached the millisecond of the next event, or an earlier millisecond; the hook moves the clock on. The timer is set far away, so
            // as not to go off again.
            due = NEVER;
            timer.as_mut().reset(origin + NEVER);
            let _ = timer.as_mut().poll(cx);
        }
        Poll::Pending
    })
    .await
}

/// Moves tokio's clock by `span` at once. Tokio looks at its timers before parking.
fn advance(span: Duration) {
    // The first poll of `advance` moves the clock. Further polls would only let other tasks run first, and are not needed.
    let mut moved = pin!(tokio::time::advance(span));
    let _: Poll<()> = Pin::as_mut(&mut moved).poll(&mut Context::from_waker(Waker::noop()));
}
