//! `cohaptic study` with people, without a browser: scripted pages of a group go through a whole study, with a refusal, a trial that is not valid, and a crash.

use std::thread::{JoinHandle, sleep, spawn};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::http::Control;
use super::play::Page;
use super::session::Session;
use super::{PATIENCE, wait_for};
use crate::integration::desk::Desk;

/// Two people hold an object on a line, and bring it to 30 mm.
pub(super) const SCENE: &str = r#"
[scene]
title = "Move it together"
duration = "20s"

[object]
mass = 0.45

[coordination]
strategy = "average-position"
stiffness = 500.0
damping = 5.0
update = "8ms"

[peer]
kind = "pointer"
device = { mass = 0.1, damping = 5.0 }
coupling = { stiffness = 1000.0, damping = 5.0 }

[[peers]]
name = "left"

[[peers]]
name = "right"

[link]
delay = "5ms"

[task]
kind = "reach"
targets = [0.03]
radius = 0.01
dwell = "100ms"
timeout = "10s"
"#;

pub(super) const STUDY: &str = r#"
[study]
title = "Moving <b>together</b>"
scene = "scene.toml"
participants = 2
group = 2
order = "given"
trials = 1
break = { every = 2, at-least = "200ms" }
consent = "consent.md"
instructions = "task.md"

[conditions]
"link.delay" = ["5ms", "20ms"]

[[questions]]
after = "condition"
kind = "tlx"

[[questions]]
name = "together"
after = "study"
kind = "scale"
text = "How much did it feel as if you held one object together?"
ends = ["not at all", "completely"]
steps = 7

[analysis]
measures = ["task_time_s"]
"#;

pub(super) fn desk() -> Desk {
    let desk = Desk::with("scene.toml", SCENE);
    desk.write("study.toml", STUDY);
    desk.write("consent.md", "# Taking part\n\nYou may stop at any time, *without* a reason.\n\n- Positions are kept.\n- Names are not.\n");
    desk.write("task.md", "Bring the object to the target, together.\n");
    desk
}

/// Lateness is no matter here: a busy machine would repeat trials.
pub(super) const COMMAND: &str = "study.toml --out data --tolerance 10s";

/// The server at an address for a person: `http://HOST/join?token=TOKEN`.
pub(super) fn person_at(url: &str) -> Control {
    let (host, token) = url.strip_prefix("http://").and_then(|rest| rest.split_once("/join?token=")).unwrap_or_else(|| panic!("{url}"));
    Control { host: host.to_owned(), token: token.to_owned() }
}

/// Returns what a scripted person says on a page; `None` to wait.
fn answer_to(page: &Value) -> Option<Value> {
    let answer = |question: &Value| match question["scales"].as_array() {
        Some(scales) => json!({ "question": question["question"], "answer": vec![55; scales.len()] }),
        None => json!({ "question": question["question"], "answer": [question["steps"]] }),
    };
    Some(match page["page"].as_str()? {
        "code" => json!({ "do": "begin" }),
        "consent" => json!({ "do": "consent" }),
        "instructions" => json!({ "do": "go on" }),
        "ready" => json!({ "do": "ready" }),
        "break" if page["may_end"] == true => json!({ "do": "ready" }),
        "questions" => json!({ "do": "answer", "answers": page["questions"].as_array()?.iter().map(answer).collect::<Vec<_>>() }),
        _ => return None,
    })
}

/// Takes part until the page of thanks, also over a restart of the server. Returns the pages in their order. Before the first picture of the first trial, the
/// page is hidden `hides`, and shown again.
pub(super) fn take_part(control: Control, mut hides: bool) -> JoinHandle<Vec<Value>> {
    spawn(move || {
        let begin = Instant::now();
        let mut pages: Vec<Value> = Vec::new();
        while begin.elapsed() < 3 * PATIENCE {
            // The server may be gone, and the place is free only once the server knows that the last connection has ended.
            let Ok(mut page) = Page::try_open(&control, "", None) else {
                sleep(Duration::from_millis(50));
                continue;
            };
            let (mut in_trial, mut own) = (false, Value::Null);
            while let Some(said) = page.next() {
                if said["page"].is_string() {
                    in_trial = said["page"] == "trial";
                    own = said["facts"]["hand"].clone();
                    let last = said["page"] == "thanks";
                    if let Some(answer) = answer_to(&said) {
                        // A refusal, or a server that is gone: the page is told again.
                        let _answered = control.try_ask("POST", "/api/person", &answer.to_string());
                    }
                    pages.push(said);
                    if last {
                        return pages;
                    }
                } else if said["peers"].is_array() && in_trial {
                    assert_eq!(said["packets"], json!([]), "packets tell the delay");
                    let told: Vec<usize> = (0..2).filter(|peer| said["peers"][peer].is_object()).collect();
                    assert_eq!(json!(told), json!([own]), "a page is told of the own copy alone");
                    if hides {
                        page.say("hidden");
                        page.say("seen");
                        hides = false;
                    }
                    page.say("[0.03,0,0]");
                }
            }
        }
        panic!("no end: {pages:?}");
    })
}

/// Returns the records of all kept trials.
pub(super) fn records(desk: &Desk) -> Vec<Value> {
    let mut folders: Vec<_> = std::fs::read_dir(desk.path("data/trials")).unwrap().map(|entry| entry.unwrap().path()).collect();
    folders.sort();
    folders.iter().map(|folder| serde_json::from_str(&std::fs::read_to_string(folder.join("trial.json")).unwrap()).unwrap()).collect()
}

/// Returns the first record with a fault. A machine that gives a test no time for a second adds faults of its own.
pub(super) fn with_fault(desk: &Desk, fault: &str) -> Value {
    let found = records(desk).into_iter().find(|record| record["faults"].as_array().unwrap().contains(&json!(fault)));
    found.unwrap_or_else(|| panic!("no {fault}: {:?}", records(desk)))
}

fn names(pages: &[Value]) -> Vec<&str> {
    let mut names: Vec<&str> = pages.iter().map(|page| page["page"].as_str().unwrap()).collect();
    names.dedup();
    names
}

/// The first person in the second place refuses, and somebody else comes. The first trial is hidden for a moment, and is repeated at the end of its block. The
/// process is killed after that trial, and goes on with the same addresses.
#[test]
fn a_group_goes_through_a_study_with_a_refusal_a_hidden_page_and_a_crash() {
    let desk = desk();
    let mut session = Session::study(&desk, COMMAND);
    let host = Control::at(&session.told("experimenter: "));
    let [first, refuses] = ["P01: ", "P02: "].map(|code| person_at(&session.told(code)));
    // A refusal keeps nothing, and its address is worth nothing afterwards.
    let mut page = Page::try_open(&refuses, "", None).unwrap();
    let shown = |page: &mut Page, name: &str| while page.next().unwrap()["page"] != name {};
    shown(&mut page, "code");
    assert_eq!(refuses.ask("POST", "/api/person", r#"{"do": "consent"}"#).0, 422, "the code comes first");
    assert_eq!(refuses.ask("POST", "/api/person", r#"{"do": "begin"}"#).0, 200);
    shown(&mut page, "consent");
    assert_eq!(refuses.ask("POST", "/api/person", r#"{"do": "refuse"}"#).0, 200);
    shown(&mut page, "refused");
    drop(page);
    let second = wait_for("another address", || {
        let second = person_at(host.get("/api/study")["people"][1]["address"].as_str().unwrap());
        (second.token != refuses.token).then_some(second)
    });
    assert_eq!(refuses.ask("GET", "/join", "").0, 401);
    assert!(!desk.path("data/trials").exists() || std::fs::read_dir(desk.path("data/trials")).unwrap().next().is_none(), "nothing is kept");
    // A person sees nothing of the condition.
    assert_eq!((first.ask("GET", "/api/links", "").0, first.ask("GET", "/api/study", "").0), (403, 403));
    assert_eq!(host.ask("POST", "/api/study", r#"{"do": "next"}"#).0, 422, "nobody has agreed");
    let people = [take_part(first.clone(), true), take_part(second.clone(), false)];
    wait_for("the first trial", || desk.path("data/trials/G01-001/trial.json").exists().then_some(()));
    session.kill();
    let mut session = Session::study(&desk, COMMAND);
    assert_eq!(Control::at(&session.told("experimenter: ")).token, host.token);
    assert_eq!([session.told("P01: "), session.told("P02: ")].map(|url| person_at(&url).token), [first.token, second.token]);
    let pages = people.map(|person| person.join().unwrap());
    assert_eq!(names(&pages[0])[..3], ["code", "consent", "instructions"]);
    assert_eq!(pages[0][1]["text"][2], json!({ "kind": "list", "ordered": false, "items": ["Positions are kept.", "Names are not."] }));
    for asked in ["ready", "trial", "questions", "break", "thanks"] {
        assert!(pages.iter().all(|pages| names(pages).contains(&asked)), "{asked}: {pages:?}");
    }
    // The other copy and packets are not shown, and no page tells the condition.
    assert!(pages.iter().flatten().filter(|page| page["page"] == "trial").all(|page| page["facts"]["alone"] == true), "{pages:?}");
    assert!(pages.iter().flatten().all(|page| !page.to_string().contains("20ms")));
    let study = wait_for("the end of the group", || Some(host.get("/api/study")).filter(|study| study["next"] == "End the study"));
    assert_eq!(study["may"], json!({ "next": true, "repeat": false, "abandon": false }), "{study}");
    assert_eq!(host.ask("POST", "/api/study", r#"{"do": "next"}"#).0, 200);
    let outcome = session.outcome();
    assert_eq!(outcome.status, Some(0), "{outcome:#?}");
    assert!(!desk.path("data/access.json").exists(), "the addresses are worth nothing any more");
    let hidden = with_fault(&desk, "hidden-page");
    assert!(hidden["round_trips"].as_array().is_some_and(|trips| trips.len() == 2), "{hidden}");
    // The block of the first condition ends with the repetition.
    let csv = desk.read("data/trials.csv");
    assert!(csv.lines().count() >= 4, "a head, the hidden trial, the repetition, and the other condition: {csv}");
    desk.text("study verify data");
    // A process killed after the last answer leaves the addresses. The next one has nothing to serve, and removes them.
    desk.write("data/access.json", "{}");
    assert_eq!(desk.cohaptic(&format!("study {COMMAND}")).status, Some(0));
    assert!(!desk.path("data/access.json").exists());
}

/// No tick of a computer is on time to the nanosecond: each trial is repeated once, and not again.
#[test]
fn a_trial_with_late_ticks_is_not_valid_and_is_repeated_once() {
    let desk = desk();
    let mut session = Session::study(&desk, &COMMAND.replace("10s", "1ns"));
    let people = ["P01: ", "P02: "].map(|code| take_part(person_at(&session.told(code)), false));
    people.into_iter().for_each(|person| drop(person.join().unwrap()));
    let kept = records(&desk);
    assert_eq!(kept.len(), 4, "{kept:?}");
    assert!(kept.iter().all(|record| record["faults"].as_array().unwrap().contains(&json!("late-ticks"))), "{kept:?}");
    session.interrupt();
    assert_eq!(session.outcome().status, Some(130));
}

/// The experimenter repeats a running trial, and abandons the group. The same row is given again, to people with new addresses.
#[test]
fn the_experimenter_repeats_abandons_and_begins_the_next_group() {
    let desk = desk();
    let mut session = Session::study(&desk, COMMAND);
    let host = Control::at(&session.told("experimenter: "));
    let controls = ["P01: ", "P02: "].map(|code| person_at(&session.told(code)));
    let pages = controls.clone().map(|control| {
        let mut page = Page::try_open(&control, "", None).unwrap();
        // A page that reads answers pings, and a page that says that it is there keeps a trial going.
        spawn(move || while page.next().is_some() && page.say("here") {})
    });
    let say = |words: &str| controls.each_ref().map(|control| control.ask("POST", "/api/person", &json!({ "do": words }).to_string()).0);
    for words in ["begin", "consent", "go on", "ready"] {
        assert_eq!(say(words), [200, 200], "{words}");
    }
    // A second window of the same person is refused, and the first goes on.
    let refused = Page::try_open(&controls[0], "", None).unwrap().next().unwrap();
    assert!(refused["hand"].is_null() && refused["refused"].as_str().unwrap().contains("another window"), "{refused}");
    let place = |words: &str| wait_for(words, || Some(host.get("/api/study")).filter(|study| study["where"].as_str().unwrap().contains(words)));
    // The trial is running, or a machine without a second for the test has ended the trial.
    let is_repeated = wait_for("the trial", || match host.ask("POST", "/api/study", r#"{"do": "repeat"}"#).0 {
        200 => Some(true),
        _ => (host.get("/api/study")["last_valid"] == false).then_some(false),
    });
    let study = place("Trial 2 of 3, a repetition: waits for P01 and P02");
    assert_eq!(study["last_valid"], false, "{study}");
    // A second press of the button that ended a break must not begin a trial.
    let (status, said) = host.ask("POST", "/api/study", r#"{"do": "next", "expects": "End the break"}"#);
    assert!(status == 422 && said.contains("gone on meanwhile"), "{status} {said}");
    if is_repeated {
        with_fault(&desk, "repeated");
        assert!(study["last"].as_str().unwrap().contains("it is repeated"), "{study}");
    }
    assert_eq!(host.ask("POST", "/api/study", r#"{"do": "abandon"}"#).0, 200);
    let study = place("abandoned");
    assert_eq!(study["people"][0]["page"], "abandoned");
    wait_for("the next group", || (host.ask("POST", "/api/study", r#"{"do": "next"}"#).0 == 200).then_some(()));
    let study = host.get("/api/study");
    assert_eq!((&study["group"], &study["people"][0]["code"]), (&json!("G02"), &json!("P03")));
    assert_eq!(controls[0].ask("GET", "/join", "").0, 401, "the addresses are those of another group");
    // P03 has printed address, too.
    assert_eq!(person_at(&session.told("P03: ")).token, person_at(study["people"][0]["address"].as_str().unwrap()).token);
    session.interrupt();
    assert_eq!(session.outcome().status, Some(130));
    pages.into_iter().for_each(|page| page.join().unwrap());
}
