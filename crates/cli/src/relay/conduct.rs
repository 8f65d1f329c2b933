//! Between a relay, which has a thread of its own, and those who look on.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use cohaptic_relay::{Control, Relay, Report, RunOptions};

use super::setup::Setup;
use super::{failure, status};
use crate::failure::Failure;
use crate::interrupt;
use crate::progress::Progress;
use crate::realtime::{self, Edit, LiveControl, Publisher};

/// Runs until its end, or until the user asks for it. Says too how often each link was changed from outside.
pub(super) fn conduct(
    relay: Relay,
    setup: &Setup,
    options: &RunOptions,
    control: &LiveControl,
    wanted: &Receiver<Edit>,
) -> Result<(Report, Vec<u64>), Failure> {
    const GLANCE: Duration = Duration::from_millis(50);
    let mut publisher = Publisher::new(control.look(), status::publish_every(setup.pairs.len()));
    let (say, heard) = channel();
    let stop = AtomicBool::new(false);
    let mut edits = vec![0; setup.pairs.len()];
    let progress = Progress::of_traffic(&setup.title);
    let report = thread::scope(|scope| {
        let running = thread::Builder::new().name("relay".to_owned()).spawn_scoped(scope, || {
            // Moved, so that it is this thread's alone.
            let heard = heard;
            relay.run(options, &heard, &stop, |view| publisher.offer(|| status::snapshot(view, &setup.pairs, options.tolerance)))
        });
        let running = running.map_err(|error| Failure::System(format!("the relay gets no thread: {error}")))?;
        while !running.is_finished() {
            match wanted.recv_timeout(GLANCE) {
                Ok(Edit { link, model, .. }) => {
                    if let (Some((from, to)), Some(edits)) = (setup.pairs.get(link), edits.get_mut(link)) {
                        // If it has ended meanwhile, so has what could be changed.
                        let is_heard = say.send(Control::SetLink { from: *from, to: *to, model: Box::new(model) }).is_ok();
                        *edits += u64::from(is_heard);
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                // Nobody can change anything.
                Err(RecvTimeoutError::Disconnected) => thread::sleep(GLANCE),
            }
            stop.store(interrupt::requested(), Ordering::Relaxed);
            progress.note(realtime::status(&control.latest()));
        }
        running.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)).map_err(failure)
    });
    progress.clear();
    Ok((report?, edits))
}
