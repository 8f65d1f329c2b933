//! Hook of panics. Panics of a property are kept back during shrinking. A panic of tokio caused by the test bed gets a message of the test kit, because nobody
//! can follow the advice of tokio in a test bed: the test bed makes the runtime.

use std::any::Any;
use std::panic::{self, PanicHookInfo};
use std::sync::Once;
use std::thread;

use crate::context;

/// Part of tokio's message that there is no runtime, and the message of the test kit.
const NO_RUNTIME: (&str, &str) = (
    "there is no reactor running",
    "timers, tasks and sockets of tokio need a runtime of tokio, and this test bed runs on the executor of the test kit: call `Testbed::on_tokio` before `run`",
);

/// Part of tokio's message that its runtime has no driver of input and output, and the message of the test kit.
const NO_SOCKETS: (&str, &str) = (
    "IO is disabled",
    "the program makes a socket, a pipe, a process, a signal or an `AsyncFd` of the real tokio, and the real system takes no part in the virtual time of a \
     test bed. Use the sockets of `cohaptic_testkit::net`, or run the test with the package that `cohaptic tokio` writes: its sockets, pipes and signals \
     belong to the test bed. Replace an `AsyncFd`, which waits for a descriptor of the system, by a socket or a channel",
);

/// Returns the message of the test kit for a panic with this payload, or `None` if the message of the panic is good.
pub(super) fn better(payload: &dyn Any) -> Option<&'static str> {
    let text = payload.downcast_ref::<String>().map(String::as_str).or_else(|| payload.downcast_ref::<&str>().copied())?;
    [NO_RUNTIME, NO_SOCKETS].into_iter().find(|(part, _)| text.contains(part)).map(|(_, better)| better)
}

/// Returns the payload of the failure of a run that panicked with `payload`.
pub(crate) fn told(payload: Box<dyn Any + Send>) -> Box<dyn Any + Send> {
    match better(&*payload) {
        Some(text) => Box::new(text.to_owned()),
        None => payload,
    }
}

/// Installs the hook, once per process. The previous hook gets all other panics.
pub(crate) fn install() {
    static ONCE: Once = Once::new();
    // A hook cannot be set while a panic unwinds. The next run sets the hook.
    if thread::panicking() {
        return;
    }
    ONCE.call_once(|| {
        let before = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            let better = better(info.payload()).and_then(|text| Some((text, context::try_shared()?)));
            if let Some((text, shared)) = &better {
                // Tokio catches the panics of its own tasks. The noted fault fails the run nevertheless.
                shared.note_fault(text);
            }
            #[cfg(feature = "strategies")]
            if super::searching::keep(info) {
                return;
            }
            match better {
                Some((text, _)) => print(info, text),
                None => before(info),
            }
        }));
    });
}

/// Prints a panic with the message `text`.
#[expect(clippy::print_stderr, reason = "in place of the standard library, which prints the message of a panic")]
fn print(info: &PanicHookInfo<'_>, text: &str) {
    let place = info.location().map_or_else(|| "an unknown place".to_owned(), ToString::to_string);
    eprintln!("\nthread '{}' panicked at {place}:\n{text}", thread::current().name().unwrap_or("<unnamed>"));
}
