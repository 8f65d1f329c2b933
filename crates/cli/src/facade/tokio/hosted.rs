//! Futures that the real tokio polls, as tasks of a host of a test bed.

use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};

use cohaptic_sockets::{Host, Stop};

use real::task::{AbortHandle, JoinHandle};

/// Future that is polled, and dropped, as a task of a host.
pub(crate) struct Hosted<F> {
    host: Arc<dyn Host>,
    /// `None` once the future is over.
    future: Option<Pin<Box<F>>>,
}

impl<F> Hosted<F> {
    /// Drops the future as a task of the host, so that destructors of the program act on the host.
    fn let_go(&mut self) {
        if let Some(future) = self.future.take() {
            // `within` may call the closure more than once, so the future is moved through an option.
            let mut future = Some(future);
            self.host.within(&mut || drop(future.take()));
        }
    }
}

impl<F: Future> Future for Hosted<F> {
    type Output = F::Output;

    fn poll(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<F::Output> {
        let Self { host, future } = &mut *self;
        let future = future.as_mut().expect("a future that is over is not polled again");
        let mut polled = Poll::Pending;
        host.within(&mut || polled = future.as_mut().poll(cx));
        // Dropped at once, and not when the real tokio drops the task, which may be much later.
        if polled.is_ready() {
            self.let_go();
        }
        polled
    }
}

impl<F> Drop for Hosted<F> {
    fn drop(&mut self) {
        self.let_go();
    }
}

/// The way to stop a task of the real tokio.
struct Stopper(AbortHandle);

impl Stop for Stopper {
    fn stop(&self) {
        self.0.abort();
    }

    fn is_over(&self) -> bool {
        self.0.is_finished()
    }
}

impl<F> Hosted<F> {
    pub(crate) fn new(host: &Arc<dyn Host>, future: F) -> Self {
        Self { host: Arc::clone(host), future: Some(Box::pin(future)) }
    }
}

/// Stops a task when the program of `host` ends.
pub(crate) fn end_with(host: &Arc<dyn Host>, task: AbortHandle) {
    host.keep(Box::new(Stopper(task)));
}

/// Starts a future by `$spawn`. If the present task lives on a host, the future becomes a task of the host, and ends with the host. `$abort` is the handle of
/// the started task. A macro and not a function, because the panics of the real tokio name the place of the call.
macro_rules! start {
    ($future:ident, $spawn:expr, |$started:ident| $abort:expr) => {
        match cohaptic_sockets::host() {
            None => $spawn,
            Some(host) => {
                let $future = $crate::hosted::Hosted::new(&host, $future);
                let $started = $spawn;
                $crate::hosted::end_with(&host, $abort);
                $started
            }
        }
    };
}
pub(crate) use start;

/// Checks that a task can be started where no runtime is named.
///
/// # Panics
///
/// In a test bed that does not run on tokio.
#[track_caller]
pub(crate) fn expect_runtime() {
    if cohaptic_sockets::is_in_bed() && real::runtime::Handle::try_current().is_err() {
        panic!("a task of tokio is started in a test bed that does not run on tokio: call `Testbed::on_tokio` before `run`");
    }
}

/// Prepares `function` for a thread of `spawn_blocking`: tasks that the function starts live on the host of the present task.
pub(crate) fn with_host<R: 'static>(function: impl FnOnce() -> R + Send + 'static) -> impl FnOnce() -> R + Send + 'static {
    let host = cohaptic_sockets::host();
    move || {
        let _on = host.map(cohaptic_sockets::on_host);
        function()
    }
}

/// Runs `$function` on a thread for blocking work by `$block`. In a test bed the virtual time waits for the end of the function, and the task that `$spawn`
/// starts stands for the thread: time goes on when that task has the outcome, not a moment before.
macro_rules! start_blocking {
    ($function:ident, $block:expr, |$task:ident| $spawn:expr) => {{
        let held = cohaptic_sockets::bed().map(|bed| bed.hold());
        let $function = $crate::hosted::with_host($function);
        match held {
            None => $block,
            Some(hold) => {
                let work = $block;
                let $task = async move {
                    let _hold = hold;
                    $crate::hosted::outcome_of(work).await
                };
                $spawn
            }
        }
    }};
}
pub(crate) use start_blocking;

/// Waits for blocking work, and resumes a panic of the work in the caller.
pub(crate) async fn outcome_of<T>(work: JoinHandle<T>) -> T {
    match work.await {
        Ok(outcome) => outcome,
        Err(error) if error.is_panic() => std::panic::resume_unwind(error.into_panic()),
        // The runtime ends, and so does this task.
        Err(_) => std::future::pending().await,
    }
}
