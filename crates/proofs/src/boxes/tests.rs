//! Proofs compared with the spectral radii of single scenes, which are computed in another way and have bounds of their own.

use cohaptic_scene::Scene;
use cohaptic_stability::frames::{Autonomous, Contacts, Lifted, NominalNetwork, Sampling, Structure};
use cohaptic_stability::numerics::real;
use cohaptic_stability::{
    AnalysisError, Boundary, BoundaryOptions, Family, FamilyScratch, KeyRange, Matrix, Method, Unwatched, Verdict, Watch, analyse, eigenvalues,
    mean_square,
};

use super::corners::{Common, Point};
use super::discs::decide;
use super::guarantee::Proven;
use super::span::StepSpan;
use super::steps::Plans;
use super::*;

const SCENE: &str = r#"
    scene = { duration = "1s", count = 2 }
    object = { mass = 0.45 }
    coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
    peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
    link = { delay = "8ms" }
"#;

fn owned(set: &[&str]) -> Vec<String> {
    set.iter().map(|text| (*text).to_owned()).collect()
}

fn scene(set: &[&str]) -> Scene {
    Scene::parse(SCENE, "two.toml".as_ref(), &owned(set)).unwrap()
}

const PD: &str = "coordination.strategy=\"proportional-derivative\"";

/// Returns the verdict on a number of peers by the spectral radius of the single scene.
fn single(set: &[&str], number: u64) -> Verdict {
    let count = format!("scene.count={number}");
    analyse(&scene(&[set, &[&count]].concat()), Method::Reduced).unwrap().verdict()
}

pub(super) fn proven(span: &StepSpan) -> Option<Proven> {
    decide(span).map(|decision| decision.proven)
}

fn spans(set: &[&str], from: u64, to: Option<u64>) -> EveryNumber {
    prove_every_number(&scene(set), from, to, &Unwatched).unwrap()
}

/// Single scenes agree with the spans on both sides of each end, at the ends and in the middle. Only numbers without a limit stay undecided.
#[test]
fn every_number_is_judged_as_single_scenes_are() {
    for set in [
        &[][..],
        &["link.delay=16ms"],
        &[PD],
        &["object.split-mass=false"],
        &["object.split-mass=false", "link.delay=24ms"],
        &["object.split-mass=false", PD],
        &["object.split-mass=false", PD, "coordination.scaling=\"inverse-n\"", "peer.coupling.scaling=\"inverse-n\""],
        &["coordination.strategy=\"local-damping\""],
        &["coordination.strategy=\"local-lag\""],
        &["coordination.strategy=\"extrapolated\""],
        &["coordination.strategy=\"extrapolated\"", "object.split-mass=false", "link.delay=3ms"],
        &["object.damping=2", "peer.device.damping=1"],
        &["peer.compute-delay=1"],
        &["peer.device.exchange-every=3", "peer.device.exchange-age=1", "peer.coupling.stiffness=900"],
        &["link.loss={ packets = [2, 3], every = 20 }", "object.split-mass=false"],
        &["scene.count=3", "peers=[{ name = \"peer1\", contact = \"none\" }]"],
        &["scene.count=4", "peers=[{ name = \"peer1\", device = { mass = 0.2 } }, { name = \"peer2\", device = { mass = 0.2 } }]", PD],
        &["scene.axes=3", "object.inertia=2.7e-4", "peer.grasp=[0.03, 0, 0]", "object.split-mass=false"],
        &["scene.axes=3", "object.inertia=2.7e-4", "coordination.stiffness=300", PD],
        &[
            "scene.count=4",
            "peers=[{ name = \"peer1\", contact = \"none\" }]",
            "coordination.scaling=\"inverse-n\"",
            "peer.coupling.scaling=\"inverse-n\"",
        ],
        &["scene.axes=3", "object.enclosure={ min = -0.1, max = 0.1, stiffness = 500.0, damping = 1.0 }"],
    ] {
        let found = spans(set, 2, None);
        let mut next = if set.iter().any(|text| text.contains("peer2")) { 3 } else { 2 };
        for span in &found.spans {
            assert_eq!(span.from, next, "{set:?} {found:?}");
            next = span.to.map_or(0, |to| to + 1);
            let far = span.to.unwrap_or(90_000).min(90_000);
            for number in [span.from, span.from.midpoint(far), far, span.from + (far.max(span.from) - span.from) / 100] {
                if number > 90_000 {
                    continue;
                }
                // An undecided number and a marginal radius say nothing about each other.
                match (span.guarantee, single(set, number.min(2_000).max(span.from.min(2_000)))) {
                    (Guarantee::Stable, Verdict::Stable | Verdict::Marginal)
                    | (Guarantee::Unstable, Verdict::Unstable | Verdict::Marginal | Verdict::Overflow) => {}
                    (Guarantee::Undecided, _) => {
                        assert!(found.without_limit.as_ref().is_some_and(|what| what.contains("vanish")), "{set:?} {found:?}")
                    }
                    (guarantee, verdict) => panic!("{set:?}: {guarantee:?} for {span:?}, and {verdict:?} for {number}"),
                }
            }
        }
        assert_eq!((next, found.spans.last().unwrap().to), (0, None), "{set:?}: without gaps to the end");
    }
}

#[test]
fn average_position_without_a_divided_mass_is_stable_for_every_number() {
    let found = spans(&["object.split-mass=false"], 2, None);
    assert_eq!(found.spans, [NumberSpan { from: 2, to: None, guarantee: Guarantee::Stable }]);
    assert_eq!(found.without_limit, None);
}

/// Proportional-derivative coordination gains N − 1 springs: beyond 17 peers it is unstable, but for a stretch.
#[test]
fn numbers_of_which_other_numbers_say_nothing_are_found() {
    let found = spans(&["object.split-mass=false", PD], 2, None);
    let all: Vec<(u64, Option<u64>, Guarantee)> = found.spans.iter().map(|span| (span.from, span.to, span.guarantee)).collect();
    let expected = [(2, 17, Guarantee::Stable), (18, 144, Guarantee::Unstable), (145, 179, Guarantee::Stable), (180, u64::MAX, Guarantee::Unstable)];
    assert_eq!(all, expected.map(|(from, to, guarantee)| (from, Some(to).filter(|to| *to < u64::MAX), guarantee)));
    for number in [17, 18, 144, 145, 179, 180] {
        let is_stable = expected.iter().any(|(from, to, guarantee)| (*from..=*to).contains(&number) && *guarantee == Guarantee::Stable);
        assert_eq!(single(&["object.split-mass=false", PD], number) == Verdict::Stable, is_stable, "{number}");
    }
}

/// A frame of 300 ticks, in whose steps forces move a copy by more than it has moved: bounds of roundings that pass through the sizes of all entries decide no
/// number of these.
#[test]
fn numbers_of_long_frames_are_decided() {
    let found = spans(&["link.loss={ packets = [2, 3], every = 30 }", "coordination.update=\"10ms\"", "coordination.damping=60"], 2, Some(40));
    assert!(found.spans.iter().all(|span| span.guarantee != Guarantee::Undecided), "{found:?}");
    assert!(found.spans.len() > 1, "{found:?}");
}

/// Spans without end are decided also if gains and the effects of forces both grow with N.
#[test]
fn numbers_beyond_all_are_decided_where_two_numbers_grow() {
    let last = spans(&[PD], 2, None).spans.pop().unwrap();
    assert_eq!((last.to, last.guarantee), (None, Guarantee::Unstable));
}

/// Steps divided by N/N₀, or by its square, lie within the box that is decided for all numbers from N₀ on.
#[test]
fn steps_that_grow_without_end_are_enclosed() {
    let network = NominalNetwork::of(&scene(&[PD])).unwrap();
    let contacts = Contacts { touching: vec![true; 2], at_wall: false, absent: vec![false; 2] };
    for (set, growth) in
        [(&[PD][..], corners::Growth::Quadratic), (&[], corners::Growth::Linear), (&[PD, "object.split-mass=false"], corners::Growth::Linear)]
    {
        let scene = scene(set);
        let structure = Structure::of(&[&scene], &network, &contacts).unwrap();
        let at = |number: usize| {
            vec![Point { nodes: structure.nodes(&scene.scaled_for(number)), weights: Matrix::from_fn(1, 1, |_, _| -1.0 / real(number - 1)) }]
        };
        // Own samples are heard with gains times 1/(N − 1), which is a constant for PD; for AP it is taken to be one here.
        let heard = |number: usize| {
            at(number)
                .into_iter()
                .map(|point| if set.is_empty() { Point { weights: Matrix::from_fn(1, 1, |_, _| -1e-3), ..point } } else { point })
                .collect::<Vec<_>>()
        };
        let nodes = structure.nodes(&scene);
        let timetable = structure.apart[0].as_ref().unwrap();
        let common = Common { timetable, plans: &Plans::default(), tied: true, time: structure.time(&scene, &nodes) };
        let near = 1000;
        let box_of_all = corners::steps_beyond([&heard(near), &heard(2 * near), &heard(3 * near)], growth, common).unwrap().kinds;
        for times in [1, 2, 3, 7, 100, 12_345] {
            // The box uses the compliance of its first point as its unit of force.
            let points = [heard(near), heard(times * near)].concat();
            let steps = corners::steps_of_each(&points, common).unwrap().pop().unwrap();
            assert_eq!(steps.len(), box_of_all.len());
            let by = if growth == corners::Growth::Quadratic { real(times * times) } else { real(times) };
            for (span, step) in box_of_all.iter().zip(&steps) {
                for i in 0..span.mean.rows() {
                    for j in 0..span.mean.columns() {
                        let reach: f64 = span.slopes.iter().map(|slope| slope[(i, j)].abs()).sum::<f64>() + span.radius[(i, j)];
                        let off = (step.matrix[(i, j)] / by - span.mean[(i, j)]).abs();
                        assert!(off <= reach * (1.0 + 1e-9) + 1e-12, "{set:?} {times}: {off} {reach}");
                        // Of one gain that grows, or of u and u², no effect of several numbers together is left for the radius.
                        assert!(span.radius[(i, j)] <= 1e-9 * (1.0 + span.mean.largest()), "{set:?}: {}", span.radius[(i, j)]);
                    }
                }
            }
        }
    }
}

/// A law that looks back takes another combination of the past at each corner of a box of both gains: between them steps are enclosed all the same.
#[test]
fn steps_of_a_law_that_looks_back_are_enclosed_over_both_gains() {
    let at = |stiffness: f64, damping: f64| {
        let gains = [format!("coordination.stiffness={stiffness:?}"), format!("coordination.damping={damping:?}")];
        let scene = scene(&["coordination.strategy=\"local-lag\"", &gains[0], &gains[1]]);
        let network = NominalNetwork::of(&scene).unwrap();
        let contacts = Contacts { touching: vec![true; 2], at_wall: false, absent: vec![false; 2] };
        let structure = Structure::of(&[&scene], &network, &contacts).unwrap();
        (Point { nodes: structure.nodes(&scene), weights: Matrix::from_fn(1, 1, |_, _| -1.0) }, structure)
    };
    let (low, high) = ([100.0, 0.5], [3000.0, 40.0]);
    let corners: Vec<Point> = (0..4).map(|place| at([low[0], high[0]][place & 1], [low[1], high[1]][place >> 1]).0).collect();
    let (_, structure) = at(1000.0, 5.0);
    let common = Common { timetable: structure.apart[0].as_ref().unwrap(), plans: &Plans::default(), tied: true, time: 0.01 };
    for share in [0.1, 0.5, 0.8] {
        let inside = at(low[0] + share * (high[0] - low[0]), low[1] + (1.0 - share) * (high[1] - low[1])).0;
        let steps = corners::steps_of_each(&[corners.clone(), vec![inside]].concat(), common).unwrap();
        for (step, exact) in steps[4].iter().enumerate() {
            let span = StepSpan::of(steps[..4].iter().map(|steps| &steps[step]));
            for i in 0..span.mean.rows() {
                for j in 0..span.mean.columns() {
                    let signs = [2.0 * share - 1.0, 1.0 - 2.0 * share];
                    let centre = span.slopes.iter().zip(signs).map(|(slope, sign)| sign * slope[(i, j)]).sum::<f64>() + span.mean[(i, j)];
                    let off = (exact.matrix[(i, j)] - centre).abs();
                    assert!(off <= span.radius[(i, j)] + 1e-12, "{share}: {off} {}", span.radius[(i, j)]);
                }
            }
        }
    }
}

#[test]
fn scenes_without_a_proof_are_refused_by_name() {
    let refused = |set: &[&str]| prove_every_number(&scene(set), 2, None, &Unwatched).unwrap_err().to_string();
    for (set, words) in [
        (&["link.loss={ gilbert-elliott = { p = 0.1, r = 0.5 } }"][..], "leave something to chance"),
        (&["link.loss=10%", "scene.count=3", "peers=[{ name = \"peer1\", contact = \"none\" }]"], "leave something to chance"),
        (&["peers=[{ name = \"peer2\", device = { mass = 0.2 } }]"], "no two peers are equal"),
        (&["peer.contact=\"none\"", "peer.device.damping=0"], "touches nothing"),
        (&["coordination.strategy=\"extrapolated\"", "link.loss=10%"], "extrapolated coordination uses the ages of samples"),
        (&["coordination.strategy=\"passivity-control\""], "passivity-control"),
        (&["coordination.strategy=\"client-server\""], "client-server coordination is analysed only as a whole"),
        (&["coordination.strategy=\"wave\"", "link.loss=10%"], "wave coordination is analysed only as a whole"),
        (&["scene.axes=3", "object.inertia=2.7e-4", "peers.peer1.grasp=[0.03, 0, 0]"], "`map` and `boundary` take all components together"),
    ] {
        let message = refused(set);
        assert!(message.contains(words), "{set:?}: {message}");
    }
    assert!(matches!(prove_every_number(&scene(&[]), 1, None, &Unwatched), Err(ProofError::Numbers)));
    assert!(matches!(prove_every_number(&scene(&[]), 9, Some(8), &Unwatched), Err(ProofError::Numbers)));
}

/// Refusals come before a frame is made: the frame of this scene would be too long.
#[test]
fn peers_without_an_equal_one_are_refused_before_a_frame_is_made() {
    let clocks = &["peers=[{ name = \"peer2\", clock = { drift = 1.234567e-3 } }]"];
    assert!(matches!(analyse(&scene(clocks), Method::Reduced), Err(AnalysisError::FrameTooLong { .. } | AnalysisError::NoFrame)));
    assert!(matches!(prove_every_number(&scene(clocks), 2, None, &Unwatched), Err(ProofError::Unequal)));
}

/// Watch that stops after it was asked a given number of times.
#[derive(Default)]
struct Patience {
    left: std::sync::atomic::AtomicU64,
    expected: std::sync::atomic::AtomicU64,
    done: std::sync::atomic::AtomicU64,
}

impl Watch for Patience {
    fn expects(&self, operations: f64) {
        add(&self.expected, operations);
    }

    fn done(&self, operations: f64) {
        add(&self.done, operations);
    }

    fn stops(&self) -> bool {
        let left = self.left.load(std::sync::atomic::Ordering::Relaxed);
        self.left.store(left.saturating_sub(1), std::sync::atomic::Ordering::Relaxed);
        left == 0
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count")]
fn add(count: &std::sync::atomic::AtomicU64, operations: f64) {
    count.fetch_add(operations as u64, std::sync::atomic::Ordering::Relaxed);
}

/// A proof that the watch ends keeps its verdicts, and all other numbers are undecided.
#[test]
fn a_proof_that_is_ended_keeps_what_it_has() {
    let patient = Patience { left: u64::MAX.into(), ..Patience::default() };
    let whole = prove_every_number(&scene(&[]), 2, None, &patient).unwrap();
    assert!(whole.is_whole && whole.spans.len() == 2);
    let counts = [&patient.expected, &patient.done].map(|count| count.load(std::sync::atomic::Ordering::Relaxed));
    assert_eq!(counts, [whole.attempts; 2]);
    for left in [0, 1, 20, whole.attempts - 1] {
        let part = prove_every_number(&scene(&[]), 2, None, &Patience { left: left.into(), ..Patience::default() }).unwrap();
        assert!(!part.is_whole && part.attempts == left);
        let (last, before) = part.spans.split_last().unwrap();
        assert_eq!((last.guarantee, last.to), (Guarantee::Undecided, None));
        let mut next = 2;
        for span in before {
            let of_whole = whole.spans.iter().find(|one| one.from <= span.from && one.to.is_none_or(|to| span.to.is_some_and(|end| end <= to)));
            assert_eq!((span.from, of_whole.map(|one| one.guarantee)), (next, Some(span.guarantee)), "{part:?}");
            next = span.to.unwrap() + 1;
        }
        assert!(last.from == next && (left < 20) == before.is_empty(), "{part:?}");
    }
}

/// The second moments of single scenes, which have bounds of their own, agree with the spans in the mean square: at the ends of spans, in between and at random
/// numbers.
#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn every_number_is_judged_in_the_mean_square_as_single_scenes_are() {
    for (set, has_end) in [
        (&["object.split-mass=false", "link.loss=20%"][..], true),
        (&["object.split-mass=false", "link.loss=60%", "link.delay=20ms"], true),
        (&["object.split-mass=false", "link.loss=10%", "coordination.stiffness=1700", "object.damping=1"], true),
        (&["object.split-mass=false", "link.loss=30%", PD], false),
        (&["object.split-mass=false", "link.loss=20%", PD, "coordination.scaling=\"inverse-n\"", "coordination.stiffness=300"], true),
        (&["link.loss=30%"], false),
        (&["object.split-mass=false", "link.delay=4ms", "link.jitter={ sd = \"1ms\", distribution = \"uniform\" }", "peer.compute-delay=1"], true),
        (&["object.split-mass=false", "object.damping=3", "peer.contact=\"none\"", "link.loss=40%", "coordination.damping=0"], true),
        (&["object.split-mass=false", "link.loss=20%", "coordination.strategy=\"smoothed-average-position\""], true),
    ] {
        let found = spans(set, 2, None);
        assert!(found.is_mean_square && found.without_limit.is_none() == has_end, "{set:?} {found:?}");
        let mut next = 2;
        for span in &found.spans {
            assert_eq!(span.from, next, "{set:?} {found:?}");
            next = span.to.map_or(0, |to| to + 1);
            assert!(span.guarantee != Guarantee::Undecided || !has_end && span.to.is_none(), "{set:?} {:?}", found.spans);
            let far = span.to.unwrap_or(90_000).min(90_000).max(span.from);
            for number in [span.from, span.from + 1, span.from.midpoint(far), far, span.from + (far - span.from) / 100] {
                if number > far || span.guarantee == Guarantee::Undecided {
                    continue;
                }
                let verdict = mean_square(&scene(&[set, &[&format!("scene.count={number}")]].concat())).unwrap().verdict();
                let agrees = match span.guarantee {
                    Guarantee::Stable => verdict == Verdict::Stable,
                    Guarantee::Unstable | Guarantee::Undecided => verdict == Verdict::Unstable,
                };
                assert!(agrees, "{set:?}: {span:?}, and {verdict:?} for {number}");
            }
        }
        assert_eq!((next, found.spans.last().unwrap().to), (0, None), "{set:?}: without gaps to the end");
    }
}

fn family(set: &[&str], x: &str, y: &str) -> Family {
    Family::new(SCENE, "two.toml".as_ref(), &owned(set), vec![KeyRange::parse(x).unwrap(), KeyRange::parse(y).unwrap()]).unwrap()
}

const GAINS: [&str; 2] = ["coordination.stiffness=100..6000", "coordination.damping=0..60"];

/// Returns the number of points within proven boxes of a region that were compared with single radii. Panics where a radius disagrees with its box.
fn agreeing(family: &Family, region: &ProvenRegion) -> usize {
    let mut scratch = FamilyScratch::default();
    let mut decided = 0;
    for (number, one) in region.boxes.iter().enumerate().filter(|(_, one)| one.guarantee != Guarantee::Undecided) {
        // Points differ from box to box, spread by the golden ratio.
        let share = |place: usize, irrational: f64| (real(number + 1) * (real(place) + irrational) * 0.618_033_988_749_894_9).fract();
        let between = |[low, high]: [f64; 2], share: f64| (low + share * (high - low)).clamp(low, high);
        let inside = (0..6).map(|place| [between(one.x, share(place, 0.3)), between(one.y, share(place, 0.7))]);
        let corners = [[one.x[0], one.y[0]], [one.x[1], one.y[0]], [one.x[0], one.y[1]], [one.x[1], one.y[1]]];
        for values in inside.chain(corners) {
            let verdict = family.bounded_radius(&values, &mut scratch).unwrap().radius.verdict();
            let contradicts = match one.guarantee {
                Guarantee::Stable => verdict == Verdict::Unstable,
                Guarantee::Unstable | Guarantee::Undecided => verdict == Verdict::Stable,
            };
            assert!(!contradicts, "{one:?}, and {verdict:?} at {values:?}");
            decided += 1;
        }
    }
    decided
}

/// No proven box holds a point of the other kind: single radii with their own bounds agree at thousands of points within proven boxes, the corners included.
#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn no_box_holds_a_point_that_contradicts_it() {
    for (set, [x, y]) in [
        (&["scene.count=3"][..], GAINS),
        (&["scene.count=5", "link.delay=20ms", PD], ["coordination.stiffness=100..2000", "coordination.damping=0..5"]),
        (&["scene.count=4", "link.delay=5ms", "peer.compute-delay=1"], ["coordination.stiffness=0..6000", "peer.coupling.stiffness=0..6000"]),
        (
            &["scene.count=3", "peer.device.exchange-every=2", "peer.device.exchange-age=1"],
            ["coordination.stiffness=100..3000", "peer.coupling.stiffness=100..6000"],
        ),
        (&["scene.count=8", PD], ["object.mass=0.1..2", "object.damping=0..10"]),
        (&["scene.count=3"], ["peer.device.mass=0.02..0.5", "peer.coupling.damping=0..20"]),
        (
            &["scene.count=3", "scene.axes=3", "object.inertia=2.7e-4", "peer.grasp=[0.02, 0, 0]"],
            ["object.mass=0.2..1", "coordination.stiffness=100..3000"],
        ),
        (&["scene.count=3", "peers=[{ name = \"peer2\", device = { mass = 0.2 } }, { name = \"peer3\", contact = \"none\" }]"], GAINS),
        (&["scene.count=3", "coordination.strategy=\"extrapolated\""], GAINS),
        (&["scene.count=3", "coordination.strategy=\"extrapolated\"", "coordination.extrapolated.horizon=10ms"], GAINS),
        // If two gains vary, each corner takes another combination of the past. If one gain varies, all corners take the same.
        (&["scene.count=3", "coordination.strategy=\"local-lag\""], ["coordination.stiffness=100..1000", "coordination.damping=0..20"]),
        (
            &["scene.count=3", "coordination.strategy=\"local-lag\"", "coordination.damping=0"],
            ["coordination.stiffness=100..1000", "object.mass=0.3..1"],
        ),
    ] {
        let family = family(set, x, y);
        let region = ProvenRegion::prove(&family, 5, None, &Unwatched).unwrap();
        let decided = agreeing(&family, &region);
        assert!(decided > 200, "{set:?} {x} {y}: {decided} points of {} boxes", region.boxes.len());
        let shares = [Guarantee::Stable, Guarantee::Unstable, Guarantee::Undecided].map(|guarantee| region.share(guarantee));
        assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-12 && shares[2] < 0.6, "{set:?} {x} {y}: {shares:?}");
    }
}

/// Two keys that are dampings make four coefficients of a step map each. The radii at points within the boxes come from single scenes, which know no boxes.
#[test]
fn two_dampings_make_a_region() {
    for (set, [x, y], least) in [
        (&["coordination.stiffness=2000"][..], ["object.damping=0..8", "peer.device.damping=0.5..8"], 0.2),
        (&["coordination.stiffness=2000"], ["object.damping=0..8", "object.mass=0.2..1"], 0.2),
        (&["scene.count=4", "topology={ kind = \"ring\" }"], ["object.damping=0..8", "object.mass=0.2..1"], 0.2),
    ] {
        let family = family(set, x, y);
        let region = ProvenRegion::prove(&family, 3, None, &Unwatched).unwrap();
        let points = agreeing(&family, &region);
        let open = region.share(Guarantee::Undecided);
        assert!(points > 20 && open < 1.0 - least, "{set:?} {x} {y}: {points} points, {open} undecided");
    }
}

/// Three devices that differ have four coefficients each under one damping, beside four of the copies.
#[test]
fn too_many_coefficients_are_counted() {
    let set = ["scene.count=3", "peers=[{ name = \"peer2\", device = { mass = 0.2 } }, { name = \"peer3\", device = { mass = 0.3 } }]"];
    let family = family(&set, "object.damping=0..8", "peer.device.damping=0.5..8");
    let message = ProvenRegion::prove(&family, 3, None, &Unwatched).unwrap_err().to_string();
    assert!(message.starts_with("16 numbers of the steps vary at once, 16 of them coefficients") && message.contains("at most 10"), "{message}");
}

/// Every crossing that a search finds lies in a stretch that is not decided, and no stretch is longer than asked for.
#[test]
fn a_line_encloses_every_crossing() {
    for (set, key) in [
        (&["link.delay=16ms"][..], "coordination.stiffness=100..6000"),
        (&["scene.count=3", PD], "coordination.damping=0..60"),
        (&["scene.count=60"], "object.mass=0.05..1"),
    ] {
        let range = KeyRange::parse(key).unwrap();
        let family = Family::new(SCENE, "two.toml".as_ref(), &owned(set), vec![range.clone()]).unwrap();
        let line = ProvenLine::prove(&family, 1e-6, &Unwatched).unwrap();
        let crossings = Boundary::find(&family, BoundaryOptions::of(&range), &[], |_| (), || false).unwrap().crossings;
        assert!(!crossings.is_empty(), "{set:?} {key}");
        let open: Vec<&ProvenStretch> = line.stretches.iter().filter(|stretch| stretch.guarantee == Guarantee::Undecided).collect();
        for crossing in &crossings {
            assert!(
                open.iter().any(|stretch| (stretch.low - 1e-5..=stretch.high + 1e-5).contains(&crossing.value)),
                "{set:?} {key}: {crossing:?} {line:?}"
            );
        }
        assert_eq!(open.len(), crossings.len(), "{set:?} {key}: {crossings:?} {line:?}");
        assert!(open.iter().all(|stretch| stretch.high - stretch.low <= 4e-6), "{set:?} {key}: {line:?}");
        let (first, last) = (line.stretches[0], line.stretches[line.stretches.len() - 1]);
        assert_eq!((first.low, last.high), (range.low, range.high));
        assert!(line.stretches.windows(2).all(|pair| pair[0].high.to_bits() == pair[1].low.to_bits() && pair[0].guarantee != pair[1].guarantee));
    }
}

/// More halvings keep every verdict and leave less undecided.
#[test]
fn finer_boxes_decide_more() {
    let family = family(&["scene.count=3"], GAINS[0], GAINS[1]);
    let regions = [3, 5, 7].map(|halvings| ProvenRegion::prove(&family, halvings, None, &Unwatched).unwrap());
    let open = regions.each_ref().map(|region| region.share(Guarantee::Undecided));
    assert!(open[0] > 2.0 * open[1] && open[1] > 2.0 * open[2], "{open:?}");
    for pair in regions.windows(2) {
        assert!(pair[0].share(Guarantee::Stable) <= pair[1].share(Guarantee::Stable));
        assert!(pair[0].share(Guarantee::Unstable) <= pair[1].share(Guarantee::Unstable));
    }
}

#[test]
fn keys_that_do_more_than_to_set_numbers_are_refused() {
    let refused = |set: &[&str], x: &str, y: &str| ProvenRegion::prove(&family(set, x, y), 3, None, &Unwatched).unwrap_err().to_string();
    assert!(refused(&[], "link.jitter=0ms..4ms", GAINS[1]).starts_with("link.jitter does more than"));
    assert!(refused(&["link.loss=5%"], GAINS[0], GAINS[1]).contains("leave something to chance"));
}

/// The steps of a frame multiply to the matrix of the frame: the same eigenvalues, but for zeros, as the analysis of the scene.
#[test]
fn the_product_of_the_steps_is_the_frame() {
    for set in [
        &[][..],
        &["link.delay=24ms"],
        &["link.delay=3ms", "coordination.update=5ms"],
        &["peer.compute-delay=1"],
        &["peer.device.exchange-every=3", "peer.device.exchange-age=1"],
        &["peer.device.exchange-every=4"],
        &["coordination.damping=0"],
        &["coordination.strategy=\"extrapolated\"", "link.delay=11ms"],
        &["coordination.strategy=\"extrapolated\"", "coordination.extrapolated.horizon=13ms", "link.delay=11ms"],
        &["coordination.strategy=\"local-lag\""],
    ] {
        let scene = scene(set);
        let network = NominalNetwork::of(&scene).unwrap();
        let contacts = Contacts { touching: vec![true; 2], at_wall: false, absent: vec![false; 2] };
        let structure = Structure::of(&[&scene], &network, &contacts).unwrap();
        let node = structure.node(&scene, 0);
        let time = structure.time(&scene, std::slice::from_ref(&node));
        for (weight, tied, timetable) in [(1.0, structure.tied, &structure.timetable), (-1.0, true, structure.apart[0].as_ref().unwrap())] {
            let point = Point { nodes: vec![node.clone()], weights: Matrix::from_fn(1, 1, |_, _| weight) };
            let common = Common { timetable, plans: &Plans::default(), tied, time };
            let product = corners::steps(std::slice::from_ref(&point), std::slice::from_ref(&point.nodes), common).unwrap().product();
            let sampling = Sampling::of(&point.nodes);
            let lifted = Lifted { nodes: &point.nodes, weights: &point.weights, timetable, sampling, time, tied };
            let expected = lifted.frame(&mut Autonomous).monodromy();
            let sorted = |matrix: &Matrix| {
                let mut values: Vec<(f64, f64)> =
                    eigenvalues(matrix).iter().map(|value| (value.re, value.im)).filter(|(re, im)| re.hypot(*im) > 1e-3).collect();
                values.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.total_cmp(&other.1)));
                values
            };
            let (found, expected) = (sorted(&product.mean), sorted(&expected));
            assert_eq!(found.len(), expected.len(), "{set:?}");
            for (found, expected) in found.iter().zip(&expected) {
                assert!((found.0 - expected.0).hypot(found.1 - expected.1) < 1e-9, "{set:?}: {found:?} is not {expected:?}");
            }
            assert!(product.radius.largest() < 1e-9, "{set:?}");
        }
    }
}

/// Store of pieces that counts the pieces that were not known.
#[derive(Default)]
struct Kept(std::sync::Mutex<(std::collections::BTreeMap<Vec<u64>, Guarantee>, usize)>);

fn bits(ranges: &[[f64; 2]]) -> Vec<u64> {
    ranges.iter().flatten().map(|value| value.to_bits()).collect()
}

impl KnownPieces for Kept {
    fn known(&self, ranges: &[[f64; 2]]) -> Option<Guarantee> {
        self.0.lock().unwrap().0.get(&bits(ranges)).copied()
    }

    fn found(&self, ranges: &[[f64; 2]], guarantee: Guarantee) {
        let mut kept = self.0.lock().unwrap();
        kept.0.insert(bits(ranges), guarantee);
        kept.1 += 1;
    }
}

/// A proof whose blocks are all known decides nothing anew and equals the proof of one process, whatever the order of the blocks and the number of processes.
#[test]
fn blocks_make_the_proof_of_one_process() {
    let line = Family::new(SCENE, "two.toml".as_ref(), &[], vec![KeyRange::parse("object.mass=0.05..1").unwrap()]).unwrap();
    let region = family(&["scene.count=3"], GAINS[0], GAINS[1]);
    // Delays of up to 7, up to 8 and up to 8.5 ms are three scenes, and never halved.
    let delayed = family(&["scene.count=3"], "link.delay=7ms..8.5ms", GAINS[1]);
    for (region, halvings, blocks) in [(&region, 0, 1), (&region, 1, 4), (&region, 5, 64), (&delayed, 0, 3), (&delayed, 2, 12)] {
        let shared = SharedProof::of_region(region, halvings, None).unwrap();
        assert_eq!(shared.blocks(), blocks);
        let (kept, done) = (Kept::default(), std::sync::Mutex::new(Vec::new()));
        let blocks: Vec<u64> = (0..shared.blocks()).rev().collect();
        for block in &blocks {
            shared.look_at(region, &[*block], &kept, |block| done.lock().unwrap().push(block), &Unwatched).unwrap();
            assert!(shared.is_known(*block, &kept));
        }
        assert_eq!(*done.lock().unwrap(), blocks);
        let looked_at = kept.0.lock().unwrap().1;
        let whole = ProvenRegion::prove(region, halvings, None, &Unwatched).unwrap();
        assert_eq!(ProvenRegion::prove_with(region, halvings, None, &kept, &Unwatched).unwrap(), whole);
        // Neither the blocks nor the whole look at a piece twice, and the blocks look at no other pieces.
        assert_eq!((kept.0.lock().unwrap().1, looked_at), (looked_at, whole.attempts));
    }
    let shared = SharedProof::of_line(&line, 1e-6).unwrap();
    let kept = Kept::default();
    let half: Vec<u64> = (0..64).filter(|block| block % 2 == 0).collect();
    shared.look_at(&line, &half, &kept, |_| (), &Unwatched).unwrap();
    let known = (0..64).filter(|block| shared.is_known(*block, &kept)).count();
    assert!((32..64).contains(&known), "{known}");
    // A missing piece is decided again.
    assert_eq!(ProvenLine::prove_with(&line, 1e-6, &kept, &Unwatched).unwrap(), ProvenLine::prove(&line, 1e-6, &Unwatched).unwrap());
    // The watch can end the proof.
    let ended = Patience::default();
    shared.look_at(&line, &[0], &Kept::default(), |block| panic!("{block} is not whole"), &ended).unwrap();
}
