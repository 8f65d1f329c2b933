//! Whatever number is put into a shipped scene, what is read as a scene also runs: nothing panics, and every link conserves its packets.

use std::convert::Infallible;

use cohaptic_harness::{Model, Observer, Simulation};
use cohaptic_scene::Scene;
use cohaptic_tests::shipped_scenes;
use cohaptic_tests_common::{cases, properties};
use cohaptic_units::Instant;
use proptest::prelude::*;

/// Numbers at the edges of what a key may hold.
const NUMBERS: [&str; 12] =
    ["0", "1e-320", "1e-9", "0.5", "1", "3", "255", "1e9", "1e300", "9007199254740992", "18446744073709551615", "1.7976931348623157e308"];

/// Ends a run after its first thousand instants: a scene may have come to last for centuries.
struct Brief;

impl Observer for Brief {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn wants_packets(&self) -> bool {
        true
    }

    fn keep_going(&mut self, _now: Instant) -> bool {
        false
    }
}

/// Puts `number` in place of the text's number of that index; a unit behind it stays.
fn with_number(text: &str, index: prop::sample::Index, number: &str) -> String {
    let is_part = |c: char| c.is_ascii_digit() || c == '.';
    let starts: Vec<usize> = text
        .char_indices()
        .filter(|(at, c)| c.is_ascii_digit() && !text[..*at].ends_with(|c: char| is_part(c) || c.is_alphabetic() || c == '-' || c == '_'))
        .map(|(at, _)| at)
        .collect();
    let start = starts[index.index(starts.len())];
    let end = text[start..].find(|c| !is_part(c)).map_or(text.len(), |length| start + length);
    format!("{}{number}{}", &text[..start], &text[end..])
}

properties! {
    #![proptest_config(cases(2000))]

    #[test]
    fn an_edited_scene_runs_or_is_refused(
        scene in any::<prop::sample::Index>(),
        edits in prop::collection::vec((any::<prop::sample::Index>(), prop::sample::select(&NUMBERS[..])), 1..4),
        general in any::<bool>(),
    ) {
        let scenes = shipped_scenes();
        let original = std::fs::read_to_string(&scenes[scene.index(scenes.len())]).unwrap();
        let text = edits.iter().fold(original, |text, (index, number)| with_number(&text, *index, number));
        let Ok(scene) = Scene::parse(&text, "edited.toml".as_ref(), &[]) else { return Ok(()) };
        // More peers than this only take longer.
        prop_assume!(scene.peers.len() <= 60);
        let model = if general { Model::General } else { Model::Least };
        let Ok(summary) = Simulation::new(&scene, model).run(&mut Brief);
        for link in &summary.links {
            let stats = link.stats;
            prop_assert_eq!(stats.offered() + stats.duplicated(), stats.delivered() + stats.dropped_in_all() + stats.in_flight());
        }
    }
}
