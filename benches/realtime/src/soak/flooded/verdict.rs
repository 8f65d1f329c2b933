//! Rules that the outcome of a soak under floods keeps or breaks.

use serde_json::Value;

use super::{Outcome, PROCESSES, Row};
use crate::soak::verdict::{Judgement, median, too_few, verdict};

/// Returns whether memory is flat \[kB\]: the median of the last third of the looks is at most 2 % and 1 MiB above that of the second third. The first third is
/// left out, in which buffers are touched for the first time.
#[must_use]
pub fn is_flat(second: u64, last: u64) -> bool {
    second > 0 && last <= second + second / 50 + 1024
}

/// Judges an outcome by every rule.
#[must_use]
pub fn judge(outcome: &Outcome) -> Vec<Judgement> {
    vec![valid(&outcome.documents), memory(&outcome.rows), files(&outcome.rows), visited(outcome), arrived(outcome), closed(outcome)]
}

/// The looks of the second third and of the last.
fn thirds(rows: &[Row]) -> Option<[&[Row]; 2]> {
    let third = rows.len() / 3;
    (third > 0).then(|| [&rows[rows.len() - 2 * third..rows.len() - third], &rows[rows.len() - third..]])
}

fn valid([live, relay]: &[Value; 2]) -> Judgement {
    let is_valid = |document: &Value| document["valid"] == true;
    let is_whole = live["ending"] == "complete" && relay["ending"] == "complete";
    let p999 = |document: &Value, key: &str| document[key]["p999"].as_f64().unwrap_or(f64::NAN);
    let why = format!(
        "live: valid {}, {}, 99.9 % of ticks at most {:.0} µs late; relay: valid {}, {}, 99.9 % of datagrams at most {:.0} µs",
        live["valid"],
        live["ending"],
        p999(live, "lateness_us"),
        relay["valid"],
        relay["ending"],
        p999(relay, "release_error_us")
    );
    Judgement { rule: "both runs end by themselves and are valid", verdict: verdict(is_valid(live) && is_valid(relay) && is_whole), why }
}

fn memory(rows: &[Row]) -> Judgement {
    let rule = "memory of each process is flat: the median of the last third at most 2 % and 1 MiB above that of the second";
    let Some(thirds) = thirds(rows) else { return too_few(rule, rows.len()) };
    let of = |place: usize| thirds.map(|rows| median(rows.iter().map(|row| row.processes[place].memory).collect()));
    let medians: Vec<[u64; 2]> = (0..PROCESSES.len()).map(of).collect();
    let why: Vec<String> = PROCESSES.iter().zip(&medians).map(|(name, [second, last])| format!("{name} {second} kB, then {last} kB")).collect();
    Judgement { rule, verdict: verdict(medians.iter().all(|[second, last]| is_flat(*second, *last))), why: why.join("; ") }
}

fn files(rows: &[Row]) -> Judgement {
    let rule = "open files of each process do not grow";
    let Some(thirds) = thirds(rows) else { return too_few(rule, rows.len()) };
    // The least: connections of the flood come and go.
    let of = |place: usize| thirds.map(|rows| rows.iter().map(|row| row.processes[place].files).min().unwrap_or(0));
    let least: Vec<[usize; 2]> = (0..PROCESSES.len()).map(of).collect();
    let why: Vec<String> = PROCESSES.iter().zip(&least).map(|(name, [second, last])| format!("{name} at least {second}, then {last}")).collect();
    // A connection more or less is open at the least crowded look of a third.
    let is_kept = least.iter().all(|[second, last]| *second > 0 && *last <= *second + 2);
    Judgement { rule, verdict: verdict(is_kept), why: why.join("; ") }
}

fn visited(outcome: &Outcome) -> Judgement {
    let visits = &outcome.visits;
    let seat = &outcome.documents[0]["peers"][super::VISITOR as usize]["seat"];
    let why = format!(
        "{} visits, {} joinings; the session took {} samples of {} datagrams; it heard {} new samples of the others",
        visits.visits, visits.joinings, seat["taken"], visits.sent, visits.newest
    );
    let is_in = visits.joinings >= visits.visits && visits.newest > 0 && seat["taken"].as_u64().is_some_and(|taken| taken > 0);
    Judgement { rule: "the peer comes in at each visit and hears the others", verdict: verdict(is_in), why }
}

fn arrived(outcome: &Outcome) -> Judgement {
    let door = &outcome.documents[0]["door"];
    let why = format!(
        "the session handled {} datagrams, answered {} hellos, and the kernel dropped {}; {} connections, {} of them answered",
        door["handled"], door["welcomed"], door["kernel_drops"], outcome.connections.made, outcome.connections.answered
    );
    let sent = outcome.floods.iter().all(|(_, sent)| sent.datagrams > 0) && !outcome.floods.is_empty();
    let handled = door["handled"].as_u64().unwrap_or(0) > outcome.visits.sent && outcome.connections.made > 0;
    Judgement { rule: "each flood arrives", verdict: verdict(sent && handled), why }
}

fn closed(outcome: &Outcome) -> Judgement {
    let let_in = outcome.connections.let_in;
    Judgement { rule: "live control lets nobody in without its token", verdict: verdict(let_in == 0), why: format!("{let_in} let in") }
}
