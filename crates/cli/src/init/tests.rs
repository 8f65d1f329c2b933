//! Tests of `cohaptic init`: a written scene is accepted, and equals the shipped scene from which the text was written.

use std::path::Path;

use cohaptic_scene::Scene;

use super::{commented, shipped};

fn scene(text: &str, said: &str) -> Scene {
    Scene::parse(text, Path::new("scene.toml"), &[]).unwrap_or_else(|error| panic!("{said}: {error}\n{text}"))
}

/// Without `--peers` the written text parses to the shipped scene: the added comments and the written defaults change no value.
#[test]
fn what_is_written_is_the_scene_it_was_made_from() {
    for name in shipped::names() {
        let (_, text) = shipped::find(name).unwrap();
        assert_eq!(scene(&commented(name, text, None).unwrap(), name), scene(text, name), "{name}");
    }
}

#[test]
fn every_scene_can_be_had_for_other_numbers_of_peers() {
    for name in shipped::names() {
        let (_, text) = shipped::find(name).unwrap();
        let own = scene(text, name);
        for peers in [2, 3, 4, 7] {
            let read = scene(&commented(name, text, Some(peers)).unwrap(), name);
            assert_eq!(read.peers.len(), peers as usize, "{name}");
            // Expectations were computed for one number of peers.
            assert_eq!(read.expect.is_some(), read.peers.len() == own.peers.len() && own.expect.is_some(), "{name}");
        }
    }
}

/// Each key that the text proposes after a `#` is accepted when the user removes the `#`.
#[test]
fn every_key_that_is_proposed_is_accepted() {
    let (name, text) = shipped::find("paper/5-1").unwrap();
    let written = commented(name, text, None).unwrap();
    let is_proposed = |line: &str| line.starts_with("# ") && line.split_whitespace().nth(2) == Some("=");
    let proposed: Vec<usize> = written.lines().enumerate().filter(|(_, line)| is_proposed(line)).map(|(at, _)| at).collect();
    assert!(proposed.len() > 30, "{proposed:?}");
    for at in proposed {
        let lines: Vec<&str> = written.lines().enumerate().map(|(number, line)| if number == at { &line[2..] } else { line }).collect();
        // A key that needs a rate is rightly refused, since this scene's links have no rate.
        if !lines[at].contains("Needs rate") {
            scene(&lines.join("\n"), lines[at]);
        }
    }
}

/// Keys that users often change have their meaning and their unit in a comment on the same line or above the line.
#[test]
fn keys_are_explained_with_their_units() {
    let (name, text) = shipped::find("paper/5-1").unwrap();
    let written = commented(name, text, None).unwrap();
    for (key, words) in [
        ("stiffness = 2100.0", "Gain on the difference of positions, K_T [N/m]"),
        ("mass = 0.45", "Mass of the whole object [kg]"),
        ("update = \"8ms\"", "Time between two samples of a peer"),
        ("# seed = 0", "Seed of all random numbers"),
        ("# loss = 0", "Probability that a packet is lost"),
    ] {
        let line = written.lines().find(|line| line.starts_with(key)).unwrap_or_else(|| panic!("no {key} in\n{written}"));
        assert!(line.contains(words), "{line}");
    }
    assert!(written.contains("#   coupling.stiffness: Stiffness between device and copy, K_C [N/m]\n"), "{written}");
    assert!(written.contains("#   hand.arm.mass: Mass that the arm adds to the device [kg]\n"), "{written}");
}
