//! Thread of the watchdog, one for all test beds of a process.

use std::fmt::Write as _;
use std::io::Write as _;
use std::process::abort;
use std::sync::{Arc, Condvar, Mutex, PoisonError, Weak};
use std::thread;
use std::time::Duration;

use cohaptic_units::print::{Seconds, Span};

use super::guard::is_debugged;
use super::{Kind, STALL_VARIABLE, Watched};

/// Shortest time between two looks.
const SHORTEST: Duration = Duration::from_millis(5);
/// Longest time between two looks.
const LONGEST: Duration = Duration::from_millis(250);

struct Watch {
    runs: Vec<Seen>,
    has_thread: bool,
}

/// Run with the result of the last look.
struct Seen {
    run: Weak<Watched>,
    turns: u64,
    /// Time for which the run has not turned. This is the sum of the times between looks, not the difference of two readings of a clock: while the machine
    /// sleeps or the process is stopped, nothing is added.
    stood: Duration,
}

static WATCH: Mutex<Watch> = Mutex::new(Watch { runs: Vec::new(), has_thread: false });
static CHANGED: Condvar = Condvar::new();

/// Watches a run until the run is dropped.
pub(super) fn watch(run: &Arc<Watched>) {
    let mut watch = WATCH.lock().unwrap_or_else(PoisonError::into_inner);
    watch.runs.push(Seen { run: Arc::downgrade(run), turns: 0, stood: Duration::ZERO });
    if !watch.has_thread {
        // On a system without threads nothing is watched.
        watch.has_thread = thread::Builder::new().name("cohaptic-watch".to_owned()).spawn(look).is_ok();
    }
    // The thread waits without a time-out only while there is no run.
    if watch.runs.len() == 1 {
        CHANGED.notify_one();
    }
}

/// Looks at all runs, again and again.
fn look() {
    let mut watch = WATCH.lock().unwrap_or_else(PoisonError::into_inner);
    loop {
        watch.runs.retain(|seen| seen.run.strong_count() > 0);
        let Some(shortest) = watch.runs.iter().filter_map(|seen| Some(seen.run.upgrade()?.limit)).min() else {
            watch = CHANGED.wait(watch).unwrap_or_else(PoisonError::into_inner);
            continue;
        };
        // Eight looks within the shortest limit: a run is reported late by an eighth of its limit at most, unless a bound of the span applies.
        let span = (shortest / 8).clamp(SHORTEST, LONGEST);
        let (held, waited) = CHANGED.wait_timeout(watch, span).unwrap_or_else(PoisonError::into_inner);
        watch = held;
        // A run has come, or the wake-up is spurious. Less than `span` has passed, so nothing is added to `stood`.
        if !waited.timed_out() {
            continue;
        }
        for seen in &mut watch.runs {
            let Some(run) = seen.run.upgrade() else { continue };
            let (turns, running) = run.pulse.now();
            // A run of nodes without a running node is in the hands of the test, which may take any time.
            let is_at_rest = turns != seen.turns || running == 0 && run.kind == Kind::Nodes;
            seen.turns = turns;
            seen.stood = if is_at_rest { Duration::ZERO } else { seen.stood + span };
            if seen.stood >= run.limit {
                seen.stood = Duration::ZERO;
                if !is_debugged() {
                    end(&run, running);
                }
            }
        }
    }
}

/// Prints which runner has not returned, and ends the process.
fn end(run: &Watched, running: usize) -> ! {
    let text = run.complaint(running);
    // The text does not go through `eprintln`: the test that started this thread may capture it, and the captured text is lost when the process ends. A failed
    // write is ignored, because nothing can be done about it.
    let _ = std::io::stderr().write_all(text.as_bytes());
    abort()
}

impl Watched {
    fn complaint(&self, running: usize) -> String {
        let shared = self.shared.get().and_then(Weak::upgrade);
        let name = |host: usize| self.hosts.get(host).map_or("?", |name| name);
        let runner = match (self.kind, self.pulse.runner(running)) {
            (Kind::Nodes, _) => format!("node `{}`", name(running.saturating_sub(1))),
            (_, Some(runner)) => runner.words(&self.hosts),
            (Kind::Own, None) => "the function that makes the program, or a waker,".to_owned(),
            #[cfg(feature = "tokio")]
            (Kind::Tokio, None) => {
                // Only the unstable build of tokio names the polled task and the place where the task was spawned.
                "a task of `tokio::spawn` or `spawn_local`, or the function that makes the program (a task of `Host::spawn` or `Bed::spawn` would be named \
                 with its place),"
                    .to_owned()
            }
        };
        let now = match shared.as_ref().map(|shared| shared.try_now()) {
            Some(Some(now)) => format!("at {} s of the run", Seconds(now)),
            Some(None) => "within a call of the test bed, such as one of a packet law,".to_owned(),
            None => "in a step of the run".to_owned(),
        };
        let mut text = format!(
            "\ntime stands still: {runner} has the thread {now} and has not returned for {} by the wall clock. It loops without an `.await`, blocks, or wakes itself again \
             and again\n",
            Span(self.limit)
        );
        let record = shared.and_then(|shared| shared.try_recorded());
        if let Some(record) = record {
            for line in self.artefacts.lines(&self.seed, &record.hits.clone(), || crate::record::Record::new(self.seed.clone(), record)) {
                // Writing to a `String` cannot fail.
                let _ = writeln!(text, "{line}");
            }
        } else {
            let _ = writeln!(text, "{}", self.seed.advice());
        }
        let _ = writeln!(
            text,
            "The process ends here, because a thread cannot be stopped. `stall_limit` of the test bed, or {STALL_VARIABLE}=10min, sets another limit; \
             {STALL_VARIABLE}=off sets none. Under a debugger the process does not end."
        );
        text
    }
}
