//! Answers of `cohaptic exec`, as text and as JSON documents.

use std::fmt::Write as _;
use std::path::Path;

use cohaptic_exec::{Case, Count, LostPackets, Outcome, Plan, Step, Tried};
use cohaptic_realtime::Wish;
use cohaptic_units::print::{Counted, Span};
use serde::Serialize;

use super::lost;
use super::trials::{Trials, Verdict, needs_seed};
use crate::arguments::ExecArguments;
use crate::document_schema::{document, lateness};
use crate::realtime::{ConfiguredDelay, carried, counts, late, notes};
use crate::shell::CommandLine;

/// Dropped packets of a link that the report names. The document names more.
const NAMED: usize = 32;
/// What to do if no seed has failed.
const FURTHER: &str = ". To find a failure, lose more, delay more, or try more seeds";

/// Describes the run: its commands, and what passed each link.
pub(super) fn describe(plan: &Plan, outcome: &Outcome) -> String {
    let report = &outcome.report;
    let mut text = String::new();
    // Writing to a string cannot fail.
    let mut line = |line: String| {
        let _ = writeln!(text, "{line}");
    };
    for (host, status) in plan.hosts.iter().zip(&outcome.statuses) {
        let command: Vec<_> = host.command.iter().map(|word| word.to_string_lossy()).collect();
        let ended = status.map_or_else(|| "was ended".to_owned(), |status| format!("ended with status {status}"));
        line(format!("{}: {} {ended}", host.name, command.join(" ")));
    }
    let packets: u64 = report.links.iter().map(|link| link.stats.offered()).sum();
    line(format!("  {} in {}", Counted(packets, "packet"), Span::measured(report.elapsed)));
    line(format!("  the run is {}", report.validity));
    if report.release.count > 0 {
        line(format!("  release error: {}", late(&report.release)));
    }
    for link in &report.links {
        let asked = ConfiguredDelay::of(plan.links.between(link.from, link.to));
        let ends = format!("{} -> {}", report.nodes[link.from], report.nodes[link.to]);
        line(format!("  {ends}: {}", carried(&link.stats, &asked, &[])));
        if !link.dropped.is_empty() {
            let (named, more) = link.dropped.split_at(link.dropped.len().min(NAMED));
            let more = if more.is_empty() { "" } else { " and more" };
            line(format!("  {ends} dropped packets = {named:?}{more}"));
        }
    }
    let untaken =
        [("to nobody in this network", report.untaken.no_host), ("malformed", report.untaken.malformed), ("overload", report.untaken.overload)];
    if let Some(untaken) = counts(&untaken) {
        line(format!("  packets that took no link: {untaken}"));
    }
    for (node, refused) in report.nodes.iter().zip(&report.refused).filter(|(_, refused)| **refused > 0) {
        line(format!("  {} that {node} did not take", Counted(*refused, "packet")));
    }
    text.push_str(&notes(&report.prepared, report.validity));
    text
}

/// Returns the answer of `cohaptic exec --json`.
pub(super) fn document(plan: &Plan, outcome: &Outcome, files: Vec<String>) -> impl Serialize {
    let report = &outcome.report;
    let host = |(host, status): (&cohaptic_exec::HostPlan, &Option<u8>)| {
        let command: Vec<_> = host.command.iter().map(|word| word.to_string_lossy().into_owned()).collect();
        document! { name: host.name.clone(), command: command, status: *status }
    };
    let link = |link: &cohaptic_exec::LinkReport| {
        let asked = ConfiguredDelay::of(plan.links.between(link.from, link.to));
        let name = |node: usize| report.nodes[node].clone();
        document! {
            #[serde(flatten)]
            link: cohaptic_answers::link(name(link.from), name(link.to), &link.stats),
            dropped_packets: link.dropped.clone(),
            asked_mean_delay_s: asked.first.map(|delay| delay.as_secs_f64()),
        }
    };
    document! {
        status: outcome.status,
        duration_s: report.elapsed.as_secs_f64(),
        valid: report.validity.is_valid(),
        hosts: plan.hosts.iter().zip(&outcome.statuses).map(host).collect::<Vec<_>>(),
        release_error_us: lateness(&report.release),
        links: report.links.iter().map(link).collect::<Vec<_>>(),
        untaken: document! {
            no_host: report.untaken.no_host,
            malformed: report.untaken.malformed,
            overload: report.untaken.overload,
        },
        refused: report.nodes.iter().zip(&report.refused).map(|(node, packets)| document! { name: node.clone(), packets: *packets }).collect::<Vec<_>>(),
        granted: report.prepared.granted.iter().copied().map(Wish::name).collect::<Vec<_>>(),
        refused_wishes: report.prepared.refused.iter().map(ToString::to_string).collect::<Vec<_>>(),
        files: files,
    }
}

/// Describes a step of a search: `seed 11: fails with status 1, lost command -> world: 2, 6`.
pub(super) fn step(step: Step<'_>, nodes: &[&str]) -> String {
    match step {
        Step::Seed(seed, tried) => format!("seed {seed}: {}", result(tried, nodes)),
        Step::Case(case, count) => format!("losing {}: {}", lost_in_words(&case.lost, nodes), times(count)),
        Step::Ideal(count) => format!("over ideal links: {}", times(count)),
    }
}

/// Describes a run among several equal ones.
pub(super) fn run(number: u32, tried: &Tried, nodes: &[&str]) -> String {
    format!("run {number}: {}", result(tried, nodes))
}

fn result(tried: &Tried, nodes: &[&str]) -> String {
    let result = if tried.status == 0 { "passes".to_owned() } else { format!("fails with status {}", tried.status) };
    format!("{result}, lost {}", lost_in_words(&tried.lost, nodes))
}

fn lost_in_words(lost: &LostPackets, nodes: &[&str]) -> String {
    if lost.is_empty() { "nothing".to_owned() } else { lost::texts(lost, nodes).join("; ") }
}

fn times(Count { failed, runs }: Count) -> String {
    if failed == 0 { "passes".to_owned() } else { format!("fails {failed} of {runs} times") }
}

/// Returns the results of a search that a signal has ended, as the end of a message: the failed seeds, and the smallest case that has failed in each trial.
/// Empty if no seed has failed and no case is known.
pub(super) fn so_far(arguments: &ExecArguments, plan: &Plan, seeds: &[(u64, Tried)], smallest: Option<&(Case, Count)>) -> String {
    let mut text = failed_seeds(seeds).map_or_else(String::new, |failed| format!("\n{failed}"));
    if let Some((case, count)) = smallest {
        text.push('\n');
        text.push_str(&fault(arguments, plan, case, *count));
    }
    text
}

/// Returns the line about the failed seeds, or `None` if none has failed.
fn failed_seeds(seeds: &[(u64, Tried)]) -> Option<String> {
    let failed: Vec<String> = seeds.iter().filter(|(_, tried)| tried.status != 0).map(|(seed, _)| seed.to_string()).collect();
    (!failed.is_empty()).then(|| format!("{} of {} fail: {}", failed.len(), Counted(seeds.len() as u64, "seed"), failed.join(", ")))
}

/// Returns two lines about a case: how often the command fails, and the command line that repeats the case.
fn fault(arguments: &ExecArguments, plan: &Plan, case: &Case, count: Count) -> String {
    let packets = case.lost.len() as u64;
    let cause = if packets == 0 { "without a lost packet".to_owned() } else { format!("if {} lost", were(packets)) };
    format!("the command {} {cause}:\n  {}", times(count), again(arguments, plan, case))
}

/// Describes the result of a search, or of equal runs.
pub(super) fn trials(arguments: &ExecArguments, plan: &Plan, trials: &Trials) -> String {
    let mut text = String::new();
    let mut line = |line: &str| {
        text.push_str(line);
        text.push('\n');
    };
    if let Some(failed) = failed_seeds(&trials.seeds) {
        line(&failed);
    }
    // Without packets the runs say nothing of the network: the command has probably asked a server at localhost.
    let if_network = |words: &'static str| if trials.packets == 0 { "" } else { words };
    match &trials.verdict {
        Verdict::Passed => line(&format!("the command passes with {}{}", Counted(trials.seeds.len() as u64, "seed"), if_network(FURTHER))),
        Verdict::Elsewhere => line(&format!("the command fails over ideal links too{}", if_network(", so that the network is not the cause"))),
        Verdict::Repeated(Count { failed: 0, runs }) => line(&format!("the command passes {runs} of {runs} times")),
        Verdict::Repeated(count) => line(&format!("the command {}", times(*count))),
        Verdict::Lost(case, Count { failed: 0, runs }) => line(&format!(
            "seed {} has failed, and the loss of the same packets does not fail in {}: the cause may be a race in the command, or the instants of \
             packets. Repeat the search with more seeds, or the seed with --runs",
            case.seed,
            Counted(u64::from(*runs), "run")
        )),
        Verdict::Lost(case, count) => line(&fault(arguments, plan, case, *count)),
    }
    if trials.packets == 0 {
        line("no packet has passed a link");
        // A file of hosts has no option for the loopback, and in a file without a world no host has the name `host`.
        if arguments.command.is_empty() {
            line(&format!("hosts reach each other by their names, as in http://{}:8000", plan.hosts[0].name));
        } else if !arguments.loopback {
            line("with --loopback, packets of the command to localhost pass a link too. A server beside the command has the name host, as in");
            line("  -- env SERVER=http://host:8000 COMMAND");
        }
    }
    if !trials.printed.is_empty() {
        line("the last run that failed printed:");
        trials.printed.iter().for_each(|printed| line(&format!("  | {printed}")));
    }
    if trials.late > 0 {
        line(&format!("{} of {} were not valid: packets left their links late, as on a busy machine", trials.late, Counted(trials.runs, "run")));
    }
    text
}

/// Returns `1 packet is` or `2 packets are`.
fn were(packets: u64) -> String {
    format!("{} {}", Counted(packets, "packet"), if packets == 1 { "is" } else { "are" })
}

/// Returns the command line that runs a case.
fn again(arguments: &ExecArguments, plan: &Plan, case: &Case) -> String {
    let line = match arguments.spec.as_slice() {
        [file] if arguments.command.is_empty() => CommandLine::new("exec", Path::new(file), &arguments.set),
        words => CommandLine::of_words("exec", words),
    };
    line.option("--back", &arguments.back)
        .option("--listen", &arguments.listen)
        .flag("--loopback", arguments.loopback)
        .option("--dns", arguments.dns)
        .option("--seed", needs_seed(plan, &case.lost).then_some(case.seed))
        .option("--lose", lost::texts(&case.lost, &plan.nodes()))
        .program(arguments.command.iter().map(|word| word.to_string_lossy()))
        .text()
}

/// Returns the answer of `cohaptic exec --json` with `--seeds` or `--runs`.
pub(super) fn trials_document(arguments: &ExecArguments, plan: &Plan, trials: &Trials) -> impl Serialize {
    let nodes = plan.nodes();
    let lost = |lost: &LostPackets| {
        let link = |((from, to), packets): ((usize, usize), Vec<u64>)| {
            document! { from: nodes[from].to_owned(), to: nodes[to].to_owned(), packets: packets }
        };
        lost.by_link().into_iter().map(link).collect::<Vec<_>>()
    };
    let (verdict, case, count) = match &trials.verdict {
        Verdict::Passed => ("passed", None, None),
        Verdict::Elsewhere => ("elsewhere", None, None),
        Verdict::Lost(case, count) => ("failed", Some(case), Some(count)),
        Verdict::Repeated(count) => (if count.failed == 0 { "passed" } else { "failed" }, None, Some(count)),
    };
    document! {
        verdict: verdict,
        status: trials.status,
        seeds: trials.seeds.iter().map(|(seed, tried)| document! { seed: *seed, status: tried.status, lost: lost(&tried.lost) }).collect::<Vec<_>>(),
        seed: case.map(|case| case.seed),
        lost: case.map(|case| lost(&case.lost)),
        failed: count.map(|count| count.failed),
        of: count.map(|count| count.runs),
        command: case.map(|case| again(arguments, plan, case)),
        printed: trials.printed.clone(),
        runs: trials.runs,
        not_valid: trials.late,
        packets: trials.packets,
    }
}
