//! Computations that Ctrl-C ends.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use cohaptic_stability::Watch;
use pyo3::prelude::*;

/// How long the thread of Python waits before it looks for signals again.
const BETWEEN: Duration = Duration::from_millis(20);

/// Deep recursions are those of the main thread of a program.
const STACK: usize = 16 << 20;

/// Whether the computation is to end.
#[derive(Debug, Default)]
pub(crate) struct Stop(AtomicBool);

impl Stop {
    pub(crate) fn is_asked(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    pub(crate) fn ask(&self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

impl Watch for Stop {
    fn stops(&self) -> bool {
        self.is_asked()
    }
}

impl cohaptic_campaign::Watch for Stop {
    fn keep_going(&self) -> bool {
        !self.is_asked()
    }
}

/// Computes on a thread of its own, with the interpreter released, while this one hears signals: only the main thread of Python may. Ctrl-C asks the work to stop,
/// and is raised once it has.
pub(crate) fn interruptible<T: Send>(py: Python<'_>, work: impl FnOnce(&Stop) -> T + Send) -> PyResult<T> {
    let stop = Stop::default();
    let done = Stop::default();
    let caller = thread::current();
    thread::scope(|scope| {
        let run = || {
            let result = work(&stop);
            done.ask();
            caller.unpark();
            result
        };
        let worker = thread::Builder::new().stack_size(STACK).spawn_scoped(scope, run)?;
        let mut signal = Ok(());
        while !(done.is_asked() || worker.is_finished()) {
            py.detach(|| thread::park_timeout(BETWEEN));
            if let Err(error) = py.check_signals() {
                stop.ask();
                signal = Err(error);
            }
        }
        let result = py.detach(|| worker.join()).unwrap_or_else(|panic| resume_unwind(panic));
        signal.map(|()| result)
    })
}

/// The same on that number of threads, 0 for one a core.
pub(crate) fn on_threads<T: Send>(py: Python<'_>, threads: usize, work: impl FnOnce(&Stop) -> T + Send) -> PyResult<T> {
    interruptible(py, |stop| match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
        Ok(pool) => pool.install(|| work(stop)),
        // Without threads of its own it uses those that there are.
        Err(_) => work(stop),
    })
}
