//! Content of the experimenter's page: connected people, place of the group in the study, possible commands, and verdict on the last trial.

use std::time::Instant as Clock;

use cohaptic_study::Step;
use serde_json::{Value, json};

use super::lab::Lab;
use super::people::Work;
use super::state::State;

/// Returns the overview as a JSON object.
pub(super) fn of(lab: &Lab, state: &State) -> Value {
    let people: Vec<Value> = lab
        .addresses_of(state)
        .into_iter()
        .zip(&lab.hands)
        .enumerate()
        .map(|(seat, ((code, address), hand))| {
            json!({
                "code": code,
                "page": state.people.page_name(seat),
                "connected": hand.is_connected(),
                "hidden": hand.is_hidden(),
                "round_trip_s": hand.latest_trip().map(|trip| trip.as_secs_f64()),
                "address": address,
            })
        })
        .collect();
    let (place, next) = place(lab, state);
    let condition = match state.session.step() {
        Step::Trial(plan) => Some(lab.study.conditions[plan.condition].label.as_str()),
        Step::Questions { .. } | Step::Break { .. } | Step::Done | Step::Abandoned => None,
    };
    json!({
        "title": lab.study.title,
        "group": state.session.group(),
        "where": place,
        "condition": condition,
        "next": next.unwrap_or("Next"),
        "may": { "next": next.is_some(), "repeat": state.may_repeat(), "abandon": state.may_abandon() },
        "last": state.last.as_ref().map(|(said, _)| said),
        "last_valid": state.last.as_ref().map(|(_, is_valid)| is_valid),
        "people": people,
    })
}

/// Returns the effect of `next` at this point, as the button says; `None` if `next` is refused now.
pub(super) fn next_name(lab: &Lab, state: &State) -> Option<&'static str> {
    place(lab, state).1
}

/// Returns the place of the group in the study, in words, and the effect of `next`; `None` if `next` is refused now.
fn place(lab: &Lab, state: &State) -> (String, Option<&'static str>) {
    let codes = |is_one: &dyn Fn(usize) -> bool| -> String {
        let codes: Vec<String> =
            state.session.people().iter().enumerate().filter(|(seat, _)| is_one(*seat)).map(|(_, code)| code.to_string()).collect();
        codes.join(" and ")
    };
    match state.session.step() {
        Step::Done if state.is_closed && state.is_full => ("The group is done, and the study is complete".to_owned(), Some("End the study")),
        Step::Done if state.is_closed => ("The group is done".to_owned(), Some("Begin the next group")),
        Step::Abandoned if state.is_closed => ("The group was abandoned: its row is given again".to_owned(), Some("Begin the next group")),
        Step::Done | Step::Abandoned => ("The group has ended: its tables are being written".to_owned(), None),
        _ if !state.people.has_begun() => ("Codes, consent and instructions".to_owned(), None),
        Step::Trial(plan) => {
            let practice = if plan.practice { ", for practice" } else { "" };
            let again = if plan.repeats.is_some() { ", a repetition" } else { "" };
            let trial = format!("Trial {} of {}{practice}{again}", plan.code.number, plan.of);
            match state.people.work {
                Work::Starting | Work::Running => (format!("{trial}: under way"), None),
                Work::Keeping => (format!("{trial}: is being kept"), None),
                Work::None => {
                    let waits = codes(&|seat| !state.people.is_ready(seat));
                    (format!("{trial}: waits for {waits}"), lab.missing(state).is_empty().then_some("Begin the trial"))
                }
            }
        }
        Step::Questions { due, .. } => (format!("Questions: waits for {}", codes(&|seat| !due[seat].is_empty())), None),
        Step::Break { .. } => {
            let left = state.break_end.map_or(0, |end| end.saturating_duration_since(Clock::now()).as_secs());
            if state.people.may_end_break { ("Break: may end".to_owned(), Some("End the break")) } else { (format!("Break: {left} s more"), None) }
        }
    }
}
