//! Between a router, which has a thread of its own, and those who look on.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::thread;
use std::time::Duration;

use cohaptic_linkfile::router::{RouterFile, Side};
use cohaptic_realtime::{Prepared, Validity, prepare_thread};
use cohaptic_router::{Report, Router, RunError};
use cohaptic_units::Instant;

use super::status;
use crate::arguments::RouterArguments;
use crate::failure::Failure;
use crate::interrupt;
use crate::progress::Progress;
use crate::realtime::{self, ConfiguredDelay, Edit, LiveControl, Publisher};

/// What a router did.
pub(super) struct RouterRun {
    pub(super) report: Report,
    pub(super) prepared: Prepared,
    pub(super) validity: Validity,
    /// What each link was asked for, from the left and then from the right.
    pub(super) asked: Vec<ConfiguredDelay>,
    pub(super) ending: Ending,
}

/// How it came to its end.
#[derive(Debug)]
pub(super) enum Ending {
    Complete,
    Interrupted,
    /// A device is gone.
    Failed(RunError),
}

/// Runs until its end, or until the user asks for it.
pub(super) fn conduct(
    router: Router,
    file: &RouterFile,
    arguments: &RouterArguments,
    until: Option<Instant>,
    control: &LiveControl,
    wanted: Receiver<Edit>,
) -> Result<RouterRun, Failure> {
    const GLANCE: Duration = Duration::from_millis(50);
    let stop = AtomicBool::new(false);
    let progress = Progress::of_traffic(&crate::input::named(&arguments.file).display().to_string());
    let publisher = Publisher::new(control.look(), Duration::from_millis(100));
    let ran = thread::scope(|scope| {
        let running = thread::Builder::new()
            .name("router".to_owned())
            .spawn_scoped(scope, || route(router, file, arguments, until, &stop, wanted, publisher))
            .map_err(|error| Failure::System(format!("the router gets no thread: {error}")))?;
        while !running.is_finished() {
            thread::sleep(GLANCE);
            stop.store(interrupt::requested(), Ordering::Relaxed);
            progress.note(realtime::status(&control.latest()));
        }
        Ok(running.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    });
    progress.clear();
    ran
}

/// The thread that has to be on time.
fn route(
    mut router: Router,
    file: &RouterFile,
    arguments: &RouterArguments,
    until: Option<Instant>,
    stop: &AtomicBool,
    wanted: Receiver<Edit>,
    mut publisher: Publisher,
) -> RouterRun {
    /// So soon is a change taken up.
    const LOOK: Duration = Duration::from_millis(20);
    let prepared = prepare_thread(&arguments.real_time.wishes());
    let tolerance = arguments.real_time.tolerance();
    let mut asked: Vec<ConfiguredDelay> = file.links.iter().flat_map(|link| [ConfiguredDelay::of(&link.model); 2]).collect();
    let ended = router.run(stop, until, LOOK, |router| {
        for Edit { link: lane, model, .. } in wanted.try_iter() {
            let (Some(link), Some(asked)) = (file.links.get(lane / 2), asked.get_mut(lane)) else { continue };
            let changed = router.set_link(&link.name, Some(Side::BOTH[lane % 2]), &model);
            asked.changes += u64::from(changed.is_ok());
        }
        publisher.offer(|| {
            let validity = tolerance.judge(router.lateness());
            status::snapshot(&router.report(), validity)
        });
    });
    let ending = match ended {
        Err(error) => Ending::Failed(error),
        Ok(()) if interrupt::requested() => Ending::Interrupted,
        Ok(()) => Ending::Complete,
    };
    RouterRun { report: router.report(), prepared, validity: tolerance.judge(router.lateness()), asked, ending }
}
