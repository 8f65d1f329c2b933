//! `cohaptic stability point`: the verdict on a scene as it stands. Radii are compared with numbers that were computed elsewhere, and with one another
//! where a law relates them.

use serde_json::Value;

use crate::integration::desk::Desk;
use crate::integration::scenes::{PAPER, PLANE, TWO};

fn number(document: &Value, key: &str) -> f64 {
    document[key].as_f64().unwrap_or_else(|| panic!("no {key} in {document:#}"))
}

/// The radius of the paper's three users, computed apart from this program from the full matrix: 0.8964881385693.
#[test]
fn the_radius_is_the_one_computed_elsewhere() {
    let desk = Desk::with("paper.toml", PAPER);
    for (option, method) in [("", "reduced"), ("--method reduced", "reduced"), ("--method full", "full")] {
        let document = desk.json(&format!("stability point paper.toml --json {option}"));
        let (radius, error) = (number(&document, "spectral_radius"), number(&document, "error_bound"));
        assert!((radius - 0.896_488_138_569_3).abs() < 2e-13 + error && error < 1e-6, "{document:#}");
        assert_eq!((&document["verdict"], &document["method"], &document["rigid_modes"]), (&"stable".into(), &method.into(), &1.into()));
    }
}

#[test]
fn speeds_follow_from_the_radius_and_the_frame() {
    let document = Desk::with("paper.toml", PAPER).json("stability point paper.toml --json");
    let (radius, frame) = (number(&document, "spectral_radius"), number(&document, "frame_s"));
    assert_eq!(frame, 0.008);
    // In a second are 125 frames; in a time constant a disturbance shrinks by e.
    assert!((number(&document, "per_second") / radius.powi(125) - 1.0).abs() < 1e-12);
    let shrinks = radius.powf(number(&document, "time_constant_s") / frame);
    assert!((shrinks * std::f64::consts::E - 1.0).abs() < 1e-12, "{shrinks}");
}

#[test]
fn parts_have_every_state_and_the_largest_radius() {
    let document = Desk::with("paper.toml", PAPER).json("stability point paper.toml --json --set peers.peer3.contact=none --set scene.count=4");
    let parts = document["parts"].as_array().unwrap();
    let kinds: Vec<&str> = parts.iter().map(|part| part["kind"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["together", "apart", "loose-device"]);
    assert_eq!((&parts[0].get("peer"), &parts[1]["peer"], &parts[2]["peer"]), (&None, &"peer1".into(), &"peer3".into()));
    // Three equal peers differ in two ways; of the device that touches nothing only the velocity counts.
    assert_eq!((&parts[1]["multiplicity"], &parts[2]["multiplicity"], &parts[2]["dimension"]), (&2.into(), &1.into(), &1.into()));
    let largest = parts.iter().map(|part| number(part, "spectral_radius")).fold(0.0, f64::max);
    assert!((largest - number(&document, "spectral_radius")).abs() <= number(&document, "error_bound"));
}

/// PD with gains K is AP with gains (N-1) K: a law of the two strategies, exact.
#[test]
fn one_strategy_is_the_other_with_other_gains() {
    let desk = Desk::with("paper.toml", PAPER);
    let radius = |set: &str| number(&desk.json(&format!("stability point paper.toml --json {set}")), "spectral_radius");
    let pd = radius("--set coordination.strategy=proportional-derivative");
    let ap = radius("--set coordination.stiffness=2000 --set coordination.damping=10");
    assert!((pd - ap).abs() < 1e-12, "{pd} {ap}");
}

/// Section 5.1 with a model of the arm, as control.md has it: PD at 2100 N/m is unstable, AP is stable.
#[test]
fn the_verdicts_of_the_paper_come_out() {
    let desk = Desk::new();
    for (name, verdict, word) in
        [("ap-2100", "stable", "STABLE"), ("pd-2100", "unstable", "UNSTABLE"), ("ap-1000", "stable", "STABLE"), ("pd-1000", "stable", "STABLE")]
    {
        let scene = crate::integration::desk::shipped(&format!("paper/5-1-{name}.toml"));
        let document = desk.json(&format!("stability point {} --json", scene.display()));
        assert_eq!(document["verdict"], verdict, "{name}");
        assert_eq!(number(&document, "spectral_radius") < 1.0, verdict == "stable");
        assert_eq!(number(&document, "time_constant_s") > 0.0, verdict == "stable");
        let text = desk.text(&format!("stability point {}", scene.display()));
        assert!(text.contains(&format!("\n{word}: ")), "{text}");
    }
}

#[test]
fn people_get_the_same_in_words() {
    let desk = Desk::with("two.toml", TWO);
    let (text, document) = (desk.text("stability point two.toml"), desk.json("stability point two.toml --json"));
    let radius = format!("spectral radius {:.12} +- ", number(&document, "spectral_radius"));
    let states = format!("{} states, 1 rigid-body mode removed; method: reduced", document["dimension"]);
    for part in [
        "Two users\n",
        "over a frame of 8ms",
        " per frame and ",
        " per second: ",
        "parts that do not mix",
        "all, equal peers as their average",
        &radius,
        &states,
    ] {
        assert!(text.contains(part), "no {part:?} in {text}");
    }
}

#[test]
fn every_combination_of_one_sided_contacts_is_a_mode() {
    let desk = Desk::with("two.toml", TWO);
    let set = "--set 'peers.left.contact={ push = \"+x\" }'";
    let document = desk.json(&format!("stability point two.toml --json {set}"));
    let modes = document["modes"].as_array().unwrap();
    let contacts: Vec<&str> = modes.iter().map(|mode| mode["contacts"].as_str().unwrap()).collect();
    assert_eq!(contacts, ["nobody pushes", "pushing: left"]);
    let largest = modes.iter().map(|mode| number(mode, "spectral_radius")).fold(0.0, f64::max);
    assert!((largest - number(&document, "spectral_radius")).abs() <= number(&document, "error_bound"));
    assert!(document["notes"][0].as_str().unwrap().contains("not linear"));
    let text = desk.text(&format!("stability point two.toml {set}"));
    for part in ["2 combinations of contacts", "nobody pushes", "pushing: left", "note: the scene is not linear"] {
        assert!(text.contains(part), "no {part:?} in {text}");
    }
}

#[test]
fn equal_axes_are_as_stable_as_one() {
    let radius = |set: &str| number(&Desk::with("plane.toml", PLANE).json(&format!("stability point plane.toml --json {set}")), "spectral_radius");
    let rigid = |set: &str| Desk::with("plane.toml", PLANE).json(&format!("stability point plane.toml --json {set}"))["rigid_modes"].clone();
    let line = "--set scene.axes=1 --set peers.left.hand.force=1.5";
    assert_eq!(radius(""), radius(line));
    assert_eq!((rigid(""), rigid(line)), (2.into(), 1.into()));
}

#[test]
fn what_makes_no_sense_is_refused() {
    let desk = Desk::with("two.toml", TWO);
    desk.cohaptic("stability point two.toml --set peers.nobody.contact=none").assert_refused(2, &["--set peers.nobody.contact=none", "nobody", "^"]);
    desk.cohaptic("stability point two.toml --set coordination.stifness=1").assert_refused(2, &["unknown key", "stiffness"]);
    desk.cohaptic("stability point two.toml --method guess").assert_refused(2, &["guess", "reduced", "full"]);
    desk.cohaptic("stability point gone.toml").assert_refused(3, &["gone.toml: cannot be read"]);
    desk.cohaptic("stability point two.toml --set peers.left.clock.drift=0.0123456789").assert_refused(2, &["two.toml: ", "expected", "clocks"]);
    desk.cohaptic("stability").assert_refused(2, &["point"]);
}

/// With certain links the mean square is the square of the radius; a loss that is nearly never is next to it, and the verdict is then that of the mean square.
#[test]
fn links_that_leave_something_to_chance_have_a_mean_square() {
    let desk = Desk::with("paper.toml", PAPER);
    let certain = desk.json("stability point paper.toml --json");
    assert!(certain.get("mean_square_radius").is_none(), "{certain:#}");
    let document = desk.json("stability point paper.toml --json --set link.loss=1e-9");
    let (mean_square, radius) = (number(&document, "mean_square_radius"), number(&certain, "spectral_radius"));
    assert!((mean_square - radius * radius).abs() < 1e-7 && number(&document, "mean_square_error_bound") < 1e-6, "{document:#}");
    let text = desk.text("stability point paper.toml --set link.loss=5%");
    assert!(text.contains("STABLE in the mean square") && text.contains("with delays at their mean and no losses: stable"), "{text}");
    // What cannot be followed is said, and the verdict is nominal.
    let refused = desk.json("stability point paper.toml --json --set scene.count=9 --set link.loss={gilbert-elliott={p=0.1,r=0.5}}");
    assert!(refused.get("mean_square_radius").is_none());
    let notes = refused["notes"].as_array().unwrap();
    assert!(notes.iter().any(|note| note.as_str().unwrap().starts_with("the verdict is nominal")), "{refused:#}");
    assert_eq!((&refused["judged"], &refused["left_out"]), (&"nominal".into(), &serde_json::json!(["random loss"])));
    assert_eq!((&document["judged"], &certain["judged"]), (&"mean-square".into(), &"spectral-radius".into()));
    // A nominal verdict is called so first.
    for (set, left_out) in [
        ("--set scene.count=9 --set link.loss={gilbert-elliott={p=0.1,r=0.5}}", "random loss"),
        ("--set scene.count=9 --set link.loss={gilbert-elliott={p=0.1,r=0.5}} --set link.jitter=2ms", "jitter and random loss"),
        ("--set link.outage={random={up=\"5s\",down=\"50ms\"}} --set link.loss=1%", "random outages and random loss"),
        ("--graph ring --set link.loss=1%", "random loss"),
    ] {
        let text = desk.text(&format!("stability point paper.toml {set}"));
        let verdict = text.lines().nth(2).unwrap();
        assert!(verdict.starts_with(&format!("Nominal ({left_out} left out): ")) && verdict.contains("STABLE: "), "{text}");
    }
}

#[test]
fn the_worst_case_is_bounded_from_both_sides() {
    let desk = Desk::with("paper.toml", PAPER);
    let nominal = number(&desk.json("stability point paper.toml --json"), "spectral_radius");
    let document = desk.json("stability point paper.toml --json --losses-in-a-row 1");
    let worst = &document["worst_case"];
    let (lower, upper) = (number(worst, "lower"), number(worst, "upper"));
    // Nothing lost is one of the patterns.
    assert!(nominal <= upper && lower <= upper && lower > nominal - 2e-3, "{worst:#}");
    assert!(worst["sequence"].as_str().is_some_and(|words| !words.is_empty()));
    let text = desk.text("stability point paper.toml --losses-in-a-row 1 --delay-within 8ms..10ms");
    assert!(text.contains("worst case: ") && text.contains("growth per sending period between"), "{text}");
    // Bounds that are more than 1 % apart are said to be so.
    for (effort, is_open) in [("", false), ("--accuracy 1 --products 1 --set coordination.stiffness=1500", true)] {
        let command = format!("stability point paper.toml --losses-in-a-row 2 {effort}");
        let worst = &desk.json(&format!("{command} --json"))["worst_case"];
        assert_eq!(number(worst, "upper") > 1.01 * number(worst, "lower"), is_open, "{worst:#}");
        assert_eq!((worst["open"].as_bool(), desk.text(&command).contains("open: the bounds are ")), (Some(is_open), is_open), "{command}");
    }
}

#[test]
fn peers_may_hear_only_their_neighbours() {
    let desk = Desk::with("paper.toml", PAPER);
    let radius = |options: &str| number(&desk.json(&format!("stability point paper.toml --json {options}")), "spectral_radius");
    // Among three a ring is everybody; among five it is not.
    assert!((radius("--graph ring") - radius("--graph complete")).abs() < 1e-12);
    assert_ne!(radius("--set scene.count=5 --graph ring"), radius("--set scene.count=5"));
    desk.write("ring.csv", "0,1,1\n1,0,1\n1,1,0\n");
    assert!((radius("--graph ring.csv") - radius("--graph ring")).abs() < 1e-12);
    desk.write("words.csv", "0,one\n1,0\n");
    for (options, status, word) in [
        ("--graph words.csv", 2, "words.csv:1: found \"one\""),
        ("--graph none.csv", 3, "cannot read none.csv"),
        ("--graph ring --set peers.peer2.device.mass=0.2", 2, "peer2"),
        ("--delay-within 9ms..8ms", 2, "expected the shorter delay first"),
        ("--losses-in-a-row 1 --accuracy 0", 2, "--accuracy 0"),
    ] {
        let outcome = desk.cohaptic(&format!("stability point paper.toml {options}"));
        assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(status), ""), "{options}");
        assert!(outcome.stderr.contains(word), "{options}: {}", outcome.stderr);
    }
}

#[test]
fn what_is_not_followed_in_the_mean_square_says_so() {
    let desk = Desk::with("paper.toml", PAPER);
    for command in ["stability point paper.toml --graph ring", "admittance paper.toml --peer peer1 --points 3"] {
        let notes = |options: &str| desk.json(&format!("{command} --json {options}"))["notes"].as_array().unwrap().len();
        assert_eq!((notes(""), notes("--set link.loss=5%") > 0), (0, true), "{command}");
        let text = desk.text(&format!("{command} --set link.loss=5%"));
        assert!(text.contains("with every delay at its mean and no losses"), "{text}");
    }
}

/// A spring of 10^12 N/m on copies of 0.15 kg and a tick of 1 ms: K·h²/m = 6.7·10^6 a tick, eight ticks a frame, so that the radius is some 10^52 and the
/// square of what a frame makes of rounding far more. The bound is what counts the ticks, and the verdict what it says.
#[test]
fn a_frame_of_large_numbers_is_unstable_and_not_marginal() {
    let desk = Desk::with("two.toml", TWO);
    for stiffness in ["1e8", "1e12"] {
        let document = desk.json(&format!("stability point two.toml --json --set coordination.stiffness={stiffness}"));
        assert_eq!(document["verdict"], "unstable", "{stiffness}: {document:#}");
        let text = desk.text(&format!("stability point two.toml --set coordination.stiffness={stiffness}"));
        assert!(text.contains("\nUNSTABLE: ") && text.contains("the fastest disturbance grows") && !text.contains("inf"), "{text}");
    }
}

/// 10^30 N/m make errors beyond all proportion, and 10^300 N/m numbers beyond the range: neither can be told from 1, and neither is near it.
#[test]
fn a_frame_that_overflows_has_a_verdict_of_its_own() {
    let desk = Desk::with("two.toml", TWO);
    for stiffness in ["1e30", "1e300"] {
        let set = format!("--set coordination.stiffness={stiffness}");
        let document = desk.json(&format!("stability point two.toml --json {set}"));
        assert_eq!((&document["verdict"], &document["time_constant_s"]), (&"overflow".into(), &Value::Null), "{document:#}");
        let text = desk.text(&format!("stability point two.toml {set}"));
        assert!(text.contains("\nOVERFLOW: nothing is known of the spectral radius") && !text.contains("time constant"), "{text}");
    }
}

/// The verdict is in the mean square: that loss is left out is about the other radius.
#[test]
fn a_note_says_which_radius_it_is_about() {
    let desk = Desk::with("two.toml", TWO);
    let document = desk.json("stability point two.toml --json --set link.loss=5%");
    assert!(document["mean_square_radius"].is_number(), "{document:#}");
    let notes: Vec<&str> = document["notes"].as_array().unwrap().iter().map(|note| note.as_str().unwrap()).collect();
    let named = |note: &&str| {
        ["the spectral radius, with delays at their mean and no losses: ", "the mean-square radius: ", "both radii: "]
            .iter()
            .any(|which| note.starts_with(which))
    };
    assert!(!notes.is_empty() && notes.iter().all(named), "{notes:?}");
    assert!(
        notes[0].starts_with("the spectral radius, with delays at their mean and no losses: ") && notes[0].contains("random loss is left out"),
        "{notes:?}"
    );
    assert!(desk.text("stability point two.toml --set link.loss=5%").contains(&format!("note: {}\n", notes[0])));
    // With one radius there is nothing to tell apart.
    let one = desk.json("stability point two.toml --json --set 'timeline=[{ at = \"100ms\", link = \"all\", set = { delay = \"8ms\" } }]'");
    assert!(one["notes"][0].as_str().unwrap().starts_with("the timeline is left out"), "{one:#}");
}

/// Starts a command whose standard error is a file, and waits until the file contains `said`. Returns the path of the file and the process.
#[cfg(unix)]
pub(crate) fn running(desk: &Desk, line: &str, said: &str) -> (std::path::PathBuf, std::process::Child) {
    use std::process::Stdio;
    let path = desk.path("standard-error");
    let mut child = desk.command(line).stdout(Stdio::piped()).stderr(std::fs::File::create(&path).unwrap()).spawn().unwrap();
    while !std::fs::read_to_string(&path).unwrap().contains(said) {
        assert_eq!(child.try_wait().unwrap(), None, "it ended by itself: {}", std::fs::read_to_string(&path).unwrap());
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    (path, child)
}

/// Ends a command by Ctrl-C.
#[cfg(unix)]
pub(crate) fn ended(child: std::process::Child) -> crate::integration::desk::Outcome {
    assert!(std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    crate::integration::desk::Outcome::of(child.wait_with_output().unwrap())
}

/// 125 thousand samples of each peer on the way: many seconds.
#[cfg(unix)]
#[test]
fn a_long_analysis_says_what_it_costs_and_ends_at_once() {
    let desk = Desk::with("two.toml", TWO);
    for line in ["stability point two.toml --set link.delay=1000s", "admittance two.toml --peer left --set link.delay=1000s"] {
        let (path, child) = running(&desk, line, "note: ");
        assert_eq!(ended(child).status, Some(130));
        let said = std::fs::read_to_string(path).unwrap();
        assert!(said.contains("note: ") && said.contains(" states: about "), "{said}");
    }
}

#[test]
fn what_takes_more_memory_than_it_may_is_refused() {
    let desk = Desk::with("two.toml", TWO);
    for (line, most) in [
        ("stability point two.toml --set link.delay=1000h --method full", "at most 8.0 GiB"),
        ("stability point two.toml --set link.delay=500ms --method full --memory 1MiB", "at most 1.0 MiB"),
        ("stability map two.toml --set link.delay=1000h --x coordination.stiffness=1..2 --y coordination.damping=1..2 --grid 2x2", "at most 8.0 GiB"),
        ("stability boundary two.toml --set link.delay=1000h --along coordination.stiffness=1..2", "at most 8.0 GiB"),
    ] {
        desk.cohaptic(line).assert_refused(2, &["two.toml: ", " states, most of them samples on the way", most, "a shorter delay", "--memory"]);
    }
    desk.cohaptic("stability point two.toml --memory 8").assert_refused(2, &["--memory", "512MiB or 16GiB"]);
}
