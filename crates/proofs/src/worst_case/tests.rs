//! Tests against known joint spectral radii, and of every bound against every cycle.

use cohaptic_stability::Matrix;
use cohaptic_tests_common::properties;
use proptest::prelude::*;

use super::automaton::Automaton;
use super::gripenberg::{Effort, WorstCase};
use super::pattern::{Edge, Pattern};
use super::verified::Certificate;

fn of(rows: &[&[f64]]) -> Matrix {
    Matrix::from_fn(rows.len(), rows.len(), |i, j| rows[i][j])
}

fn scalar(value: f64) -> Matrix {
    of(&[&[value]])
}

fn fine(accuracy: f64) -> Effort {
    Effort { accuracy, products: 100_000 }
}

/// The bounds enclose the known radius and are as close as promised, and the certificate is above the radius.
fn check(automaton: &Automaton, radius: f64, accuracy: f64) -> WorstCase {
    let bounds = automaton.worst_case(&fine(accuracy));
    assert!(bounds.complete && bounds.upper - bounds.lower <= accuracy, "{bounds:?}");
    // The radius is itself a rounded number, to twelve digits where it was published.
    let rounding = 1e-12 * radius;
    assert!(bounds.lower <= radius + rounding && bounds.upper >= radius - rounding, "{radius} is not in {bounds:?}");
    let certificate = Certificate::find(automaton, 1e-6).unwrap();
    assert!(certificate.rate() >= radius - rounding && certificate.rate() >= bounds.lower, "{} {radius}", certificate.rate());
    bounds
}

/// Gripenberg's branch and bound on this pair is a published check value.
#[test]
fn a_published_pair_comes_out() {
    let pair = Automaton::free(vec![of(&[&[-1.0, -1.0], &[-4.0, 0.0]]), of(&[&[3.0, 3.0], &[-2.0, 1.0]])]).unwrap();
    let bounds = check(&pair, 3.917_384_715_148, 1e-3);
    assert!((bounds.lower - 3.917_384_715_148).abs() < 1e-8, "{bounds:?}");
}

/// Automata whose joint spectral radius is known on paper.
#[test]
fn radii_known_on_paper_come_out() {
    // One matrix: its spectral radius, here √6 and far from its norm, and a Jordan block, whose powers grow without being exponential.
    check(&Automaton::free(vec![of(&[&[0.0, 60.0], &[0.1, 0.0]])]).unwrap(), 6.0_f64.sqrt(), 1e-6);
    check(&Automaton::free(vec![of(&[&[1.0, 1.0], &[0.0, 1.0]])]).unwrap(), 1.0, 1e-3);
    // Rotations, scaled: the largest scale, in one step.
    let turn = |angle: f64, scale: f64| {
        let (s, c) = (scale * libm::sin(angle), scale * libm::cos(angle));
        of(&[&[c, -s], &[s, c]])
    };
    let bounds = check(&Automaton::free(vec![turn(1.0, 0.7), turn(0.3, 0.9), turn(2.0, 0.8)]).unwrap(), 0.9, 1e-4);
    assert_eq!(bounds.cycle, [1]);
    // Commuting matrices: the largest radius of one of them.
    let base = of(&[&[0.2, 0.5, 0.0], &[0.1, 0.3, 0.2], &[0.0, 0.4, 0.1]]);
    let squared = base.times(&base);
    let other = Matrix::from_fn(3, 3, |i, j| squared[(i, j)] - 0.5 * base[(i, j)] + if i == j { 0.3 } else { 0.0 });
    let alone = |matrix: &Matrix| Automaton::free(vec![matrix.clone()]).unwrap().worst_case(&fine(1e-9)).lower;
    check(&Automaton::free(vec![base.clone(), other.clone()]).unwrap(), alone(&base).max(alone(&other)), 1e-3);
    // The two shears: neither grows alone, in turn they do by the golden ratio.
    let shears = Automaton::free(vec![of(&[&[1.0, 1.0], &[0.0, 1.0]]), of(&[&[1.0, 0.0], &[1.0, 1.0]])]).unwrap();
    let bounds = check(&shears, (1.0 + 5.0_f64.sqrt()) / 2.0, 1e-6);
    assert_eq!(bounds.cycle.len(), 2);
}

#[test]
fn nilpotent_pairs_and_patterns_that_end_do_not_grow() {
    let strictly_upper = |a, b, c| of(&[&[0.0, a, b], &[0.0, 0.0, c], &[0.0, 0.0, 0.0]]);
    let pair = Automaton::free(vec![strictly_upper(1.0, 2.0, 3.0), strictly_upper(-4.0, 0.5, 1.0)]).unwrap();
    let bounds = check(&pair, 0.0, 1e-4);
    assert!(bounds.cycle.is_empty() && bounds.lower <= 0.0);
    // No infinite path: 0 → 1 and nothing after it.
    let ends = Automaton::of(2, vec![Edge { from: 0, to: 1, symbol: 0 }], vec![scalar(7.0)]).unwrap();
    let bounds = check(&ends, 0.0, 1e-12);
    assert_eq!(bounds.products, 0);
    check(&Automaton::free(vec![Matrix::zeros(2, 2)]).unwrap(), 0.0, 1e-12);
}

/// An edge that lies on no cycle is taken at most once, however large its matrix.
#[test]
fn what_happens_once_does_not_matter() {
    let edge = |from, to, symbol| Edge { from, to, symbol };
    let automaton =
        Automaton::of(3, vec![edge(0, 1, 1), edge(1, 1, 0), edge(0, 0, 2), edge(1, 2, 1)], vec![scalar(0.5), scalar(1e9), scalar(0.25)]).unwrap();
    assert_eq!(check(&automaton, 0.5, 1e-9).cycle, [0]);
}

/// With a for a packet that comes and b for one that is lost, the fastest pattern is k losses and one arrival for some k up to the longest run; and
/// arrivals alone are the pattern with k = 0.
#[test]
fn runs_of_loss_of_a_scalar_follow_the_formula() {
    for (a, b, most) in [(0.5, 1.5, 3_i32), (0.5, 1.1, 1), (-0.9, 1.2, 4), (0.1, -1.5, 7), (0.9, 0.5, 3)] {
        let known = (0..=most).map(|k| (f64::abs(a) * f64::abs(b).powi(k)).powf(1.0 / f64::from(k + 1))).fold(0.0, f64::max);
        let automaton = Automaton::runs(vec![scalar(a), scalar(b)], 1, most.unsigned_abs()).unwrap();
        let bounds = check(&automaton, known * (1.0 + 1e-15), 1e-6);
        let losses = bounds.cycle.iter().filter(|symbol| **symbol == 1).count();
        assert_eq!(losses, if f64::abs(b) > 1.0 { most.unsigned_abs() as usize } else { 0 }, "{bounds:?}");
    }
}

/// Lost with probability 0.2, x is halved or multiplied by 1.5: E[x²] shrinks by 0.65 in every frame, and yet three losses and one arrival, repeated,
/// make x grow. Both are true of one loop.
#[test]
fn a_loop_can_be_stable_in_the_mean_square_and_unstable_in_the_worst_case() {
    let (received, lost, chance) = (0.5, 1.5, 0.2);
    assert!((1.0 - chance) * received * received + chance * lost * lost < 0.66);
    let bounds = Automaton::runs(vec![scalar(received), scalar(lost)], 1, 3).unwrap().worst_case(&Effort::default());
    assert!(bounds.lower > 1.13, "{bounds:?}");
    let mut cycle = bounds.cycle;
    cycle.sort_unstable();
    assert_eq!(cycle, [0, 1, 1, 1]);
    // With at most one loss in a row it is stable in the worst case too: √(0.5·1.5) = 0.87.
    assert!(Automaton::runs(vec![scalar(received), scalar(lost)], 1, 1).unwrap().worst_case(&Effort::default()).upper < 0.87);
}

/// Two links that each lose at most one or two in a row. The state is halved by two arrivals and grows by 1.2 per lost packet.
#[test]
fn links_side_by_side_lose_together() {
    let links = [Pattern::runs(2, 1, 1).unwrap(), Pattern::runs(2, 1, 2).unwrap()];
    let matrices = [0.5, 0.9, 0.8, 1.44].map(scalar).to_vec();
    let automaton = Automaton::product(&links, matrices).unwrap();
    // By brute force over all cycles, of which none without a repeated node has more than six steps.
    let known = longest_cycles(&automaton, 6);
    check(&automaton, known, 1e-6);
}

/// A change of units, which scales each state differently, hardly changes the bounds.
#[test]
fn units_do_not_matter() {
    let a = of(&[&[0.5, 0.4, 0.1], &[-0.3, 0.6, 0.2], &[0.1, -0.2, 0.4]]);
    let b = of(&[&[0.4, -0.6, 0.0], &[0.5, 0.3, -0.3], &[0.2, 0.1, 0.7]]);
    let plain = Automaton::free(vec![a.clone(), b.clone()]).unwrap().worst_case(&fine(1e-4));
    let units = [1e-7, 1.0, 3e6];
    let other = |m: &Matrix| Matrix::from_fn(3, 3, |i, j| m[(i, j)] * units[i] / units[j]);
    let scaled = Automaton::free(vec![other(&a), other(&b)]).unwrap().worst_case(&fine(1e-4));
    assert!(plain.complete, "{plain:?}");
    assert!(scaled.lower <= plain.upper && plain.lower <= scaled.upper && scaled.upper - scaled.lower < 1e-2, "{plain:?} {scaled:?}");
    // Sizes of 10^±200 neither overflow nor vanish.
    for size in [1e-200, 1e200] {
        let bounds = Automaton::free(vec![a.scaled(size), b.scaled(size)]).unwrap().worst_case(&fine(1e-3 * size));
        assert!(bounds.complete && (bounds.lower / size - plain.lower).abs() < 2e-3, "{bounds:?}");
    }
}

#[test]
fn an_exhausted_budget_leaves_valid_bounds() {
    let pair = || Automaton::free(vec![of(&[&[-1.0, -1.0], &[-4.0, 0.0]]), of(&[&[3.0, 3.0], &[-2.0, 1.0]])]).unwrap();
    let mut last = f64::INFINITY;
    for products in [0, 1, 10, 100, 1000] {
        let bounds = pair().worst_case(&Effort { accuracy: 0.0, products });
        assert!(!bounds.complete && bounds.products <= products + 2);
        assert!(bounds.lower <= 3.917_384_715_149 && bounds.upper >= 3.917_384_715_147 && bounds.upper <= last, "{bounds:?}");
        last = bounds.upper;
        assert_eq!(bounds, pair().worst_case(&Effort { accuracy: 0.0, products }));
    }
    assert!(last < 4.1);
}

/// The largest growth per step of a cycle of at most so many steps, from powers of its product; an independent reference up to rounding and 1e-9.
fn longest_cycles(automaton: &Automaton, longest: usize) -> f64 {
    fn radius(product: &Matrix) -> f64 {
        // Gelfand's formula with k = 2^40, the product kept near 1.
        let (mut power, mut logarithm, mut share) = (product.clone(), 0.0, 1.0);
        for _ in 0..40 {
            let norm = power.frobenius_norm();
            if norm < 1e-280 {
                return 0.0;
            }
            logarithm += share * norm.ln();
            power = power.scaled(1.0 / norm);
            power = power.times(&power);
            share /= 2.0;
        }
        logarithm.exp()
    }
    fn follow(automaton: &Automaton, root: usize, node: usize, product: &Matrix, length: i32, longest: i32, best: &mut f64) {
        if length > 0 && node == root {
            *best = best.max(radius(product).powf(1.0 / f64::from(length)));
        }
        if length < longest {
            for edge in automaton.pattern().edges().iter().filter(|edge| edge.from == node) {
                follow(automaton, root, edge.to, &automaton.matrices()[edge.symbol].times(product), length + 1, longest, best);
            }
        }
    }
    let mut best = 0.0;
    for root in 0..automaton.pattern().nodes() {
        follow(automaton, root, root, &Matrix::identity(automaton.size()), 0, i32::try_from(longest).unwrap(), &mut best);
    }
    best
}

properties! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// No cycle of up to ten steps grows faster than the upper bound or the certificate allows, and the cycle that is said to attain the lower bound is
    /// a path of the automaton that does.
    #[test]
    fn every_cycle_is_below_the_upper_bounds(
        nodes in 1_usize..3,
        edges in prop::collection::vec((0_usize..3, 0_usize..3, 0_usize..2), 1..5),
        entries in prop::collection::vec(-1.0_f64..1.0, 8),
    ) {
        let edges: Vec<Edge> = edges.iter().map(|(from, to, symbol)| Edge { from: from % nodes, to: to % nodes, symbol: *symbol }).collect();
        // Two edges from a node leave a thousand paths of ten steps to follow.
        let edges: Vec<Edge> = (0..nodes).flat_map(|node| edges.iter().filter(move |edge| edge.from == node).take(2)).copied().collect();
        let matrices = entries.chunks(4).map(|entries| Matrix::from_fn(2, 2, |i, j| entries[2 * i + j])).collect();
        let automaton = Automaton::of(nodes, edges, matrices).unwrap();
        let bounds = automaton.worst_case(&Effort { accuracy: 1e-3, products: 2_000 });
        let certificate = Certificate::find(&automaton, 1e-4).unwrap();
        prop_assert!(bounds.lower <= bounds.upper && bounds.lower <= certificate.rate());
        let longest = longest_cycles(&automaton, 10);
        // Gelfand's formula itself is rounded.
        let (upper, tolerance) = (bounds.upper.min(certificate.rate()), 1e-7);
        prop_assert!(longest <= upper + tolerance, "{} {:?}", longest, bounds);
        if bounds.cycle.len() <= 10 {
            prop_assert!(bounds.lower <= longest + tolerance, "{} {:?}", longest, bounds);
        }
        if bounds.complete {
            prop_assert!(bounds.upper - bounds.lower <= 1e-3);
        }
    }
}
