//! `cohaptic study` with people: serves the pages of a group and of its experimenter, and runs one trial after the other.

mod access;
mod hands;
mod lab;
mod overview;
mod people;
mod requests;
mod state;
mod text;
mod trial;

use std::net::SocketAddr;
use std::process::ExitCode;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use cohaptic_control::{Board, LinkEditor, ServeError, Server, ServerConfig, serve_study};
use cohaptic_harness::task::task_words;
use cohaptic_scene::TaskOutcome;
use cohaptic_study::{Fault, GroupCode, Players, Sequence, Step, StudyFolder, TrialFacts, TrialPlan};

use self::access::{Access, AccessFile};
use self::lab::{Lab, Site, Task};
use self::state::Wish;
use self::trial::Ended;
use crate::arguments::StudyRunArguments;
use crate::failure::Failure;
use crate::interrupt;
use crate::live::onlookers;
use crate::realtime::{reached_from_elsewhere, refused_server, say, token_of};
use crate::study::failure;

/// Time between two looks at signals and at the time of a break.
const LOOK: Duration = Duration::from_millis(100);

/// Locks the mutex, also if another thread panicked while it held the lock.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Links of a study, which its conditions alone set.
struct NoLinks;

impl LinkEditor for NoLinks {
    fn keys(&self, _: usize) -> Vec<(String, String)> {
        Vec::new()
    }

    fn change(&mut self, _: &[usize], _: &[(String, String)]) -> Result<(), String> {
        Err("the condition sets the links of a study".to_owned())
    }
}

/// Serves the groups that the study still needs, until the experimenter ends the study, or until Ctrl-C.
pub(super) fn serve(arguments: &StudyRunArguments, folder: StudyFolder) -> Result<ExitCode, Failure> {
    let file = AccessFile::of(folder.path());
    let kept = file.read();
    let Some(session) = folder.next_group() else {
        // A crash may have come between the last session and its tables, or before the addresses were removed.
        folder.write_tables().map_err(failure)?;
        file.remove();
        say("the study is complete: no group is needed any more");
        return Ok(ExitCode::SUCCESS);
    };
    let lab = Arc::new(Lab::new(folder, session, file));
    let board = board(&lab)?;
    let server = open(arguments, &lab, &board, kept.as_ref())?;
    let url = reached_from_elsewhere(server.address(), server.url());
    let site = url.split_once("/?token=").map_or(url.as_str(), |(site, _)| site).to_owned();
    lab.open(Site { url: site, port: server.address().port(), experimenter: server.token().clone() }, kept.as_ref())?;
    // Each event is on the disk before the next, so that a signal ends the program at once between two events.
    interrupt::has_results();
    say(&format!("experimenter: {url}"));
    while !interrupt::requested() {
        match lab.next_task(LOOK)? {
            None => {}
            Some(Task::Announce(addresses)) => addresses.iter().for_each(|(code, address)| say(&format!("{code}: {address}"))),
            Some(Task::End) => {
                // The answer to the experimenter goes out before the server ends.
                thread::sleep(LOOK);
                break;
            }
            Some(Task::Close) => lab.close()?,
            Some(Task::Trial(plan)) => one_trial(arguments, &lab, &board, &plan)?,
        }
    }
    if interrupt::requested() {
        say("what is done is kept; repeat the command to go on from there, with the same addresses");
    }
    Ok(ExitCode::SUCCESS)
}

/// Returns a board for the scene of the first trial of the study.
fn board(lab: &Lab) -> Result<Arc<Board>, Failure> {
    let first = Sequence::new(&lab.study, GroupCode::of_index(0), 0);
    let Step::Trial(plan) = first.step() else { unreachable!("a study has trials") };
    let scene = lab.study.trial_scene(&plan, Players::People)?.scene;
    Ok(Arc::new(Board::new(onlookers::description(&scene, &onlookers::pairs(&scene)))))
}

/// Starts the server, at the port and with the token of before a crash, unless the arguments name others.
fn open(arguments: &StudyRunArguments, lab: &Arc<Lab>, board: &Arc<Board>, kept: Option<&Access>) -> Result<Server, Failure> {
    let real_time = &arguments.real_time;
    let wanted = real_time.control.unwrap_or_else(|| SocketAddr::from(([127, 0, 0, 1], 0)));
    let given = token_of(real_time)?;
    let token = given.or_else(|| kept.and_then(|access| access.experimenter.parse().ok()));
    let start = |address: SocketAddr| {
        let config = ServerConfig { token: token.clone(), allow_remote: real_time.allow_remote, ..ServerConfig::new(address) };
        serve_study(config, Arc::clone(board), Box::new(NoLinks), lab.guests.clone(), Arc::clone(lab) as _)
    };
    let port_of_before = kept.filter(|_| wanted.port() == 0).map(|access| SocketAddr::new(wanted.ip(), access.port));
    let server = match port_of_before.map(start) {
        // The port belongs to another program meanwhile, so the server gets a new port, and people need new addresses.
        Some(Err(ServeError::Listen { .. })) | None => start(wanted),
        Some(other) => other,
    };
    server.map_err(|error| refused_server(&error))
}

/// Runs a trial and keeps it.
fn one_trial(arguments: &StudyRunArguments, lab: &Arc<Lab>, board: &Arc<Board>, plan: &TrialPlan) -> Result<(), Failure> {
    let trial = lab.study.trial_scene(plan, Players::People)?;
    let staged = lab.staging()?;
    let Ended { report, mut faults } = trial::run(&arguments.real_time, lab, board, &trial, &staged)?;
    let wish = lab.end_trial();
    if interrupt::requested() {
        // The trial is run again when the study goes on.
        return Ok(());
    }
    match wish {
        Wish::Abandon => return lab.abandon_trial(),
        Wish::Repeat => faults.push(Fault::Repeated),
        Wish::None => {}
    }
    faults.sort_unstable();
    faults.dedup();
    let task = report.task.as_ref().map(|task| task_words(task, &trial.scene)).unwrap_or_default();
    let why: Vec<&str> = faults.iter().map(|fault| words(*fault)).collect();
    let verdict = if why.is_empty() { "valid".to_owned() } else { format!("not valid: {}", why.join(", ")) };
    let of_experimenter = format!("{}: {task}, {verdict}", plan.code);
    let of_people = match (why.first(), report.task.as_ref().map(|task| task.outcome)) {
        (Some(why), _) => format!("The last trial does not count: {why}."),
        (None, Some(TaskOutcome::Done)) => "The last trial is done.".to_owned(),
        (None, Some(TaskOutcome::TimedOut)) => "The time of the last trial was over.".to_owned(),
        (None, Some(_) | None) => "The last trial has ended.".to_owned(),
    };
    say(&of_experimenter);
    let round_trips = lab.hands.iter().map(hands::Hand::round_trips).collect();
    lab.keep_trial(TrialFacts { faults, late_ticks: report.late_ticks, round_trips }, [of_experimenter, of_people])
}

/// Returns the reason for which a trial is not valid, in words for people.
const fn words(fault: Fault) -> &'static str {
    match fault {
        Fault::LateTicks => "the computer was too busy",
        Fault::HiddenPage => "a page was hidden",
        Fault::SilentPointer => "a page said nothing for a second",
        Fault::LostPartner => "a connection was lost",
        Fault::Repeated => "it is repeated",
    }
}
