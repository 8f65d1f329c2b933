//! Report of a failure: printed once, when the smallest input of a property is found, and not for each input on the way there.

#[cfg(feature = "strategies")]
mod searching;

#[cfg(feature = "strategies")]
pub(crate) use searching::Searching;

/// Lines about a run, made when they are printed: they may write a trace.
pub(crate) type Lines = Box<dyn FnOnce() -> Vec<String>>;

/// Returns whether this thread tries values of a strategy.
pub(crate) fn is_searching() -> bool {
    #[cfg(feature = "strategies")]
    return searching::is_searching();
    #[cfg(not(feature = "strategies"))]
    false
}

/// Reports a run that has failed: now, or once the smallest input is found.
pub(crate) fn report(lines: Lines) {
    #[cfg(feature = "strategies")]
    let Some(lines) = searching::keep_failed(lines) else { return };
    print("", lines);
}

/// Notes a run that has not failed: its property may fail afterwards.
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

/// Runs what polls the tasks of a run. Backtraces end here: what calls this function is the test bed, proptest and the test harness, and says nothing about
/// the program.
/// The standard library leaves out what lies below a function of this name.
#[inline(never)]
pub(crate) fn __rust_begin_short_backtrace<T>(act: impl FnOnce() -> T) -> T {
    let outcome = act();
    // Otherwise the call might be compiled to a jump, and the name would not be there.
    std::hint::black_box(());
    outcome
}
