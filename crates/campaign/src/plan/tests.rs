use std::collections::{BTreeMap, BTreeSet};

use super::CHUNK;
use super::check::Checked;
use super::*;
use crate::table::Roster;

fn plan(vary: &[&str], runs: u64, part: Option<u64>) -> CampaignPlan {
    let variations = vary.iter().map(|text| Variation::parse(text).unwrap()).collect();
    CampaignPlan::new(PlanSpec { text: "", file: Path::new(""), set: &[], variations, runs, format: Format::Csv, part, program: "" }).unwrap()
}

#[test]
fn the_last_key_varies_fastest() {
    let plan = plan(&["a=1,2", "b=x,y,z"], 4, None);
    assert_eq!((plan.combinations(), plan.runs()), (6, 24));
    let all: Vec<String> = (0..6).map(|combination| plan.varied(combination).join(" ")).collect();
    assert_eq!(all, ["a=1 b=x", "a=1 b=y", "a=1 b=z", "a=2 b=x", "a=2 b=y", "a=2 b=z"]);
    for combination in 0..6 {
        assert_eq!(plan.combination(&plan.places(combination)), combination);
    }
}

#[test]
fn nothing_varied_is_one_combination() {
    let plan = plan(&[], 3, None);
    assert_eq!((plan.combinations(), plan.runs(), plan.varied(0)), (1, 3, Vec::new()));
}

fn parts(runs: u64, events: u64, columns: usize, part: Option<u64>) -> Parts {
    let roster = Roster {
        peers: Vec::new(),
        always: 0,
        axes: 1,
        fewest_axes: 1,
        access_lines: false,
        cross_traffic: false,
        turns: false,
        tasks: false,
        measures: BTreeSet::new(),
    };
    Parts::of(&plan(&[], runs, part), &Checked { roster, events, numbers: BTreeMap::new(), refused: BTreeMap::new() }, columns).unwrap()
}

#[test]
fn a_part_takes_some_seconds_and_there_are_about_a_thousand_at_most() {
    // 2·10⁸ events, by 20,000 events per run.
    assert_eq!(parts(100_000, 20_000, 40, None).size, 10_000);
    // Short runs reach the bound of 16,384. Runs of a day get one chunk per part, until a thousand parts need more.
    assert_eq!(parts(1_000_000, 100, 40, None).size, 16_384);
    assert_eq!(parts(1000, u64::MAX, 40, None).size, CHUNK);
    assert_eq!(parts(1_000_000, u64::MAX, 40, None).size, 1000);
    // A table of 4000 columns has 25 parts rather than a thousand, but no part may fill the memory.
    assert_eq!(parts(10_000, u64::MAX, 4000, None).size, 400);
    assert_eq!(parts(1_000_000, u64::MAX, 4000, None).size, 2000);
    // A size chosen by the user is kept.
    assert_eq!(parts(100, 1, 40, Some(7)), Parts { runs: 100, size: 7 });
    for parts in [parts(100, 1, 40, Some(7)), parts(1000, 50_000_000, 40, None), parts(8, u64::MAX, 40, None), parts(1, 1, 1, None)] {
        let ranges: Vec<u64> = (0..parts.count()).flat_map(|part| parts.range(part)).collect();
        assert_eq!(ranges, (0..parts.runs).collect::<Vec<u64>>(), "every run is in one part");
        assert!((0..parts.count()).all(|part| parts.len(part) > 0));
    }
}

const SCENE: &str = r#"
    scene = { duration = "100ms", count = 2, seed = 3 }
    object = { mass = 0.45 }
    coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
    peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
    link = { delay = "24ms", jitter = "2ms", loss = "10%" }
"#;

/// The campaign sets the seed of a scene after reading. A seed in the text must have no further effect.
#[test]
fn a_seed_that_is_written_is_a_seed_that_is_read() {
    for links in [
        "link = { delay = \"24ms\", jitter = \"2ms\", loss = \"10%\" }",
        "link = { netem = \"delay 20ms 5ms 25% distribution normal loss gemodel 1% 10%\", netem-profile = \"kernel-6.6\" }",
    ] {
        let text = SCENE.lines().filter(|line| !line.contains("link =")).chain([links]).collect::<Vec<&str>>().join("\n");
        let read = |seed: u64| Scene::parse(&text, Path::new("a.toml"), &[format!("scene.seed={seed}")]).unwrap();
        let mut written = read(3);
        written.seed = 12_345;
        assert_eq!(written, read(12_345));
    }
}

#[test]
fn the_fingerprint_is_that_of_what_the_scenes_say_and_not_of_where_they_are() {
    let number = |text: &str, file: &str, vary: &str| {
        let variations = vec![Variation::parse(vary).unwrap()];
        let asked = PlanSpec { text, file: Path::new(file), set: &[], variations, runs: 2, format: Format::Csv, part: None, program: "" };
        CampaignPlan::new(asked).unwrap().fingerprint().unwrap()
    };
    let text = SCENE;
    let first = number(text, "a.toml", "object.mass=1,2");
    assert_eq!(first, number(text, "b.toml", "object.mass=1,2"));
    assert_eq!(first, number(&text.replace("24ms", "24000us"), "a.toml", "object.mass=1,2"));
    assert_ne!(first, number(&text.replace("24ms", "25ms"), "a.toml", "object.mass=1,2"));
    assert_ne!(first, number(text, "a.toml", "object.mass=1,3"));
}

/// A new campaign takes the fingerprint from the check; a continued campaign reads the scenes again.
#[test]
fn the_fingerprint_of_the_check_is_that_of_the_scenes() {
    for vary in [&[][..], &["object.mass=1..2/70"], &["object.mass=1,2,3", "link.delay=20ms,24ms", "coordination.stiffness=500..1000/13"]] {
        let variations = vary.iter().map(|text| Variation::parse(text).unwrap()).collect();
        let asked = PlanSpec { text: SCENE, file: Path::new("a.toml"), set: &[], variations, runs: 2, format: Format::Csv, part: None, program: "" };
        let plan = CampaignPlan::new(asked).unwrap();
        let checked = plan.check(&crate::NoWatch).unwrap();
        assert_eq!(checked.numbers.len(), 1 + plan.variations().iter().map(|vary| vary.count() - 1).sum::<usize>());
        assert_eq!(plan.fingerprint_of(&checked.numbers), plan.fingerprint().unwrap());
    }
}
