//! Boxes of numbers: lifted systems with step matrices multi-affine between the corners of a box.
//!
//! The gains of a node are numbers of the box themselves. A body enters by the coefficients of its step map. For a free body, m·a = f − b·v, each coefficient
//! is monotone in m and in b, so the values at the ends of the box enclose the coefficient. If several coefficients vary, each becomes a separate number, and
//! the numbers together enclose more than the box. If the damping b stays, a constant force f has the final velocity f/b. Then two coefficients follow from the
//! other two: e₁₁ + b·g₁ = 0 and e₀₁ + b·g₀ = h.

use std::borrow::Cow;

use cohaptic_peer::{Gains, StepMap};
use cohaptic_stability::Matrix;
use cohaptic_stability::frames::{Body, Node, Sampling, Scale, Timetable};

use super::error::ProofError;
use super::span::{FrameSpan, StepSpan};
use super::steps::{FrameState, Numbers, Plan, Plans, StepMatrix};

/// Numbers of a part of a scene at a corner of a box.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Point {
    pub(super) nodes: Vec<Node>,
    pub(super) weights: Matrix,
}

/// Data common to all corners of a box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Common<'a> {
    pub(super) timetable: &'a Timetable,
    /// Plans of `timetable`.
    pub(super) plans: &'a Plans,
    pub(super) tied: bool,
    /// Time by which velocities are multiplied \[s\].
    pub(super) time: f64,
}

/// Largest number of varying numbers of a box, since n numbers make 2ⁿ corners. Two dampings make four coefficients of a step map each, if bodies are equal
/// in all peers. The limit leaves room for the weight of the heard peers, and for a further number.
const MOST_NUMBERS: usize = 10;

/// Parts of the computation of steps common to all points.
struct Frame<'a> {
    plan: &'a Plan,
    sampling: Sampling,
    scale: Scale,
    tied: bool,
    /// `true` if position and velocity of the own past are separate states, because the corners take different combinations of both.
    whole_past: bool,
}

impl<'a> Frame<'a> {
    fn of(points: &[Point], common: Common<'a>) -> Result<Self, ProofError> {
        let all: Vec<Node> = points.iter().flat_map(|point| point.nodes.iter().cloned()).collect();
        let sampling = Sampling::of(&all);
        let scale = Scale { time: common.time, compliance: points[0].nodes[0].compliance(common.time) };
        check_units(points, scale)?;
        let whole_past = !takes_one_past(points, scale);
        let ages = all.iter().any(|node| node.law.horizon.is_some());
        Ok(Self { plan: common.plans.of(common.timetable, !sampling.is_silent(scale.time), ages), sampling, scale, tied: common.tied, whole_past })
    }

    fn matrices(&self, point: &Point) -> Vec<StepMatrix> {
        let nodes = self.nodes(point);
        self.plan.matrices(Numbers { nodes: &nodes, weights: &point.weights, sampling: self.sampling, scale: self.scale, tied: self.tied })
    }

    fn nodes<'p>(&self, point: &'p Point) -> Cow<'p, [Node]> {
        if !self.whole_past {
            return Cow::Borrowed(&point.nodes);
        }
        Cow::Owned(point.nodes.iter().map(|node| Node { keeps_whole_past: true, ..node.clone() }).collect())
    }
}

/// Returns the steps of a frame over the box of 2ⁿ points: point i has number b at its upper end if bit b of i is set. Bodies vary between the bodies
/// of `ends`; the bodies of the points do not count.
pub(super) fn steps(points: &[Point], ends: &[Vec<Node>], common: Common<'_>) -> Result<FrameSpan, ProofError> {
    let frame = Frame::of(points, common)?;
    let kinds = enclosed(points, ends, |point| frame.matrices(point))?;
    #[cfg(test)]
    let kinds = super::mutation::of_steps(kinds);
    Ok(FrameSpan { kinds, order: frame.plan.kinds().to_vec() })
}

/// Encloses matrices over the box of the points, given the function from a corner to its matrices. Bodies vary between the bodies of `ends`; the
/// bodies of the points do not count.
pub(super) fn enclosed(points: &[Point], ends: &[Vec<Node>], matrices: impl Fn(&Point) -> Vec<StepMatrix>) -> Result<Vec<StepSpan>, ProofError> {
    let corners: Vec<Vec<StepMatrix>> = with_bodies(points, ends)?.iter().map(matrices).collect();
    Ok((0..corners[0].len()).map(|step| StepSpan::of(corners.iter().map(|steps| &steps[step]))).collect())
}

/// Returns the states of a frame over the box of the points.
pub(super) fn states(points: &[Point], common: Common<'_>) -> Result<States, ProofError> {
    let frame = Frame::of(points, common)?;
    let names = frame.plan.states(&frame.nodes(&points[0]), frame.sampling.channels(), frame.tied);
    let heard = match frame.sampling {
        Sampling::Combined(gains) => Some(gains),
        Sampling::Whole => None,
    };
    Ok(States { names, heard })
}

/// Names of the states of a frame.
pub(super) struct States {
    /// Names in the order of rows and columns.
    pub(super) names: Vec<FrameState>,
    /// Gains of the combination of a sample into one number; `None`: a sample is a position and a velocity.
    pub(super) heard: Option<Gains>,
}

/// Encloses, for all N ≥ N₀, the steps T of a frame with unlimited growth of entries with N, each step divided by N/N₀ or by (N/N₀)². `at` has the points at
/// N₀, 2·N₀ and 3·N₀.
///
/// With [`Growth::Linear`], T = A + N·B is affine in N. With u = N₀/N from 0 to 1, u·T = u·A + N₀·B lies between T(N₀) and N₀·B = T(2·N₀) − T(N₀).
/// With [`Growth::Quadratic`], T = A + N·B + N²·C. With L = N₀·B and Q = N₀²·C, u²·T = u²·A + u·L + Q lies between the four matrices with 0 or 1 for u² and for
/// u.
pub(super) fn steps_beyond(at: [&[Point]; 3], growing: Growth, common: Common<'_>) -> Result<FrameSpan, ProofError> {
    let all: Vec<Point> = at.iter().flat_map(|points| points.iter().cloned()).collect();
    let frame = Frame::of(&all, common)?;
    let [near, far, third] = at.map(|points| points.iter().map(|point| frame.matrices(point)).collect::<Vec<_>>());
    // The factors add up to at most a dozen, and the roundings of the sums themselves are small compared with the errors of the steps.
    let sum = |of: [&StepMatrix; 3], by: [f64; 3]| {
        let matrix =
            Matrix::from_fn(of[0].matrix.rows(), of[0].matrix.columns(), |i, j| of.iter().zip(by).map(|(step, by)| by * step.matrix[(i, j)]).sum());
        StepMatrix { matrix, error: 32.0 * of.iter().map(|step| step.error).fold(0.0, f64::max) }
    };
    // Factors of T at N₀, 2·N₀ and 3·N₀ for each corner but the last, which is T(N₀).
    let corners: &[[f64; 3]] = match growing {
        Growth::Linear => &[[-1.0, 1.0, 0.0]],
        // Q = (T₃ − 2·T₂ + T₁)/2, L = T₂ − T₁ − 3·Q: Q, Q + A = T₁ − L, and Q + L.
        Growth::Quadratic => &[[0.5, -1.0, 0.5], [3.5, -4.0, 1.5], [-2.0, 3.0, -1.0]],
    };
    let span = |step: usize| {
        let of = |by: &[f64; 3]| {
            near.iter().zip(&far).zip(&third).map(|((near, far), third)| sum([&near[step], &far[step], &third[step]], *by)).collect::<Vec<_>>()
        };
        let limits: Vec<StepMatrix> = corners.iter().flat_map(of).collect();
        StepSpan::of(limits.iter().chain(near.iter().map(|steps| &steps[step])))
    };
    Ok(FrameSpan { kinds: (0..near[0].len()).map(span).collect(), order: frame.plan.kinds().to_vec() })
}

/// Growth of the steps of a frame with the number N of peers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Growth {
    /// Growth as N: the gains of the law grow, or the effects of a force on a copy.
    Linear,
    /// Growth as N²: the gains of the law grow, and the effects of a force on a copy too.
    Quadratic,
}

/// Returns the matrices of all kinds of steps at each point, in the units of the first point.
#[cfg(test)]
pub(super) fn steps_of_each(points: &[Point], common: Common<'_>) -> Result<Vec<Vec<StepMatrix>>, ProofError> {
    let frame = Frame::of(points, common)?;
    Ok(points.iter().map(|point| frame.matrices(point)).collect())
}

/// Returns all points at the lower end of a further number, followed by all points at its upper end. The new number is thus the highest bit of a place.
pub(super) fn doubled(points: &[Point], at: impl Fn(&Point, bool) -> Point) -> Vec<Point> {
    [false, true].into_iter().flat_map(|upper| points.iter().map(move |point| (point, upper))).map(|(point, upper)| at(point, upper)).collect()
}

/// Refuses laws with memories in units of varying gains, since the states would have another meaning at each corner.
pub(super) fn check_units(points: &[Point], scale: Scale) -> Result<(), ProofError> {
    let units = |point: &Point| -> Vec<u64> {
        let of = |node: &Node| (0..node.law.memory.len()).map(|place| node.memory_unit(place, scale).to_bits()).collect::<Vec<_>>();
        point.nodes.iter().flat_map(of).collect()
    };
    if points.iter().any(|point| units(point) != units(&points[0])) {
        return Err(ProofError::Remembered);
    }
    Ok(())
}

/// Returns whether laws take the same combination of the own past position and velocity at each corner. Differences of some roundings are allowed:
/// the bounds of a step have room for such differences.
pub(super) fn takes_one_past(points: &[Point], scale: Scale) -> bool {
    let shares = |point: &Point| -> Vec<f64> {
        let of = |node: &Node| (node.looks_back() > 0).then(|| node.law.force.past.stiffness / node.past_unit(scale.time));
        point.nodes.iter().filter_map(of).collect()
    };
    let first = shares(&points[0]);
    let is_first = |share: (&f64, &f64)| (share.0 - share.1).abs() <= 8.0 * f64::EPSILON;
    points.iter().map(shares).all(|shares| shares.len() == first.len() && shares.iter().zip(&first).all(is_first))
}

/// Bodies at each end of the box, and the nodes with exactly these bodies.
type EqualBodies = (Vec<Body>, Vec<(usize, BodyOf)>);

/// Returns the points with a further number for each coefficient of a step map with different values at the ends. Bodies equal at every end share these
/// numbers, because their coefficients are the same functions of the keys.
fn with_bodies(points: &[Point], ends: &[Vec<Node>]) -> Result<Vec<Point>, ProofError> {
    let mut groups: Vec<EqualBodies> = Vec::new();
    for node in 0..points[0].nodes.len() {
        for body in [BodyOf::Copy, BodyOf::Device] {
            let found: Vec<Body> = ends.iter().filter_map(|nodes| body.of(&mut nodes[node].clone()).copied()).collect();
            if found.iter().all(|other| *other == found[0]) {
                continue;
            }
            match groups.iter_mut().find(|(bodies, _)| *bodies == found) {
                Some((_, places)) => places.push((node, body)),
                None => groups.push((found, vec![(node, body)])),
            }
        }
    }
    let mut varying = Vec::new();
    for (found, bodies) in groups {
        let ranges = ranges(&found)?;
        varying.push((bodies, ranges, together(&ranges, &found)));
    }
    let mut all = points.to_vec();
    for (bodies, ranges, _) in &varying {
        for point in &mut all {
            for (node, body) in bodies {
                if let Some(place) = body.of(&mut point.nodes[*node]) {
                    *place = place.with_map(map_of(ranges.map(|(low, _)| low)));
                }
            }
        }
    }
    // With all bodies at their lower ends, a key of bodies alone changes no point any more. The coefficients replace such a key.
    let mut all = without_idle_numbers(all);
    let numbers = all.len().trailing_zeros() as usize;
    let coefficients_of_bodies: usize = varying.iter().map(|(_, _, together)| together.len()).sum();
    if numbers + coefficients_of_bodies > MOST_NUMBERS {
        return Err(ProofError::Numerous { coefficients: coefficients_of_bodies, others: numbers, most: MOST_NUMBERS });
    }
    for (bodies, ranges, together) in varying {
        let set = |point: &Point, values: &dyn Fn([f64; 6]) -> [f64; 6]| {
            let mut point = point.clone();
            for (node, body) in &bodies {
                if let Some(place) = body.of(&mut point.nodes[*node]) {
                    *place = place.with_map(map_of(values(coefficients(&place.only_map().unwrap_or_else(|| map_of([0.0; 6]))))));
                }
            }
            point
        };
        // A falling coefficient is at its greatest value at the lower end of the number, so `upper` is compared with `falls`.
        for places in together {
            all = doubled(&all, |point, upper| {
                let at = |mut values: [f64; 6]| {
                    places.iter().for_each(|(place, falls)| values[*place] = if upper == *falls { ranges[*place].0 } else { ranges[*place].1 });
                    values
                };
                set(point, &at)
            });
        }
    }
    Ok(all)
}

/// Removes the numbers without an effect on any point.
fn without_idle_numbers(mut points: Vec<Point>) -> Vec<Point> {
    let mut number = 0;
    while points.len() > 1 << number {
        // Bit `number` of a place is the end of the number. If both ends give equal points, the points of the upper end are dropped.
        let bit = 1 << number;
        let is_idle = (0..points.len()).filter(|place| place & bit == 0).all(|place| points[place] == points[place | bit]);
        if is_idle {
            let mut place = 0;
            points.retain(|_| {
                place += 1;
                (place - 1) & bit == 0
            });
        } else {
            number += 1;
        }
    }
    points
}

/// Choice of a body of a node.
#[derive(Clone, Copy)]
enum BodyOf {
    Copy,
    Device,
}

impl BodyOf {
    const fn of(self, node: &mut Node) -> Option<&mut Body> {
        match self {
            Self::Copy => Some(&mut node.object),
            Self::Device => node.device.as_mut(),
        }
    }
}

fn coefficients(map: &StepMap) -> [f64; 6] {
    let ([[e00, e01], [e10, e11]], [g0, g1]) = map.coefficients();
    [e00, e01, e10, e11, g0, g1]
}

const fn map_of([e00, e01, e10, e11, g0, g1]: [f64; 6]) -> StepMap {
    StepMap::new([[e00, e01], [e10, e11]], [g0, g1])
}

/// Returns the least and the greatest value of each coefficient of the step maps of the bodies, in the order of [`coefficients`].
///
/// # Errors
///
/// [`ProofError::Drift`] if a body has several step maps, and [`ProofError::TiedBody`] if an effect of a position varies.
fn ranges(bodies: &[Body]) -> Result<[(f64, f64); 6], ProofError> {
    let values = bodies.iter().map(|body| body.only_map().map(|map| coefficients(&map)).ok_or(ProofError::Drift)).collect::<Result<Vec<_>, _>>()?;
    let range = |place: usize| {
        let of = values.iter().map(|values| values[place]);
        (of.clone().fold(f64::INFINITY, f64::min), of.fold(f64::NEG_INFINITY, f64::max))
    };
    let ranges: [(f64, f64); 6] = std::array::from_fn(range);
    // The monotony of the coefficients is shown for free bodies only, and a free body has no effects of a position.
    if [0, 2].iter().any(|place| ranges[*place].0 < ranges[*place].1) { Err(ProofError::TiedBody) } else { Ok(ranges) }
}

/// Coefficients affine in one number: the place of each coefficient, and `true` if the coefficient falls while the number grows.
type Together = &'static [(usize, bool)];

/// Returns the varying coefficients, grouped by their common number. If damping over mass stays, both effects of a force form one group. If the damping stays,
/// each effect of a velocity forms a group with the effect of a force in the same row.
fn together(ranges: &[(f64, f64); 6], bodies: &[Body]) -> Vec<Together> {
    let varies = |place: usize| ranges[place].0 < ranges[place].1;
    let groups: &[Together] = if !varies(1) && !varies(3) {
        &[&[(4, false), (5, false)]]
    } else if keep_their_damping(bodies) {
        &[&[(1, false), (4, true)], &[(3, false), (5, true)]]
    } else {
        &[&[(1, false)], &[(3, false)], &[(4, false)], &[(5, false)]]
    };
    groups.iter().copied().filter(|places| places.iter().any(|(place, _)| varies(*place))).collect()
}

/// Returns whether all bodies are free and have the same damping but for roundings.
fn keep_their_damping(bodies: &[Body]) -> bool {
    let of = |body: &Body| {
        let [e00, e01, e10, e11, g0, g1] = coefficients(&body.only_map()?);
        // From e₁₁ + b·g₁ = 0 and e₀₁ + b·g₀ = h of the module head.
        let damping = -e11 / g1;
        (e00 == 0.0 && e10 == 0.0 && damping > 0.0).then_some((damping, e01 + damping * g0))
    };
    let is_near = |one: f64, other: f64| (one - other).abs() <= 8.0 * f64::EPSILON * other;
    let Some(found) = bodies.iter().map(of).collect::<Option<Vec<_>>>() else { return false };
    found.iter().all(|(damping, span)| is_near(*damping, found[0].0) && is_near(*span, found[0].1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper_scene::PAPER;
    use cohaptic_stability::frames::NominalNetwork;
    use cohaptic_stability::frames::{Contacts, Structure};

    /// A mass that varies beside a constant damping makes two numbers, and the steps of every mass between the ends are where these numbers say, within the
    /// radius.
    #[test]
    fn a_mass_beside_a_damping_that_stays_is_two_numbers() {
        let at = |mass: f64, damping: f64| {
            let overrides = [format!("object.mass={mass:?}"), format!("object.damping={damping:?}")];
            let scene = cohaptic_scene::Scene::parse(PAPER, "paper.toml".as_ref(), &overrides).unwrap();
            let contacts = Contacts { touching: vec![true; 3], at_wall: false, absent: vec![false; 3] };
            let structure = Structure::of(&[&scene], &NominalNetwork::of(&scene).unwrap(), &contacts).unwrap();
            (structure.nodes(&scene), structure)
        };
        let weights = || Matrix::from_fn(1, 1, |_, _| -0.5);
        let point = |nodes: &[Node]| Point { nodes: nodes.to_vec(), weights: weights() };
        let of_copy = |nodes: &[Node]| coefficients(&nodes[0].object.only_map().unwrap());
        let ([low, high], structure) = ([at(0.3, 20.0).0, at(0.6, 20.0).0], at(0.3, 20.0).1);
        let common = Common { timetable: structure.apart[0].as_ref().unwrap(), plans: &Plans::default(), tied: true, time: 0.01 };
        let span = steps(&[point(&low)], &[low.clone(), high.clone()], common).unwrap();
        assert!(span.kinds.iter().all(|step| step.slopes.len() == 2));
        for mass in [0.3, 0.35, 0.45, 0.6] {
            let inside = at(mass, 20.0).0;
            // `steps_of_each` takes the units of the first point, which are the units of the box.
            let exact = steps_of_each(&[point(&low), point(&inside)], common).unwrap().swap_remove(1);
            let [first, last, here] = [&low, &high, &inside].map(|nodes| of_copy(nodes));
            let shares = [1, 3].map(|place| (2.0 * here[place] - first[place] - last[place]) / (first[place] - last[place]).abs());
            for (step, exact) in span.kinds.iter().zip(&exact) {
                for (i, j) in (0..step.mean.rows()).flat_map(|i| (0..step.mean.columns()).map(move |j| (i, j))) {
                    let near = step.slopes.iter().zip(shares).map(|(slope, share)| share * slope[(i, j)]).sum::<f64>() + step.mean[(i, j)];
                    assert!((exact.matrix[(i, j)] - near).abs() <= step.radius[(i, j)] + 1e-13, "{mass} kg, {i} {j}");
                }
            }
        }
        // If the damping varies too, each coefficient is a number of its own.
        let both = steps(&[point(&low)], &[low.clone(), at(0.6, 21.0).0], common).unwrap();
        assert!(both.kinds.iter().all(|step| step.slopes.len() == 4));
    }
}
