//! Whom nobody watches is run in arrays, alone or beside others of the same shape: the same as every event of it one after the other, to the bit.

use std::time::Duration;

use cohaptic_harness::{Ending, Model, NoObserver, Observer, Simulation, Summary, run_side_by_side, same_shape};
use cohaptic_scene::Scene;
use cohaptic_tests::{Draft, drafts, shipped_scenes};
use cohaptic_tests_common::{are_all, cases, properties};
use cohaptic_units::Instant;
use proptest::prelude::*;

pub(super) fn run(scene: &Scene, model: Model) -> Summary {
    let Ok(summary) = Simulation::new(scene, model).run(&mut NoObserver);
    summary
}

/// What two runs differ in, first of all; `PartialEq` would let a zero pass for another one.
pub(super) fn difference(one: &Summary, other: &Summary) -> Option<String> {
    // The form on one line has the same values, and is written in a tenth of the time: summaries of many peers have a hundred thousand counters.
    if format!("{one:?}") == format!("{other:?}") {
        return None;
    }
    let (one, other) = (format!("{one:#?}"), format!("{other:#?}"));
    let (line, (found, expected)) = one.lines().zip(other.lines()).enumerate().find(|(_, (a, b))| a != b)?;
    Some(format!("line {line}: {found} is not {expected}"))
}

/// Three peers for three seconds, over links with these keys.
fn three(link: &str) -> Scene {
    mesh(3, link)
}

/// That number of peers.
pub(super) fn mesh(peers: usize, link: &str) -> Scene {
    Scene::parse(&mesh_text(peers, link), "mesh.toml".as_ref(), &[]).unwrap()
}

fn mesh_text(peers: usize, link: &str) -> String {
    format!(
        r#"
        scene = {{ duration = "3s", count = {peers} }}
        object = {{ mass = 0.45 }}
        coordination = {{ strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }}
        peer = {{ device = {{ mass = 0.1, damping = 5.0 }}, coupling = {{ stiffness = 3500.0, damping = 5.0 }} }}
        peers = [{{ name = "peer1", hand = {{ force = 1.5 }} }}]
        link = {{ {link} }}
        "#
    )
}

/// Eight of them with different seeds, the fourth of which diverges.
fn eight_of(scene: &Scene) -> Vec<Scene> {
    let mut scenes = vec![scene.clone(); 8];
    for (seed, scene) in (0..).zip(&mut scenes) {
        scene.seed = seed;
    }
    scenes[3].coordination.gains.stiffness = 3e7;
    scenes
}

/// Each alone, and all side by side, against what their events come to.
fn compare(scenes: &[Scene]) {
    for (scene, together) in scenes.iter().zip(run_side_by_side(scenes)) {
        assert!(same_shape(scene, scene), "it is run in arrays");
        let expected = run(scene, Model::General);
        assert_eq!(difference(&run(scene, Model::Least), &expected), None, "alone, {:?}", scene.duration);
        assert_eq!(difference(&together, &expected), None, "side by side, {:?}", scene.duration);
    }
}

/// Ends a run at the last of a number of instants at which it is asked, which is once at each.
struct Impatient {
    breaths: usize,
    latest: Option<Instant>,
}

impl Impatient {
    fn new(breaths: usize) -> Self {
        Self { breaths, latest: None }
    }
}

impl Observer for Impatient {
    type Error = std::convert::Infallible;

    fn keep_going(&mut self, now: Instant) -> bool {
        assert!(self.latest.is_none_or(|latest| latest < now), "asked at {now:?} after {:?}", self.latest);
        self.latest = Some(now);
        self.breaths = self.breaths.saturating_sub(1);
        self.breaths > 0
    }
}

pub(super) fn run_interrupted(scene: &Scene, model: Model, breaths: usize) -> Summary {
    let Ok(summary) = Simulation::new(scene, model).run(&mut Impatient::new(breaths));
    summary
}

properties! {
    #![proptest_config(cases(1500))]

    #[test]
    fn one_scene_in_arrays_comes_to_what_its_events_come_to(drafts in drafts::alike(Just(1)), relay: bool) {
        let scene = Scene { relay, ..drafts[0].scene() };
        prop_assert!(same_shape(&scene, &scene), "it is run in arrays");
        let difference = difference(&run(&scene, Model::Least), &run(&scene, Model::General));
        prop_assert!(difference.is_none(), "{}", difference.unwrap());
    }
}

properties! {
    #![proptest_config(cases(150))]

    /// Samples that overtake each other in a tick, over ticks, and beyond those that are looked ahead, sent as often as peers tick.
    #[test]
    fn samples_that_overtake_come_to_the_same(mut drafts in drafts::alike(Just(1)), delay in prop_oneof![3 => 1..400_u32, 1 => 800..1300_u32], part in 1..57_u32, more in 0..600_u64) {
        let draft = &mut drafts[0];
        let jitter = format!("jitter = {{ sd = \"{}us\", distribution = \"uniform\" }}", 10 * delay * part);
        draft.link = format!("delay = \"{delay}ms\", {jitter}, order = \"allow-reordering\", loss = 0.1");
        (draft.update, draft.gains) = (draft.peers[0].tick, draft.gains.scaled(0.05));
        draft.duration = u64::from(delay) + more;
        draft.peers.iter_mut().for_each(|peer| peer.phase = 0);
        let scene = draft.scene();
        let expected = run(&scene, Model::General);
        let difference = difference(&run(&scene, Model::Least), &expected);
        prop_assert!(difference.is_none(), "{}", difference.unwrap());
    }
}

properties! {
    #![proptest_config(cases(300))]

    #[test]
    fn scenes_side_by_side_come_to_what_each_comes_to_alone(drafts in drafts::alike(prop_oneof![1 => 1..=7_usize, 3 => 7..=11_usize])) {
        let scenes: Vec<Scene> = drafts.iter().map(Draft::scene).collect();
        let together = run_side_by_side(&scenes);
        prop_assert_eq!(together.len(), scenes.len());
        for (scene, together) in scenes.iter().zip(&together) {
            let difference = difference(together, &run(scene, Model::General));
            prop_assert!(difference.is_none(), "{}", difference.unwrap());
        }
    }

    /// A run that is ended on the way has done what one with events has.
    #[test]
    fn a_run_that_is_interrupted_comes_to_the_same(mut drafts in drafts::alike(Just(1)), breaths in 1..3_usize) {
        let draft = &mut drafts[0];
        draft.duration = 2500;
        let interrupted = |model| run_interrupted(&draft.scene(), model, breaths);
        let difference = difference(&interrupted(Model::Least), &interrupted(Model::General));
        prop_assert!(difference.is_none(), "{}", difference.unwrap());
    }
}

/// Of the scenes of other shapes none is lost or mixed up.
#[test]
fn shipped_scenes_side_by_side_come_to_what_each_comes_to_alone() {
    let mut scenes: Vec<Scene> =
        shipped_scenes().iter().map(|path| Scene::read(path, &[]).unwrap()).filter(|scene| scene.peers.len() <= 10).collect();
    for scene in &mut scenes {
        scene.duration = scene.duration.min(Duration::from_millis(500));
        scene.expect = None;
        scene.timeline.retain(|change| change.at - Instant::ZERO <= Duration::from_millis(500));
    }
    let together = run_side_by_side(&scenes);
    assert_eq!(together.len(), scenes.len());
    for (scene, together) in scenes.iter().zip(&together) {
        assert_eq!(difference(together, &run(scene, Model::Least)), None, "{}", scene.title);
    }
}

/// One run on several threads: links of all kinds, phases of all peers, laws that look back, extrapolate or remember, runs that diverge and that are
/// interrupted.
#[test]
fn threads_come_to_what_one_comes_to() {
    let links = [
        "delay = \"24ms\", jitter = \"3ms\", loss = \"5%\"",
        "delay = \"0s\", loss = \"5%\"",
        "delay = \"9ms\", jitter = \"2ms\", rate = \"100kbit\", queue = { limit = \"3 packets\", discipline = \"codel\" }",
        "delay = \"9ms\", jitter = { sd = \"2ms\", correlation = 0.5 }, loss = { gilbert-elliott = { p = 0.05, r = 0.3 } }, rate = \"200kbit\"",
    ];
    let laws: [&[&str]; 4] = [
        &["coordination.strategy=average-position"],
        &["coordination.strategy=proportional-derivative"],
        &["coordination.strategy=extrapolated", "coordination.extrapolated.horizon=30ms"],
        &["coordination.strategy=smoothed-average-position", "coordination.smoothed-average-position.lag=5ms"],
    ];
    for (place, (link, law)) in links.iter().zip(laws).enumerate() {
        let law: Vec<String> = law.iter().map(|setting| (*setting).to_owned()).collect();
        let mut scene = Scene::parse(&mesh_text(26, link), "mesh.toml".as_ref(), &law).unwrap();
        scene.duration = Duration::from_millis(1100);
        if place % 2 == 1 {
            scene.peers.iter_mut().zip(0..).for_each(|(peer, place)| (peer.phase, peer.compute_delay) = (place % 8, place % 3 == 0));
        }
        let mut diverges = scene.clone();
        diverges.coordination.gains = diverges.coordination.gains.scaled(3e4);
        scene.coordination.gains = scene.coordination.gains.scaled(0.05);
        // Threads meet every 8 ms, and laws look back by 30 ms at most, so that a part of a calm run finds what the whole run finds.
        let mut calm = scene.clone();
        calm.duration = Duration::from_millis(if are_all() { 1100 } else { 300 });
        for scene in [&calm, &diverges] {
            let general = run(scene, Model::General);
            for threads in [2, 3, 64] {
                let Ok(summary) = Simulation::new(scene, Model::Least).on_threads(threads).run(&mut NoObserver);
                assert_eq!(difference(&summary, &general), None, "{link}, {threads} threads");
            }
        }
        let Ok(interrupted) = Simulation::new(&scene, Model::Least).on_threads(2).run(&mut Impatient::new(1));
        assert!(matches!(interrupted.ending, Ending::Interrupted(_)));
        assert_eq!(difference(&interrupted, &run_interrupted(&scene, Model::General, 1)), None, "{link}");
    }
}

/// Of 257 peers on the means are exact, whether samples travel together or each by itself. Samples that overtake others are among all cases.
#[test]
fn many_peers_come_to_the_same() {
    let overtaking = "delay = \"6ms\", jitter = { sd = \"3ms\", distribution = \"uniform\" }, order = \"allow-reordering\"";
    let links = [("delay = \"3ms\"", 8), ("delay = \"3ms\", jitter = \"400us\", loss = \"5%\"", 8), (overtaking, 2)];
    for (link, update) in links.into_iter().take(if are_all() { 3 } else { 2 }) {
        let mut scene = mesh(260, link);
        scene.coordination.update = Duration::from_millis(update);
        scene.peers.iter_mut().zip(0..).for_each(|(peer, place)| peer.phase = place % update);
        scene.duration = Duration::from_millis(24);
        let [least, general] = [Model::Least, Model::General].map(|model| run(&scene, model));
        assert_eq!(difference(&least, &general), None, "{link}");
    }
}

/// Eight runs of one scene of which some diverge: each ends when it would alone.
#[test]
fn each_run_ends_when_it_would_alone() {
    let stiffness = |gain: f64| {
        let mut scene = three("delay = \"24ms\", jitter = \"3ms\", loss = \"5%\"");
        scene.coordination.gains.stiffness = gain;
        scene
    };
    let scenes: Vec<Scene> = [500.0, 3e7, 1000.0, 3e8, 500.0, 3e9, 3e10, 700.0].map(stiffness).into();
    let together = run_side_by_side(&scenes);
    let endings: Vec<bool> = together.iter().map(|summary| summary.ending == Ending::Complete).collect();
    assert_eq!(endings, [true, false, true, false, true, false, false, true]);
    for (scene, together) in scenes.iter().zip(&together) {
        assert_eq!(difference(together, &run(scene, Model::General)), None);
    }
}

/// What is 256 ticks or more on the way waits elsewhere than the rest, and the ticks of more than 2^31 ns are counted in another way: delays at these edges
/// and on both sides of them, with packets that overtake others across them, in runs that are whole, that diverge and that are interrupted.
#[test]
fn what_is_long_on_the_way_comes_to_the_same() {
    let spread =
        |mean: &str, sd: &str| format!("delay = \"{mean}\", jitter = {{ sd = \"{sd}\", distribution = \"uniform\" }}, order = \"allow-reordering\"");
    for (link, duration) in [
        ("delay = \"255000001ns\", loss = \"5%\"".to_owned(), 600),
        ("delay = \"256ms\", loss = \"5%\"".to_owned(), 600),
        ("delay = \"257ms\", loss = \"5%\"".to_owned(), 1100),
        (spread("256ms", "20ms"), 1500),
        (spread("300ms", "150ms"), 1500),
        (spread("2200ms", "100ms"), 3000),
        ("delay = \"2147483647ns\", loss = \"5%\"".to_owned(), 2300),
        ("delay = \"2147000001ns\", loss = \"5%\"".to_owned(), 2300),
        ("delay = \"2148000001ns\", loss = \"5%\"".to_owned(), 2300),
    ] {
        let mut scene = three(&link);
        scene.duration = Duration::from_millis(duration);
        compare(&eight_of(&scene));
        if duration > 1024 {
            let [least, general] = [Model::Least, Model::General].map(|model| run_interrupted(&scene, model, 1));
            assert!(matches!(general.ending, Ending::Interrupted(_)), "{link}");
            assert_eq!(difference(&least, &general), None, "{link}");
        }
    }
}

/// A run that diverges at the end of its scene, or a part of a tick before it: packets that arrive until then are delivered, unlike those of the latest tick
/// of one that diverges earlier. Here some arrive at every tick.
#[test]
fn a_run_that_diverges_at_the_very_end_comes_to_the_same() {
    for link in ["delay = \"2ms\"", "delay = \"2ms\", jitter = \"200us\""] {
        let mut scene = three(link);
        scene.coordination.update = Duration::from_millis(1);
        scene.coordination.gains.stiffness = 3e7;
        let Ending::Diverged(at) = run(&scene, Model::General).ending else { panic!("{link}: it diverges") };
        let at = at - Instant::ZERO;
        for early in [0, 1, 300_000, 999_999, 1_000_000, 1_000_001].map(Duration::from_nanos) {
            scene.duration = at - early;
            let ending = run(&scene, Model::General).ending;
            assert_eq!(ending == Ending::Complete, early >= Duration::from_millis(1), "{early:?} before: {ending:?}");
            compare(&eight_of(&scene));
        }
    }
}

/// A device that is torn away by its hand leaves the numbers a tick before its copy of the object does: that is when the run has diverged.
#[test]
fn a_device_that_diverges_alone_ends_the_run() {
    let mut scenes = eight_of(&three("delay = \"24ms\", jitter = \"3ms\""));
    for (scene, force) in scenes.iter_mut().zip(["1e308", "1.5", "1e307", "-1e308", "1.5", "1.5", "1e308", "1.5"]) {
        let hand = Scene::parse(
            &format!(
                r#"
                scene = {{ duration = "3s", count = 3 }}
                object = {{ mass = 1e9 }}
                coordination = {{ strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }}
                peer = {{ device = {{ mass = 1e-4 }}, coupling = {{ stiffness = 1e-3, damping = 0.0 }} }}
                peers = [{{ name = "peer1", hand = {{ force = {force} }} }}]
                link = {{ delay = "24ms", jitter = "3ms" }}
                "#
            ),
            "torn.toml".as_ref(),
            &[],
        );
        *scene = hand.unwrap();
    }
    let endings: Vec<bool> = scenes.iter().map(|scene| run(scene, Model::General).ending == Ending::Complete).collect();
    assert_eq!(endings, [false, true, false, false, true, true, false, true]);
    compare(&scenes);
}

/// A sample that comes too late arrives at the very end of the scene, a nanosecond before, and a nanosecond behind it.
#[test]
fn a_stale_sample_at_the_very_end_counts() {
    let mut scene = three("delay = \"24ms\", jitter = { sd = \"8ms\", distribution = \"uniform\" }, order = \"allow-reordering\"");
    let stale = |summary: &Summary| summary.peers.iter().map(|peer| peer.stale_samples).sum::<u64>();
    // The number grows with the duration, so the instant at which it first does is found by halving.
    let (mut before, mut at) = (0, 3_000_000_000);
    while at - before > 1 {
        let middle = before + (at - before) / 2;
        scene.duration = Duration::from_nanos(middle);
        if stale(&run(&scene, Model::General)) == 0 { before = middle } else { at = middle }
    }
    for (duration, expected) in [(at - 1, 0), (at, 1), (at + 1, 1)] {
        scene.duration = Duration::from_nanos(duration);
        assert_eq!(stale(&run(&scene, Model::Least)), expected, "a scene of {duration} ns");
        let mut scenes = eight_of(&scene);
        scenes.iter_mut().for_each(|like| like.seed = scene.seed);
        compare(&scenes);
    }
}

/// What two scenes must have in common, each thing by itself.
#[test]
fn scenes_of_other_shapes_are_not_run_side_by_side() {
    let scene = three("delay = \"24ms\"");
    let differs = |change: &dyn Fn(&mut Scene)| {
        let mut other = scene.clone();
        change(&mut other);
        assert!(same_shape(&other, &other), "it is run in arrays");
        let [there, back] = [(&scene, &other), (&other, &scene)].map(|(one, other)| same_shape(one, other));
        assert_eq!(there, back);
        compare(&[scene.clone(), other.clone(), scene.clone(), other.clone(), other, scene.clone()]);
        !there
    };
    assert!(differs(&|other| other.peers[1].phase = 3));
    assert!(differs(&|other| other.duration -= Duration::from_nanos(1)));
    assert!(differs(&|other| other.coordination.update = Duration::from_millis(4)));
    assert!(differs(&|other| other.peers.iter_mut().for_each(|peer| peer.clock.tick = Duration::from_millis(2))));
    assert!(differs(&|other| other.links = three("delay = \"25ms\"").links));
    assert!(differs(&|other| other.links = three("delay = \"24ms\", loss = \"1%\"").links));
    assert!(!differs(&|other| other.seed = 9));
    assert!(!differs(&|other| other.object.mass = 0.5));
    assert!(!differs(&|other| other.coordination.gains.damping = 6.0));
    assert!(!differs(&|other| other.peers[2].compute_delay = true));
}
