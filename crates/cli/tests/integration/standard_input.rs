//! `-` reads a scene from standard input.

use crate::integration::desk::{Desk, parse, timeless};
use crate::integration::scenes::TWO;

#[test]
fn every_command_on_a_scene_takes_it_from_standard_input() {
    let desk = Desk::with("two.toml", TWO);
    for line in [
        "explain SCENE --json",
        "check SCENE",
        "stability point SCENE --json",
        "stability map SCENE --x coordination.stiffness=100..200 --y coordination.damping=0..1 --grid 2x2",
        "stability boundary SCENE --along coordination.stiffness=100..200 --samples 3 --json",
        "admittance SCENE --peer left --at 1,2 --json",
    ] {
        let from_file = desk.cohaptic(&line.replace("SCENE", "two.toml"));
        let from_pipe = desk.piped(&line.replace("SCENE", "-"), TWO);
        let same = |text: &str| {
            let kept = text.lines().filter(|line| !line.contains("per second") && !line.contains("wall_s"));
            kept.map(|line| line.replace("<standard input>", "two.toml")).collect::<Vec<_>>()
        };
        assert_eq!((from_pipe.status, from_pipe.stderr.as_str()), (Some(0), ""), "{line}");
        assert_eq!(same(&from_pipe.stdout), same(&from_file.stdout), "{line}");
    }
    let run = desk.piped("run - --json --set link.delay=8ms", TWO);
    assert_eq!(timeless(parse(&run.stdout)), timeless(desk.json("run two.toml --json --set link.delay=8ms")));
    let campaign = desk.piped("campaign - --vary link.delay=8ms,16ms --out out --format csv", TWO);
    assert_eq!(campaign.status, Some(0), "{}", campaign.stderr);
}

#[test]
fn a_fault_on_standard_input_is_shown_there() {
    let desk = Desk::new();
    let wrong = TWO.replace("\"24ms\"", "\"24 parsecs\"");
    for line in ["run -", "explain -", "stability point -", "admittance - --peer left"] {
        desk.piped(line, &wrong).assert_refused(2, &["error: <standard input>:27:9: link.delay: ", "27 | delay = \"24 parsecs\""]);
    }
    desk.piped("run -", "[scene]\ntitle = ").assert_refused(2, &["error: <standard input>:2:"]);
    desk.piped("run -", b"[scene]\ntitle = \"\xe4\"\n").assert_refused(2, &["<standard input>:2:10: not UTF-8"]);
}

/// Files that the scene names are looked for in the working directory.
#[test]
fn files_of_a_scene_on_standard_input_are_beside_the_user() {
    let desk = Desk::new();
    desk.write("hand.csv", "t,fx\n0,1.5\n1,1.5\n");
    let recorded = TWO.replace("{ force = 1.5 }", "{ file = \"hand.csv\" }");
    let from_pipe = desk.piped("run - --json", &recorded);
    desk.write("two.toml", TWO);
    assert_eq!(parse(&from_pipe.stdout)["peers"], desk.json("run two.toml --json")["peers"]);
}

#[cfg(target_os = "linux")]
#[test]
fn relay_and_router_files_come_from_standard_input_too() {
    let desk = Desk::new();
    desk.piped("relay - --for 10ms", "programs = 7\n").assert_refused(2, &["<standard input>:1:12: programs: "]);
    desk.piped("router - --for 10ms", "router = 7\n").assert_refused(2, &["<standard input>:1:"]);
}
