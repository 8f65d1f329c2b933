//! Computations that Ctrl-C ends.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use cohaptic_stability::Watch;
use pyo3::prelude::*;

/// Time between two checks of the thread of Python for signals.
const BETWEEN: Duration = Duration::from_millis(20);

/// Stack of the computing thread \[bytes\], so that recursions may be as deep as on the main thread of a program.
const STACK: usize = 16 << 20;

/// Mark that ends the computation.
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

/// Runs `work` on a thread of its own, with the interpreter released. Meanwhile the calling thread checks for signals, because only the main thread of Python
/// may do so. After Ctrl-C the work is asked to stop, and `KeyboardInterrupt` is raised once the work has stopped.
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

/// Computes like [`interruptible`], on a number of threads; 0 for one thread per core.
pub(crate) fn on_threads<T: Send>(py: Python<'_>, threads: usize, work: impl FnOnce(&Stop) -> T + Send) -> PyResult<T> {
    interruptible(py, |stop| match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
        Ok(pool) => pool.install(|| work(stop)),
        // Without a pool of its own, the work uses the threads of the global pool.
        Err(_) => work(stop),
    })
}
