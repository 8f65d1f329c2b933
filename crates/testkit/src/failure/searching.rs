//! Failures of properties. While a value of a [strategy](crate::strategies) may shrink, its property fails again and again. Each failure replaces the previous
//! one. The last failure is printed when the search is over, before proptest prints the message of the panic and the smallest input.

use std::backtrace::{Backtrace, BacktraceStatus};
use std::cell::{Cell, RefCell};
use std::fmt::Write as _;
use std::marker::PhantomData;
use std::panic::PanicHookInfo;
use std::thread;

use super::{Lines, print};

thread_local! {
    /// Number of values of strategies on this thread that may still shrink.
    static SEARCHES: Cell<usize> = const { Cell::new(0) };
    static KEPT: RefCell<Kept> = const { RefCell::new(Kept::NOTHING) };
}

/// Panic and lines to be printed after a property has failed.
struct Kept {
    /// The last panic.
    panic: Option<Panic>,
    /// Lines about the last run, which has not failed itself. The property may fail afterwards.
    last: Option<Lines>,
    failed: Option<Failed>,
}

impl Kept {
    const NOTHING: Self = Self { panic: None, last: None, failed: None };
}

struct Failed {
    panic: Option<Panic>,
    lines: Option<Lines>,
}

/// Panic of a property. Proptest prints the message, except for a panic outside of a property.
struct Panic {
    place: String,
    message: String,
    backtrace: Backtrace,
}

impl Panic {
    fn of(info: &PanicHookInfo<'_>) -> Self {
        let place = info.location().map_or_else(|| "an unknown place".to_owned(), ToString::to_string);
        let payload = info.payload();
        let text = super::hook::better(payload)
            .or_else(|| payload.downcast_ref::<String>().map(String::as_str))
            .or_else(|| payload.downcast_ref::<&str>().copied());
        Self { place, message: text.unwrap_or("Box<dyn Any>").to_owned(), backtrace: Backtrace::capture() }
    }

    fn words(&self) -> String {
        let Self { place, message, backtrace } = self;
        let mut text = if thread::panicking() {
            // The panic was not caught, as proptest would have done: a test uses a value of a strategy by itself.
            format!("\nthread '{}' panicked at {place}:\n{message}\n", thread::current().name().unwrap_or("<unnamed>"))
        } else {
            format!("the smallest input panics at {place}\n")
        };
        if backtrace.status() == BacktraceStatus::Captured {
            text.push_str(&trimmed(&backtrace.to_string()));
        }
        text
    }
}

/// Guard of a value of a strategy that may shrink. Neither `Send` nor `Sync`, like `Box<dyn ValueTree>`, because the count is per thread.
#[derive(Debug)]
pub(crate) struct Searching(PhantomData<*const ()>);

impl Searching {
    pub(crate) fn begin() -> Self {
        super::install();
        SEARCHES.set(SEARCHES.get() + 1);
        Self(PhantomData)
    }

    /// Notes that the property has failed with the value tried last.
    pub(crate) fn failed() {
        KEPT.with_borrow_mut(|kept| {
            // A run that has failed itself has been kept by `keep_failed`.
            if let Some(lines) = kept.last.take() {
                kept.failed = Some(Failed { panic: kept.panic.take(), lines: Some(lines) });
            }
        });
    }
}

impl Clone for Searching {
    fn clone(&self) -> Self {
        Self::begin()
    }
}

impl Drop for Searching {
    fn drop(&mut self) {
        let left = SEARCHES.get() - 1;
        SEARCHES.set(left);
        // Clones of a value count as well. The last value gone means that the search is over.
        if left == 0 {
            let kept = KEPT.replace(Kept::NOTHING);
            // If nothing shrinks, a panic after the run is the only sign of the failure.
            let failed = kept.failed.or_else(|| kept.panic.map(|panic| Failed { panic: Some(panic), lines: kept.last }));
            if let Some(Failed { panic, lines }) = failed {
                print(&panic.map(|panic| panic.words()).unwrap_or_default(), lines.unwrap_or_else(|| Box::new(Vec::new)));
            }
        }
    }
}

/// Returns whether this thread tries values of a strategy.
pub(super) fn is_searching() -> bool {
    SEARCHES.get() > 0
}

/// Keeps the lines about a failed run. Returns the lines if they must be printed now.
pub(super) fn keep_failed(lines: Lines) -> Option<Lines> {
    if !is_searching() {
        return Some(lines);
    }
    KEPT.with_borrow_mut(|kept| {
        let panic = kept.panic.take();
        (kept.last, kept.failed) = (None, Some(Failed { panic, lines: Some(lines) }));
    });
    None
}

/// Keeps the lines about a run that has not failed.
pub(super) fn keep_last(lines: impl FnOnce() -> Lines) {
    if is_searching() {
        let lines = lines();
        KEPT.with_borrow_mut(|kept| (kept.panic, kept.last) = (None, Some(lines)));
    }
}

/// Keeps a panic of a thread while a value of the thread may shrink. Returns whether the panic is kept.
pub(super) fn keep(info: &PanicHookInfo<'_>) -> bool {
    // A panic may occur while the thread ends, when the thread-local state is gone, or while the state is borrowed.
    let keep = |kept: &RefCell<Kept>| kept.try_borrow_mut().map(|mut kept| kept.panic = Some(Panic::of(info))).is_ok();
    SEARCHES.try_with(Cell::get).is_ok_and(|searches| searches > 0) && KEPT.try_with(keep).unwrap_or(false)
}

/// Returns the frames of a backtrace between the machinery of panics and the executor.
fn trimmed(backtrace: &str) -> String {
    let is_frame = |line: &str| line.trim_start().split_once(": ").is_some_and(|(number, _)| number.parse::<u32>().is_ok());
    let mut frames: Vec<String> = Vec::new();
    for line in backtrace.lines() {
        match frames.last_mut() {
            Some(frame) if !is_frame(line) => {
                // Writing to a `String` cannot fail.
                let _ = write!(frame, "\n{line}");
            }
            Some(_) | None => frames.push(line.to_owned()),
        }
    }
    let end = frames.iter().position(|frame| frame.contains("__rust_begin_short_backtrace")).unwrap_or(frames.len());
    // The code below the executor that catches panics has such names as well, so only the frames before `end` are searched.
    let is_machinery = |frame: &String| frame.contains("panicking::") || frame.contains("rust_begin_unwind");
    let begin = frames[..end].iter().rposition(is_machinery).map_or(0, |place| place + 1);
    frames[begin..end].iter().fold(String::new(), |text, frame| text + frame + "\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_backtrace_is_cut_at_both_ends() {
        let text = "   0: kit::failure::keep\n   1: std::panicking::rust_panic_with_hook\n             at a.rs:1\n   2: core::panicking::panic_fmt\n   \
                    3: mine::ask\n             at src/lib.rs:9:5\n   4: mine::test\n   5: x::__rust_begin_short_backtrace\n   6: std::panicking::catch_unwind\n";
        assert_eq!(trimmed(text), "   3: mine::ask\n             at src/lib.rs:9:5\n   4: mine::test\n");
        assert_eq!(trimmed("   0: main\n"), "   0: main\n");
        assert_eq!(trimmed(""), "");
    }
}
