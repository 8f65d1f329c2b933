//! `cohaptic relay --tcp`: connections of TCP between programs, with a delay, a rate and faults. Runs on every system.

mod answer;
mod control;
mod setup;

use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use cohaptic_realtime::Tolerance;
use cohaptic_streams::{Control, Report, RunOptions, Streams, StreamsError};

use crate::arguments::RelayArguments;
use crate::document_schema::DocumentSchema;
use crate::failure::{Failure, INTERRUPTED};
use crate::progress::Progress;
use crate::realtime::{LiveControl, Publisher, own_address, say, some_length};
use crate::{interrupt, output};
use control::StreamKeys;
use setup::Setup;

/// Runs a relay of TCP and prints its report.
pub(crate) fn relay(arguments: &RelayArguments) -> Result<ExitCode, Failure> {
    let length = some_length(arguments.length)?;
    let mut setup = Setup::new(arguments)?;
    let mut streams = Streams::bind(setup.config.clone()).map_err(failure)?;
    for (proxy, address) in setup.config.proxies.iter().zip(streams.addresses()) {
        say(&format!("listening on {address} for connections to {}", proxy.to));
        own_address(*address).into_iter().for_each(|own| say(&format!("programs on other machines connect to {own}")));
    }
    setup.opened(streams.addresses());
    let (changes, wanted) = channel();
    let editor = StreamKeys { keys: std::mem::take(&mut setup.keys), changes };
    let control = LiveControl::open(&arguments.real_time, control::description(&setup), Box::new(editor))?;
    let options = RunOptions { tolerance: setup.tolerance, duration: length, ..RunOptions::default() };
    let (report, edits) = conduct(&mut streams, &setup, &options, &control, &wanted)?;
    let is_interrupted = interrupt::requested();
    let asked = setup.asked(&edits);
    output::answer(
        arguments.json,
        DocumentSchema::RELAY_TCP,
        &answer::document(&setup, &report, &asked, is_interrupted),
        || answer::describe(&setup, &report, &asked),
        output::NO_FILES,
    )?;
    Ok(if is_interrupted { ExitCode::from(INTERRUPTED) } else { ExitCode::SUCCESS })
}

fn failure(error: StreamsError) -> Failure {
    if matches!(error, StreamsError::ToItself { .. }) { Failure::Input(error.to_string()) } else { Failure::System(error.to_string()) }
}

/// Runs the relay until its end, or until the user asks for the end. Returns the report and the number of changes from outside, indexed by line.
fn conduct(
    streams: &mut Streams,
    setup: &Setup,
    options: &RunOptions,
    control: &LiveControl,
    wanted: &Receiver<Control>,
) -> Result<(Report, Vec<u64>), Failure> {
    const GLANCE: Duration = Duration::from_millis(50);
    const PUBLISH: Duration = Duration::from_millis(100);
    // The counters are a report from the first moment on, and the relay checks `stop` all the time. A signal therefore ends the run in order.
    interrupt::has_results();
    let mut publisher = Publisher::new(control.look(), PUBLISH);
    let (say, heard) = channel();
    let stop = AtomicBool::new(false);
    let mut edits = vec![0; 2 * setup.config.proxies.len()];
    let progress = Progress::of_traffic(&setup.title);
    let tolerance: Tolerance = options.tolerance;
    let report = thread::scope(|scope| {
        let running = thread::Builder::new().name("relay".to_owned()).spawn_scoped(scope, || {
            // A receiver cannot be shared between threads, so the closure takes the receiver by value.
            let heard = heard;
            streams.run(options, &heard, &stop, |view| publisher.offer(|| control::snapshot(view, setup, tolerance)))
        });
        let running = running.map_err(|error| Failure::System(format!("the system gives the relay no thread: {error}")))?;
        while !running.is_finished() {
            match wanted.recv_timeout(GLANCE) {
                Ok(change) => {
                    let line = change.line;
                    // A relay that has just ended no longer receives. Such a change is not counted.
                    if say.send(change).is_ok()
                        && let Some(edits) = edits.get_mut(line)
                    {
                        *edits += 1;
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                // Without live control no change can come, and the receiver returns at once. The sleep keeps this loop from spinning.
                Err(RecvTimeoutError::Disconnected) => thread::sleep(GLANCE),
            }
            stop.store(interrupt::requested(), Ordering::Relaxed);
            progress.note(control::status(&control.latest()));
        }
        running.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)).map_err(failure)
    });
    progress.clear();
    Ok((report?, edits))
}
