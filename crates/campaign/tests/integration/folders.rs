//! Refusals before anything is written.

use cohaptic_campaign::{CampaignError, Format, Outcome, Watch};

use crate::bench::{Bench, SCENE, StopAfter, VARY};

#[test]
fn what_makes_no_sense_is_refused_and_nothing_is_written() {
    for (vary, runs, parts) in [
        (&["coordination.stifness=0..1/3"][..], 1, &["--set coordination.stifness=0", "stiffness"][..]),
        (&["coordination.stiffness=0..1"], 1, &["the number of values is missing"]),
        (&["coordination.stiffness=1..1/3"], 1, &["is empty"]),
        (&["coordination.update=2ms..3ms/3"], 1, &["coordination.update=2.5ms", "^"]),
        (&["peers.nobody.contact=none,grasp"], 1, &["nobody", "left, right"]),
        (&["link.delay=8ms,8"], 1, &["--set link.delay=8: ", "^"]),
        (&["object.mass=1,0"], 1, &["object.mass=0", "above zero"]),
        (&["object.mass=1,2", "object.\"mass\"=3"], 1, &["varied twice"]),
        (&[], 0, &["0 runs"]),
        (&["scene.seed=1,2"], 2, &["scene.seed is varied, and the 2 runs"]),
        (&["scene.seed=9223372036854775807"], 1_000_000_001, &["scene.seed is varied"]),
        (&[], 1_000_000_001, &["at most 1000000000 runs"]),
        (&["object.mass=1..2/100000", "object.damping=1..2/1000"], 1, &["100000 × 1000 combinations", "at most 10000000"]),
        (&["scene.count=2,70000", "link.jitter=1us"], 1, &["70000 peers with 4899930000 links", "too many to be simulated with events"]),
    ] {
        let mut bench = Bench::new(vary, runs);
        if vary.iter().any(|vary| vary.starts_with("scene.count")) {
            bench.text = SCENE
                .replace("seed     = 7", "count = 2")
                .replace("[[peers]]\nname = \"left\"\nhand = { force = 1.5 }\n", "")
                .replace("[[peers]]\nname = \"right\"\n", "");
        }
        bench.assert_refused("out", parts);
        assert!(!bench.path("out").exists(), "{vary:?}");
    }
    let mut bench = Bench::new(&[], 3);
    bench.set = vec!["scene.seed=9223372036854775806".to_owned()];
    bench.assert_refused("out", &["scene.seed: the seeds of 3 runs from 9223372036854775806"]);
    bench.runs = 2;
    bench.finish("out", 1);
    let mut bench = Bench::new(&[], 1000);
    bench.part = Some(0);
    bench.assert_refused("out", &["parts of 0 runs"]);
    (bench.part, bench.runs) = (Some(1), 100_001);
    bench.assert_refused("out", &["100001 files", "at least 2 runs a part"]);
    assert!(!bench.path("out").exists());
}

/// The error names the first refused combination, however many threads check.
#[test]
fn the_first_fault_is_shown() {
    let mut bench = Bench::new(&["object.mass=1..2/40", "object.damping=0..7/8", "coordination.update=1500us..2500us/11"], 1);
    bench.set = vec!["peer.tick=100us".to_owned()];
    bench.open("fine").map(drop).unwrap();
    bench.set = vec!["peer.tick=300us".to_owned()];
    let pool = rayon::ThreadPoolBuilder::new().num_threads(4).build().unwrap();
    for _ in 0..5 {
        let Err(CampaignError::Scene { varied, .. }) = pool.install(|| bench.open("out")) else { panic!("1600 is no multiple of 300") };
        assert_eq!(varied, ["object.mass=1", "object.damping=0", "coordination.update=1600us"]);
    }
}

#[test]
fn a_folder_with_something_else_in_it_is_left_alone() {
    let bench = Bench::new(&VARY, 2);
    std::fs::write(bench.path("file"), "mine").unwrap();
    assert!(matches!(bench.assert_refused("file", &["is not a folder"]), CampaignError::NoFolder { .. }));
    assert!(matches!(bench.assert_refused("file/below", &["is not a folder"]), CampaignError::NoFolder { .. }));
    std::fs::create_dir(bench.path("thesis")).unwrap();
    std::fs::write(bench.path("thesis/chapter.tex"), "mine").unwrap();
    let error = bench.assert_refused("thesis", &["chapter.tex", "a folder of its own"]);
    assert!(!error.is_io());
    assert_eq!(bench.files("thesis"), ["chapter.tex"]);
    // An empty folder is accepted, and so is a folder left by a campaign killed at its begin.
    std::fs::create_dir_all(bench.path("a/b")).unwrap();
    std::fs::write(bench.path("a/b/campaign.json.partial"), "{").unwrap();
    std::fs::write(bench.path("a/b/cohaptic.lock"), "").unwrap();
    bench.finish("a/b", 1);
    assert_eq!(bench.files("a/b"), ["campaign.json", "runs.parquet"]);
}

#[test]
fn another_campaign_is_refused_and_it_is_said_what_differs() {
    let mut bench = Bench::new(&VARY, 4);
    bench.part = Some(8);
    bench.outcome("out", 1, &StopAfter::runs(1)).unwrap();
    let before = (bench.files("out"), std::fs::read(bench.path("out/campaign.json")).unwrap());
    let other = |change: &dyn Fn(&mut Bench), part: &str| {
        let mut bench = Bench::new(&VARY, 4);
        bench.part = Some(8);
        change(&mut bench);
        (bench, part.to_owned())
    };
    let changes = [
        other(&|bench| bench.runs = 5, "--runs is 4 there and 5 here"),
        other(&|bench| bench.vary[1] = "link.loss=0%,50%".to_owned(), "--vary is coordination.stiffness=500..1500/2 link.loss=0%,40% there and"),
        other(&|bench| bench.vary.truncate(0), "and not given here"),
        other(&|bench| bench.set = vec!["object.mass=1".to_owned()], "--set is not given there and object.mass=1 here"),
        other(&|bench| bench.format = Format::Csv, "--format is parquet there and csv here"),
        other(&|bench| bench.part = None, "--part is 8 there and not given here"),
        other(&|bench| bench.program = "a later test", "the program is a test there and a later test here"),
        other(&|bench| bench.text = SCENE.replace("mass = 0.3", "mass = 0.4"), "of the scene is `mass = 0.3` there and `mass = 0.4` here"),
    ];
    for (changed, part) in changes {
        let error = changed
            .plan()
            .and_then(|plan| cohaptic_campaign::Campaign::open(plan, &bench.path("out"), &cohaptic_campaign::NoWatch))
            .map(drop)
            .unwrap_err();
        assert!(matches!(error, CampaignError::Other { .. }) && !error.is_io(), "{error}");
        assert!(error.to_string().contains(&part) && error.to_string().contains("Repeat the command that began it"), "{error}");
        assert_eq!((bench.files("out"), std::fs::read(bench.path("out/campaign.json")).unwrap()), before);
    }
    bench.finish("out", 1);
}

/// The content of a file named by the scene belongs to the identity of the campaign.
#[test]
fn a_file_that_the_scene_names_may_not_change() {
    let mut bench = Bench::new(&["peers.left.hand.file=one.csv,two.csv"], 4);
    bench.text = bench.text.replace("hand = { force = 1.5 }\n", "");
    bench.part = Some(4);
    std::fs::write(bench.path("one.csv"), "t,fx\n0,1\n1,2\n").unwrap();
    std::fs::write(bench.path("two.csv"), "t,fx\n0,2\n1,2\n").unwrap();
    bench.outcome("out", 1, &StopAfter::runs(1)).unwrap();
    std::fs::write(bench.path("two.csv"), "t,fx\n0,2\n1,3\n").unwrap();
    bench.assert_refused("out", &["a file that the scene names"]);
    std::fs::write(bench.path("two.csv"), "t,fx\n0,2\n1,2\n").unwrap();
    bench.finish("out", 1);
}

#[test]
fn a_second_process_is_refused() {
    let bench = Bench::new(&VARY, 4);
    let first = bench.open("out").unwrap();
    assert_eq!(bench.files("out"), ["campaign.json", "cohaptic.lock"]);
    let error = bench.assert_refused("out", &["another process works on the campaign in"]);
    assert!(matches!(error, CampaignError::Busy { .. }) && error.is_io());
    drop(first);
    bench.finish("out", 1);
}

#[test]
fn a_manifest_that_is_none_is_refused() {
    let bench = Bench::new(&VARY, 4);
    bench.open("out").map(drop).unwrap();
    let text = std::fs::read_to_string(bench.path("out/campaign.json")).unwrap();
    for damaged in [
        "",
        "{}",
        "[1]",
        &text.replace("\"layout\": 1", "\"layout\": 2"),
        &text.replace("\"runs\": 4", "\"runs\": \"four\""),
        &text.replace("\"part_runs\": ", "\"part_runs\": 0, \"x\": "),
    ] {
        std::fs::write(bench.path("out/campaign.json"), damaged).unwrap();
        let error = bench.assert_refused("out", &["campaign.json is not as a campaign writes it", "choose another folder"]);
        assert!(matches!(error, CampaignError::Damaged { .. }));
    }
}

/// A watch which stops at once.
struct Never;

impl Watch for Never {
    fn keep_going(&self) -> bool {
        false
    }
}

#[test]
fn ended_before_it_began_nothing_is_written() {
    let bench = Bench::new(&VARY, 4);
    assert!(matches!(bench.outcome("out", 2, &Never), Err(CampaignError::Stopped)));
    assert!(!bench.path("out").exists());
    bench.open("out").map(drop).unwrap();
    assert!(matches!(bench.outcome("out", 2, &Never), Ok(Outcome::Interrupted { kept: 0 })));
}

/// A folder that cannot be created gives the same error as a full disk before the first byte.
#[test]
fn a_folder_that_cannot_be_made_is_said() {
    let bench = Bench::new(&VARY, 4);
    let name = "x".repeat(300);
    let error = bench.open(&name).map(drop).unwrap_err();
    assert!(error.is_io() && error.to_string().contains(&name[..100]), "{error}");
}
