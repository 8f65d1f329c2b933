//! Proofs against points whose verdicts were computed apart, with 60 digits: see `crates/stability/tests/reference/verdicts.py`.
//!
//! A box that is proven stable must not hold an unstable point, and a box that is proven unstable must not hold a stable point. Each fault of the prover in
//! [`FAULTS`] must show: with the fault some boxes hold such points, or too few points lie in decided boxes.

use cohaptic_stability::frames::Structure;
use cohaptic_stability::{Family, KeyRange};
use serde_json::Value;

use super::followed::Followed;
use super::guarantee::Proven;
use super::mutation::{Mutation, with};
use super::*;

struct Point {
    at: [f64; 2],
    is_stable: bool,
}

struct Case {
    name: String,
    family: Family,
    ranges: [[f64; 2]; 2],
    spread: Vec<Point>,
    /// Points at 10⁻² to 10⁻⁹ from a crossing, relative to the distance between two points of `spread`.
    near: Vec<Point>,
}

/// Constants of `verdicts.py`, which places the points of `spread` in the same way.
const GRID: usize = 1 << 20;
const STEPS: [usize; 2] = [648_055, 400_521];

#[expect(clippy::cast_precision_loss, reason = "below 2^20")]
fn spread(ranges: &[[f64; 2]; 2], point: usize) -> [f64; 2] {
    std::array::from_fn(|key| {
        let [low, high] = ranges[key];
        low + (high - low) * ((point * STEPS[key] % GRID) as f64 / GRID as f64)
    })
}

fn case(entry: &Value) -> Case {
    let text = |key: &str| entry[key].as_str().unwrap();
    let name = text("name").to_owned();
    let number = |value: &Value| value.as_f64().unwrap();
    let ranges: [[f64; 2]; 2] = std::array::from_fn(|key| std::array::from_fn(|end| number(&entry["ranges"][key][end])));
    let keys =
        (0..2).map(|key| KeyRange::parse(&format!("{}={:?}..{:?}", entry["keys"][key].as_str().unwrap(), ranges[key][0], ranges[key][1])).unwrap());
    let family = Family::new(text("scene"), name.as_ref(), &[], keys.collect()).unwrap_or_else(|error| panic!("{name}: {error}"));
    let digits: Vec<u32> = text("stable").chars().map(|digit| digit.to_digit(16).unwrap()).collect();
    let points = usize::try_from(entry["points"].as_u64().unwrap()).unwrap();
    // Each hexadecimal digit has the verdicts of four points, the first point in the lowest bit.
    let of_spread = |point: usize| Point { at: spread(&ranges, point), is_stable: digits[point / 4] >> (point % 4) & 1 == 1 };
    let of_near = |entry: &Value| Point { at: [number(&entry[0]), number(&entry[1])], is_stable: entry[2].as_bool().unwrap() };
    let near = entry["near"].as_array().unwrap().iter().map(of_near).collect();
    Case { spread: (0..points).map(of_spread).collect(), near, name, family, ranges }
}

fn cases() -> Vec<Case> {
    let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../stability/tests/reference/verdicts.json")).unwrap();
    serde_json::from_str::<Vec<Value>>(&text).unwrap().iter().map(case).collect()
}

/// Agreement of decided boxes with the points in these boxes.
#[derive(Default, Debug)]
struct Found {
    /// Number of pairs of a decided box and a point in that box.
    judged: usize,
    contradictions: Vec<String>,
}

impl Found {
    /// Decides a box. An undecided box that holds points is divided into quarters, up to `depth` times.
    fn divide(&mut self, case: &Case, followed: &Followed<'_>, ranges: [[f64; 2]; 2], points: &[&Point], depth: u32) {
        let within = |ranges: &[[f64; 2]; 2]| {
            let holds = |point: &&&Point| ranges.iter().zip(point.at).all(|([low, high], value)| (*low..=*high).contains(&value));
            points.iter().filter(holds).copied().collect::<Vec<_>>()
        };
        let points = within(&ranges);
        if points.is_empty() || self.judge(case, followed, ranges, &points) || depth == 0 {
            return;
        }
        // Quarters share their edges, so a point on an edge is judged in both.
        let [x, y] = ranges.map(|[low, high]| [[low, low.midpoint(high)], [low.midpoint(high), high]]);
        y.into_iter().flat_map(|y| x.map(|x| [x, y])).for_each(|quarter| self.divide(case, followed, quarter, &points, depth - 1));
    }

    /// Decides a box, records contradictions with its points, and returns whether the box is decided.
    fn judge(&mut self, case: &Case, followed: &Followed<'_>, ranges: [[f64; 2]; 2], points: &[&Point]) -> bool {
        let proven = match followed.decide(&ranges) {
            // Dampings of devices that differ make too many numbers for a box.
            Err(ProofError::Numerous { .. }) => None,
            decided => decided.unwrap(),
        };
        let Some(proven) = proven else { return false };
        self.judged += points.len();
        for point in points.iter().filter(|point| point.is_stable != (proven == Proven::Stable)) {
            self.contradictions.push(format!("{}: {proven:?} throughout {ranges:?}, but not at {:?}", case.name, point.at));
        }
        true
    }

    /// Compares boxes with all points of a case. Around each point near a crossing boxes of many sizes are decided, each with the point at another place in the
    /// box.
    fn of(&mut self, case: &Case, change: &dyn Fn(&mut Followed<'_>)) {
        let mut followed = Followed::new(&case.family, None).unwrap_or_else(|error| panic!("{}: {error}", case.name));
        change(&mut followed);
        self.divide(case, &followed, case.ranges, &case.spread.iter().collect::<Vec<_>>(), 6);
        for (number, point) in case.near.iter().enumerate() {
            // Boxes from a quarter down to 2⁻²⁵ of the ranges, since a fault may show at one size only.
            for size in 2..26 {
                let share = |key: usize| spread(&[[0.0, 1.0]; 2], 26 * number + size)[key];
                let ranges = std::array::from_fn(|key| {
                    let [low, high] = case.ranges[key];
                    let width = (high - low) * libm::exp2(-f64::from(u8::try_from(size).unwrap()));
                    let from = (point.at[key] - share(key) * width).max(low).min(point.at[key]);
                    [from, (from + width).min(high).max(point.at[key])]
                });
                self.judge(case, &followed, ranges, &[point]);
            }
        }
    }
}

fn judged(cases: &[Case]) -> (usize, usize) {
    let mut found = Found::default();
    cases.iter().for_each(|case| found.of(case, &|_| ()));
    assert!(found.contradictions.is_empty(), "{:#?}", found.contradictions);
    (found.judged, cases.iter().map(|case| case.spread.len() + case.near.len()).sum())
}

#[test]
fn no_box_holds_a_point_of_the_other_kind() {
    let some: Vec<Case> = cases().into_iter().step_by(20).collect();
    let (judged, points) = judged(&some);
    assert!(points > 5_000 && judged > points / 2, "{judged} of {points}");
}

#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn no_box_holds_one_of_a_hundred_thousand_points_of_the_other_kind() {
    let (judged, points) = judged(&cases());
    assert!(points > 100_000 && judged > points / 2, "{judged} of {points}");
}

type Change = fn(&mut Followed<'_>);

/// Faults of the prover, and faults in what it knows of a scene.
///
/// [`Mutation::StillBeside`] is not listed, because no point shows that fault: the fault is of the second order, and radii of that order keep the boxes small.
/// Matrices with known eigenvalues show the fault, in `tests_of_matrices.rs`.
const FAULTS: [(&str, Option<Mutation>, Change); 7] = [
    ("boxes of half their size", Some(Mutation::HalfTheBox), |_| ()),
    ("one number that varies of two", Some(Mutation::OneNumber), |_| ()),
    ("nothing of the second order", Some(Mutation::FirstOrder), |_| ()),
    ("a diagonal that does not move", Some(Mutation::StillDiagonal), |_| ()),
    ("no differences between equal peers", None, |followed| structures(followed, |structure| structure.apart.fill(None))),
    ("others count by a hundredth less", None, |followed| structures(followed, |structure| structure.weights = structure.weights.scaled(0.99))),
    ("positions counted from ground", None, |followed| structures(followed, |structure| structure.tied = true)),
];

fn structures(followed: &mut Followed<'_>, change: impl Fn(&mut Structure)) {
    followed.stretches.iter_mut().flat_map(|stretch| &mut stretch.motions).for_each(|motion| change(&mut motion.structure));
}

/// Each fault makes a box that holds a point of the other kind, or leaves more than half of the points undecided, which the test without faults refuses too.
#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn faults_of_the_prover_are_seen() {
    let cases = cases();
    for (what, mutation, change) in FAULTS {
        let mut found = Found::default();
        let (mut looked_at, mut points) = (0, 0);
        for case in &cases {
            with(mutation, || found.of(case, &change));
            looked_at += 1;
            points += case.spread.len() + case.near.len();
            if !found.contradictions.is_empty() {
                break;
            }
        }
        let is_seen = !found.contradictions.is_empty() || found.judged <= points / 2;
        assert!(is_seen, "{what}: {} points of {looked_at} scenes, and no box shows it", found.judged);
    }
}
