//! Loops of 1 kHz that do nothing but wait: what the system gives at best, and what one writes at first.

use std::error::Error;
use std::time::Duration;

use cohaptic_benches_realtime::machine;
use cohaptic_realtime::{Clock as _, Lateness, MonotonicClock, Pacer, Pacing, Wishes, prepare_thread};

use crate::{Loop, TICK};

/// A thread that waits for each tick's time: with `clock_nanosleep`, and spins the last of it if asked.
pub(crate) fn thread(pacing: Pacing, wishes: Wishes, span: Duration) -> Result<Loop, Box<dyn Error>> {
    let thread = std::thread::spawn(move || -> std::io::Result<Loop> {
        let prepared = prepare_thread(&wishes);
        let (clock, mut pacer, mut ticks) = (MonotonicClock::start(), Pacer::new(pacing), Lateness::new());
        let (mut due, before) = (clock.now(), machine::thread_time());
        let end = due + span;
        while due < end {
            due += TICK;
            match pacing {
                // Without what a pacer does to be on time all the same.
                Pacing::Sleep => _ = clock.block(Some(due), &[])?,
                Pacing::Spin { .. } => _ = pacer.wait(&clock, Some(due), &[])?,
            }
            ticks.record(clock.now().saturating_duration_since(due));
        }
        let refused = prepared.refused.iter().map(ToString::to_string).collect();
        Ok(Loop { ticks: ticks.summary(), releases: None, processor: machine::thread_time() - before, refused })
    });
    Ok(thread.join().map_err(|_| "the thread panicked")??)
}

/// An interval of tokio, on a runtime of one thread that has nothing else to do.
pub(crate) fn tokio_interval(span: Duration) -> Result<Loop, Box<dyn Error>> {
    let thread = std::thread::spawn(move || -> std::io::Result<Loop> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build()?;
        let before = machine::thread_time();
        let mut ticks = Lateness::new();
        runtime.block_on(async {
            let mut interval = tokio::time::interval(TICK);
            // The first is due at once.
            let mut due = interval.tick().await;
            let end = due + span;
            while due < end {
                due = interval.tick().await;
                ticks.record(due.elapsed());
            }
        });
        Ok(Loop { ticks: ticks.summary(), releases: None, processor: machine::thread_time() - before, refused: Vec::new() })
    });
    Ok(thread.join().map_err(|_| "the thread panicked")??)
}
