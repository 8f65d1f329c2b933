//! `cohaptic exec` with `--seeds` or `--runs`: runs the command many times, counts its failures, and searches for the lost packets behind the failures.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};

use cohaptic_exec::{Case, Count, Failed, Found, HostPlan, Line, LostPackets, Outcome, Output, Plan, Search, Step, Trial, Tried};

use super::{answer, write};
use crate::arguments::ExecArguments;
use crate::document_schema::DocumentSchema;
use crate::failure::Failure;
use crate::output;
use crate::realtime::say;

/// Runs of a set of lost packets, unless `--runs` says otherwise.
const RUNS: u32 = 5;
/// Last lines of a failed run that are kept.
const KEPT_LINES: usize = 20;

/// Results of all runs.
pub(super) struct Trials {
    /// Result of each seed, in the order of the seeds; empty without `--seeds`.
    pub(super) seeds: Vec<(u64, Tried)>,
    pub(super) verdict: Verdict,
    /// Status of the last failed run; 0 if no run has failed.
    pub(super) status: u8,
    /// Last lines of the last failed run.
    pub(super) printed: Vec<String>,
    /// Runs, failed and passed.
    pub(super) runs: u64,
    /// Runs that were not valid, because packets were late.
    pub(super) late: u64,
    /// Packets that were offered to the links in all runs.
    pub(super) packets: u64,
}

/// Conclusion of all runs.
pub(super) enum Verdict {
    /// No seed has failed.
    Passed,
    /// The command fails over ideal links too.
    Elsewhere,
    /// The command fails with these lost packets.
    Lost(Case, Count),
    /// Failures of the plan as it is, without a search.
    Repeated(Count),
}

/// Reason for an early end.
pub(super) enum Stop {
    /// Number of a signal that asks this program to end, and the results until then in words, empty without results.
    Signal(u8, String),
    /// A run has failed before its command.
    Failed(Failed),
    /// A file or standard output cannot be written.
    Failure(Failure),
}

impl From<Failure> for Stop {
    fn from(failure: Failure) -> Self {
        Self::Failure(failure)
    }
}

/// Runs the trials, and prints their results. Returns the exit status.
pub(super) fn run(arguments: &ExecArguments, plan: &Plan) -> Result<u8, Stop> {
    let bench = RefCell::new(Bench::new(arguments, plan));
    let mut seeds = Vec::new();
    // Latest case that has failed in each trial. The search goes on from such a case to smaller ones alone, so that the latest one is the smallest.
    let mut smallest = None;
    let verdict = match &arguments.seeds {
        Some(range) => {
            let search = Search { seeds: range.clone(), runs: arguments.runs.unwrap_or(RUNS), until_failure: arguments.until_failure };
            let hear = |step: Step<'_>| {
                match step {
                    Step::Seed(seed, tried) => seeds.push((seed, tried.clone())),
                    Step::Case(case, count) if count.is_each() => smallest = Some((case.clone(), count)),
                    Step::Case(..) | Step::Ideal(_) => {}
                }
                bench.borrow_mut().say(&answer::step(step, &plan.nodes()));
            };
            // A search may take long. Its end by a signal keeps what the search has found.
            let found = search.run(|trial| bench.borrow_mut().run(&plan.of_trial(trial)), hear).map_err(|stop| match stop {
                Stop::Signal(number, _) => Stop::Signal(number, answer::so_far(arguments, plan, &seeds, smallest.as_ref())),
                Stop::Failed(_) | Stop::Failure(_) => stop,
            });
            match found? {
                Found::Nothing => Verdict::Passed,
                Found::Elsewhere => Verdict::Elsewhere,
                Found::Case(case, count) => {
                    bench.borrow_mut().record(&plan.of_trial(Trial::Case(&case)), search.runs)?;
                    Verdict::Lost(case, count)
                }
            }
        }
        None => Verdict::Repeated(bench.borrow_mut().repeat(arguments.runs.unwrap_or(1))?),
    };
    let Bench { status, printed, runs, late, packets, unsaid, .. } = bench.into_inner();
    if let Some(failure) = unsaid {
        return Err(Stop::Failure(failure));
    }
    let trials = Trials { seeds, verdict, status, printed: printed.into(), runs, late, packets };
    if arguments.json {
        output::json(DocumentSchema::EXEC_TRIALS, &answer::trials_document(arguments, plan, &trials))?;
    } else {
        output::text(&answer::trials(arguments, plan, &trials))?;
    }
    Ok(trials.status)
}

/// Place where a plan is run again and again.
struct Bench<'a> {
    arguments: &'a ExecArguments,
    /// Plan whose commands write to this program line by line, and which writes no captures.
    plan: Plan,
    status: u8,
    printed: VecDeque<String>,
    runs: u64,
    late: u64,
    packets: u64,
    /// `true` after the files of `--out` have a failed run.
    is_recorded: bool,
    /// First failure of standard output. The next run does not begin any more.
    unsaid: Option<Failure>,
}

impl<'a> Bench<'a> {
    fn new(arguments: &'a ExecArguments, plan: &Plan) -> Self {
        let plan = Self::piped(plan);
        Self { arguments, plan, status: 0, printed: VecDeque::new(), runs: 0, late: 0, packets: 0, is_recorded: false, unsaid: None }
    }

    fn piped(plan: &Plan) -> Plan {
        let hosts = plan.hosts.iter().map(|host| HostPlan { output: Output::Lines, ..host.clone() });
        Plan { hosts: hosts.collect(), captures: None, ..plan.clone() }
    }

    /// Prints a line. Under `--json` standard output is for the document alone, so that the line goes to standard error.
    fn say(&mut self, line: &str) {
        if self.arguments.json {
            say(line);
        } else if self.unsaid.is_none() {
            self.unsaid = output::text(&format!("{line}\n")).err();
        }
    }

    /// Runs a plan without captures.
    fn run(&mut self, plan: &Plan) -> Result<Tried, Stop> {
        self.tried(&Self::piped(plan)).map(|(tried, _)| tried)
    }

    /// Runs a plan with captures, if `--out` is given, until a run has failed, and at most `runs` times.
    fn record(&mut self, plan: &Plan, runs: u32) -> Result<(), Stop> {
        for _ in 0..runs {
            if self.arguments.out.is_none() || self.is_recorded {
                break;
            }
            self.captured(plan)?;
        }
        Ok(())
    }

    /// Runs the plan of the arguments `runs` times, and counts the failures. With `--out` the first failed run is kept, or else the last run.
    fn repeat(&mut self, runs: u32) -> Result<Count, Stop> {
        let mut count = Count::default();
        while count.runs < runs {
            let plan = self.plan.clone();
            let tried = if self.is_recorded || self.arguments.out.is_none() { self.run(&plan)? } else { self.captured(&plan)? };
            count.add(&tried);
            self.say(&answer::run(count.runs, &tried, &self.plan.nodes()));
        }
        Ok(count)
    }

    /// Runs a plan with captures, and writes the report.
    fn captured(&mut self, plan: &Plan) -> Result<Tried, Stop> {
        let plan = Plan { captures: self.arguments.out.clone(), ..Self::piped(plan) };
        let (tried, outcome) = self.tried(&plan)?;
        self.is_recorded = tried.status != 0;
        if let Some(folder) = &self.arguments.out {
            write(folder, &plan, &outcome)?;
        }
        Ok(tried)
    }

    fn tried(&mut self, plan: &Plan) -> Result<(Tried, Outcome), Stop> {
        if let Some(failure) = self.unsaid.take() {
            return Err(Stop::Failure(failure));
        }
        let printed = Mutex::new(VecDeque::new());
        let keep = |line: Line<'_>| {
            let mut printed = printed.lock().unwrap_or_else(PoisonError::into_inner);
            if printed.len() == KEPT_LINES {
                printed.pop_front();
            }
            let text = String::from_utf8_lossy(line.bytes);
            printed.push_back(if plan.hosts.len() > 1 { format!("{} | {text}", plan.hosts[line.host].name) } else { text.into_owned() });
        };
        let outcome = cohaptic_exec::run(plan, &keep).map_err(Stop::Failed)?;
        if let Some(signal) = outcome.signal {
            return Err(Stop::Signal(signal, String::new()));
        }
        self.runs += 1;
        self.late += u64::from(!outcome.report.validity.is_valid());
        self.packets += outcome.report.links.iter().map(|link| link.stats.offered()).sum::<u64>();
        if outcome.status != 0 {
            self.status = outcome.status;
            self.printed = printed.into_inner().unwrap_or_else(PoisonError::into_inner);
        }
        Ok((Tried { status: outcome.status, lost: outcome.report.lost() }, outcome))
    }
}

/// Returns whether links with these losses still draw random numbers, so that a run needs its seed.
pub(super) fn needs_seed(plan: &Plan, lost: &LostPackets) -> bool {
    plan.losing(lost).links.configs().iter().any(|link| link.has_chance())
}
