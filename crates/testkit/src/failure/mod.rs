//! Report of a failure. For a property the report is printed once, for the smallest input, and not for each input on the way there.

mod hook;
#[cfg(feature = "strategies")]
mod searching;

pub(crate) use hook::{install, told};
#[cfg(feature = "strategies")]
pub(crate) use searching::Searching;

/// Lines about a run, made only when printed, because the making may write a trace.
pub(crate) type Lines = Box<dyn FnOnce() -> Vec<String>>;

/// Returns whether this thread tries values of a strategy.
pub(crate) fn is_searching() -> bool {
    #[cfg(feature = "strategies")]
    return searching::is_searching();
    #[cfg(not(feature = "strategies"))]
    false
}

/// Reports a failed run: now, or after the smallest input has been found.
pub(crate) fn report(lines: Lines) {
    #[cfg(feature = "strategies")]
    let Some(lines) = searching::keep_failed(lines) else { return };
    print("", lines);
}

/// Notes a run that has not failed, because its property may still fail afterwards.
#[cfg_attr(not(feature = "strategies"), expect(unused_variables, reason = "only properties look back"))]
pub(crate) fn note_run(lines: impl FnOnce() -> Lines) {
    #[cfg(feature = "strategies")]
    searching::keep_last(lines);
}

#[expect(clippy::print_stderr, reason = "a test that fails says how to see it again")]
fn print(before: &str, lines: Lines) {
    let text: String = lines().into_iter().map(|line| line + "\n").collect();
    eprint!("{before}{text}");
}

/// Runs the function that polls the tasks of a run. The standard library cuts backtraces at a function of this name. The frames below are the test bed,
/// proptest and the test harness, and tell nothing about the program.
#[inline(never)]
pub(crate) fn __rust_begin_short_backtrace<T>(act: impl FnOnce() -> T) -> T {
    let outcome = act();
    // Without the black box the compiler might turn the call into a jump, and the name would be missing in the backtrace.
    std::hint::black_box(());
    outcome
}
