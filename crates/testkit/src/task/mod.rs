//! Tasks: futures on hosts. Any executor can poll the futures.

mod join;
#[cfg(feature = "facade")]
mod others;
#[cfg(feature = "facade")]
mod signals;

use std::cell::{Cell, RefCell};
use std::future::Future;
use std::panic::Location;
use std::pin::Pin;
use std::rc::{Rc, Weak};
use std::sync::Arc;
use std::task::{Context, Poll, Waker};

pub(crate) use join::joined;
pub use join::{JoinHandle, TaskStopped};
#[cfg(feature = "facade")]
pub(crate) use others::OtherTasks;

use cohaptic_units::Instant;
use cohaptic_units::print::Seconds;
use cohaptic_wan::NodeId;

use crate::core::Core;
use crate::current;
use crate::watch::{Pulse, Runner};

/// Future of a task.
pub(crate) type Program = Pin<Box<dyn Future<Output = ()>>>;

/// A task of a run.
pub(crate) struct Task {
    runner: Runner,
    pulse: Arc<Pulse>,
    /// Number of the task in the pulse.
    number: usize,
    /// Future of the task; `None` once the task is over or was stopped.
    program: RefCell<Option<Program>>,
    /// Instant of the last poll. The task waits since then.
    polled: Cell<Instant>,
    /// `true` if the task was stopped, perhaps during a poll of the task.
    is_doomed: Cell<bool>,
    /// Waker of the task. Every poll uses the same waker.
    waker: RefCell<Option<Waker>>,
}

impl Task {
    fn new(runner: Runner, program: Program, pulse: &Arc<Pulse>) -> Rc<Self> {
        let number = pulse.number(runner);
        Rc::new(Self {
            runner,
            pulse: Arc::clone(pulse),
            number,
            program: RefCell::new(Some(program)),
            polled: Cell::new(Instant::ZERO),
            is_doomed: Cell::new(false),
            waker: RefCell::new(None),
        })
    }

    /// Stores the waker of the task.
    pub(crate) fn is_woken_by(&self, waker: Waker) {
        *self.waker.borrow_mut() = Some(waker);
    }

    /// Polls the program at the instant `now`. Ready when the program is over or was stopped.
    #[inline]
    pub(crate) fn poll(&self, now: Instant, cx: &mut Context<'_>) -> Poll<()> {
        self.polled.set(now);
        let mut program = self.program.borrow_mut();
        let Some(future) = program.as_mut() else { return Poll::Ready(()) };
        // The watchdog learns which task has the thread. A poll that never returns is reported with the name of this task.
        self.pulse.begins(self.number);
        let polled = current::on_host(self.runner.host, || future.as_mut().poll(cx));
        self.pulse.returns();
        if polled.is_pending() && !self.is_doomed.get() {
            return Poll::Pending;
        }
        let over = program.take();
        drop(program);
        self.drop_there(over);
        Poll::Ready(())
    }

    /// Drops the program as a task of the host, so that destructors act on the host.
    #[inline(never)]
    fn drop_there(&self, program: Option<Program>) {
        current::on_host(self.runner.host, || drop(program));
    }

    /// Stops the task: drops the program. A task that stops itself is dropped when the poll returns.
    pub(crate) fn stop(&self) {
        self.is_doomed.set(true);
        // The program is borrowed during a poll. `poll` then drops the program, because the task is doomed.
        let Ok(mut program) = self.program.try_borrow_mut() else { return };
        let over = program.take();
        drop(program);
        self.drop_there(over);
        // The executor polls the task once more, finds no program, and frees the index of the task.
        let waker = self.waker.borrow_mut().take();
        if let Some(waker) = waker {
            waker.wake();
        }
    }

    fn is_over(&self) -> bool {
        self.program.try_borrow().is_ok_and(|program| program.is_none())
    }

    /// Returns a description of the task, with the beginning of the wait and the awaited sockets and timers.
    pub(crate) fn waits(&self, core: &Core) -> String {
        let awaited = self.waker.borrow().as_ref().map(|waker| core.awaited_by(waker)).unwrap_or_default();
        let awaited = if awaited.is_empty() { "another task, or something outside of the test bed".to_owned() } else { awaited.join(", or ") };
        format!("{} has waited since {} s for {awaited}", self.words(core.plan.names()), Seconds(self.polled.get()))
    }

    /// Returns the name of the task in messages: see [`Runner::words`].
    pub(crate) fn words(&self, hosts: &[String]) -> String {
        self.runner.words(hosts)
    }
}

/// Executor, as far as starting of tasks needs it.
pub(crate) trait Spawner {
    /// Starts polling a task, until the task is over.
    fn start(&self, task: Rc<Task>);
}

/// Function that makes the program of a host anew.
type Factory = Rc<dyn Fn() -> Program>;

/// Tasks of a test bed.
pub(crate) struct Tasks {
    pulse: Arc<Pulse>,
    spawner: Box<dyn Spawner>,
    /// Tasks started so far, some of which may be over.
    known: RefCell<Vec<Weak<Task>>>,
    /// Program of each host with the place of the call that gave the program, indexed by host.
    factories: RefCell<Vec<Option<(Factory, &'static Location<'static>)>>>,
    /// Tasks that tokio polls.
    #[cfg(feature = "facade")]
    pub(crate) others: Arc<OtherTasks>,
}

impl Tasks {
    pub(crate) fn new(spawner: Box<dyn Spawner>, hosts: usize, pulse: Arc<Pulse>) -> Self {
        Self {
            pulse,
            spawner,
            known: RefCell::new(Vec::new()),
            factories: RefCell::new(vec![None; hosts]),
            #[cfg(feature = "facade")]
            others: Arc::default(),
        }
    }

    /// Starts a task on `host`, or on no host.
    pub(crate) fn spawn<F>(&self, host: Option<NodeId>, origin: &'static Location<'static>, future: F) -> JoinHandle<F::Output>
    where
        F: Future + 'static,
        F::Output: 'static,
    {
        // The future is boxed by itself, because without optimisation the program around it would also be copied on the stack.
        let (program, state) = joined(Box::pin(future));
        let task = self.start(host, origin, Box::pin(program));
        JoinHandle::new(state, Rc::downgrade(&task))
    }

    fn start(&self, host: Option<NodeId>, origin: &'static Location<'static>, program: Program) -> Rc<Task> {
        let task = Task::new(Runner { host, origin }, program, &self.pulse);
        let mut known = self.known.borrow_mut();
        // Tasks that are over are forgotten whenever the array is full, so that the array stays proportional to the number of live tasks.
        if known.len() == known.capacity() {
            known.retain(|task| task.upgrade().is_some_and(|task| !task.is_over()));
        }
        known.push(Rc::downgrade(&task));
        drop(known);
        self.spawner.start(Rc::clone(&task));
        task
    }

    /// Starts the program of a host, and keeps `factory` for [`Tasks::restart`].
    pub(crate) fn set_program(&self, host: NodeId, origin: &'static Location<'static>, factory: Factory) {
        self.factories.borrow_mut()[host.index()] = Some((factory, origin));
        self.restart(host);
    }

    /// Starts the program of a host again. Does nothing if the host has no program.
    pub(crate) fn restart(&self, host: NodeId) {
        let factory = self.factories.borrow()[host.index()].clone();
        if let Some((factory, origin)) = factory {
            // The factory is code of the test and may use sockets of the host, so the host is set for the factory too.
            let program = current::on_host(Some(host), || factory());
            self.start(Some(host), origin, program);
        }
    }

    /// Stops all tasks of a host.
    pub(crate) fn stop_all_of(&self, host: NodeId) {
        // The tasks are collected first, because dropping a program may spawn and stop tasks, which borrows the list.
        let of_host: Vec<Rc<Task>> = self.known.borrow().iter().filter_map(Weak::upgrade).filter(|task| task.runner.host == Some(host)).collect();
        of_host.iter().for_each(|task| task.stop());
        #[cfg(feature = "facade")]
        self.others.stop_all_of(host);
    }

    /// Stops all tasks, also the tasks that are spawned while tasks are dropped.
    pub(crate) fn stop_all(&self) {
        loop {
            // The list is emptied before any task is stopped: destructors may spawn tasks, and the next round stops these tasks.
            let all: Vec<Rc<Task>> = self.known.borrow_mut().drain(..).filter_map(|task| task.upgrade()).collect();
            if all.is_empty() {
                return;
            }
            all.iter().for_each(|task| task.stop());
        }
    }

    /// Tells the watchdog that the executor is at work outside of tasks.
    #[inline]
    pub(crate) fn turns(&self) {
        self.pulse.turns();
    }

    /// Returns the name of the task being polled.
    pub(crate) fn current(&self, hosts: &[String]) -> String {
        let host = current::host();
        match (self.pulse.running(), host.and_then(|host| hosts.get(host.index()))) {
            // A task without a host may act as a task of a host: see `Host::scope`.
            (Some(runner), _) => Runner { host: runner.host.or(host), ..runner }.words(hosts),
            (None, Some(host)) => format!("a task on host `{host}` that the test bed has not spawned"),
            (None, None) => "a task that the test bed has not spawned, or the function that makes the program".to_owned(),
        }
    }

    /// Returns the tasks that are not over.
    pub(crate) fn waiting(&self) -> Vec<Rc<Task>> {
        self.known.borrow().iter().filter_map(Weak::upgrade).filter(|task| !task.is_over()).collect()
    }
}
