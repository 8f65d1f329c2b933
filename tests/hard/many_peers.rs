//! The mean of the samples held from 255 and from 10,000 other peers, against a sum without rounding.
//!
//! From [`EXACT_FROM`] samples on [`Held::refresh`] promises the nearest number to the mean. Of fewer it promises an error of n·mean of at most (n/4 + 2)·u·Σ|x|: of four partial sums each has n/4 − 1 additions, two more join them, and the
//! division rounds once. (That no terms of higher order are needed is a result of Jeannerod & Rump, *Improved error bounds for inner products in floating-point
//! arithmetic*, 2013, for sums in any order.) Here data meets it that is made to be summed badly.

use cohaptic_harness::{Model, NoObserver, Simulation};
use cohaptic_peer::{EXACT_FROM, Held, State};
use cohaptic_tests::Draft;
use cohaptic_tests_common::{properties, same_cases};
use cohaptic_units::Instant;

use crate::hard::ROUNDING;
use crate::hard::exact_sum::ExactSum;

/// How many others there are: the most whose mean is a sum in a fixed order, and many.
const FEW: usize = EXACT_FROM - 1;
const MANY: usize = 10_000;

fn at(value: f64) -> State<1> {
    State { position: [value], velocity: [-value] }
}

/// The mean of these positions, the error of n times it, and the bound.
fn mean_of(values: &[f64]) -> (f64, f64, f64) {
    let held = Held::new(values.iter().copied().map(at));
    let mean = held.mean().position[0];
    // Rounding knows no sign.
    assert_eq!(held.mean().velocity[0], -mean);
    let mut error = ExactSum::of(values.iter().copied());
    let n = values.len() as f64;
    error.subtract_product(mean, n);
    // Half of the last digit of the mean, n times.
    let nearest = ROUNDING * (n * mean).abs() * (1.0 + 4.0 * ROUNDING);
    let sizes = ExactSum::of(values.iter().map(|value| value.abs())).size();
    (mean, error.size(), if values.len() < EXACT_FROM { (n / 4.0 + 2.0) * ROUNDING * sizes } else { nearest })
}

fn within_the_bound(values: &[f64]) {
    let (mean, error, bound) = mean_of(values);
    assert!(error <= bound, "n·{mean:e} is off by {error:e}, more than {bound:e}");
}

#[test]
fn large_values_that_alternate_hide_small_ones_within_the_bound() {
    for spacing in [1, 2, 4, 8, 3] {
        let value = |place: usize| match (place / spacing) % 4 {
            0 => 1e16,
            2 => -1e16,
            _ => 1.0,
        };
        for others in [FEW, MANY] {
            within_the_bound(&(0..others).map(value).collect::<Vec<_>>());
        }
    }
}

#[test]
fn a_sum_that_cancels_to_nothing_is_within_the_bound() {
    // Each value and its negative, far apart and in another partial sum; then rows that grow and fall.
    for others in [FEW, MANY] {
        let half = (0..others / 2).map(|place| libm::sin(place as f64) * libm::exp2((place % 97) as f64));
        let values: Vec<f64> = half.clone().chain(half.rev().map(|value| -value)).collect();
        within_the_bound(&values);
        within_the_bound(
            &(0..others).map(|place| libm::exp2(place as f64 / 10.0 - 500.0) * if place % 2 == 0 { 1.0 } else { -1.0 }).collect::<Vec<_>>(),
        );
    }
}

/// The bound is no more than it must be: four ones, and then nothing but halves of the last digit of one, each of which is lost (a tie goes to the even
/// neighbour). So (n − 4)·u of the bound of (n/4 + 2)·u·(4 + (n − 4)·u) is reached, up to 4u of the division: all but 16 parts of n + 8.
#[test]
fn the_bound_is_reached() {
    let values: Vec<f64> = (0..FEW).map(|place| if place < 4 { 1.0 } else { ROUNDING }).collect();
    let (mean, error, bound) = mean_of(&values);
    let lost = (FEW - 4) as f64 * ROUNDING;
    // The division rounds too, by at most u times the sum of 4.
    assert!((error - lost).abs() <= 4.0 * ROUNDING, "{mean} {error:e}");
    let n = FEW as f64;
    assert!(error / bound >= (n - 8.0) / (n + 8.0) - 1e-9 && error <= bound, "{}", error / bound);
}

/// One sum would lose all but one of them, (n − 1)·u, four times the bound; of four sums one loses a quarter.
#[test]
fn one_large_value_costs_one_of_four_sums() {
    let values: Vec<f64> = (0..FEW).map(|place| if place == 0 { 1.0 } else { ROUNDING }).collect();
    within_the_bound(&values);
}

properties! {
    #![proptest_config(same_cases(200, 0x6d65_616e))]

    /// Values of any size: 600 orders of magnitude, so far from both ends that no sum overflows and no mean underflows.
    #[test]
    fn any_values_are_within_the_bound(seeds in proptest::collection::vec((-1.0..1.0_f64, -990..990_i32), 64), step in 1..63_usize) {
        let value = |place: usize| {
            let ((mantissa, _), (_, exponent)) = (seeds[place % 64], seeds[(place * step) % 64]);
            libm::ldexp(mantissa, exponent)
        };
        within_the_bound(&(0..FEW).map(value).collect::<Vec<_>>());
        within_the_bound(&(0..MANY).map(value).collect::<Vec<_>>());
    }
}

/// The mean depends on who said what, not on the order in which it arrived: places are summed in their order.
#[test]
fn the_order_of_arrival_changes_no_bit() {
    let value = |place: usize| libm::sin(place as f64 * 1.7) * libm::exp2((place % 40) as f64);
    let expected = *Held::new((0..MANY).map(|place| at(value(place)))).mean();
    // 7919 and 10,000 have no common factor: every place once, in quite another order; and backwards.
    for order in [|turn: usize| turn * 7919 % MANY, |turn: usize| MANY - 1 - turn] {
        let mut held = Held::new((0..MANY).map(|_| State::<1>::REST));
        for turn in 0..MANY {
            // An older sample that comes later changes nothing.
            assert!(held.accept(order(turn), 1, Instant::ZERO, at(value(order(turn)))));
            assert!(!held.accept(order(turn), 0, Instant::ZERO, at(1e300)));
        }
        held.refresh();
        assert_eq!(held.mean().position[0].to_bits(), expected.position[0].to_bits());
        assert_eq!(held.mean().velocity[0].to_bits(), expected.velocity[0].to_bits());
    }
}
/// Copies at rest in one place, in a scene without damping, for a minute.
///
/// Where the number of others is a power of two every sum of equal numbers and its division are exact, so no force ever acts. Elsewhere the mean of n equal numbers
/// x may be off by (n/4 + 2)·u·|x|, the same for all copies and always to the same side, and everything moves off together: K times that is a force, g1 = h/m
/// makes K·g1 times that of it a velocity each tick, and k ticks of it h·k²/2 times that a way (and each tick rounds the position once).
#[test]
fn copies_at_rest_in_one_place_stay_there_as_far_as_their_mean_is_exact() {
    let (ticks, place, h) = (60_000, 1000.1, 1e-3);
    for peers in [2, 3, 4, 5, 8, 9, 12] {
        let mut draft = Draft { duration: ticks, ..Draft::calm(peers) };
        draft.position[0] = place;
        let Ok(summary) = Simulation::new(&draft.scene(), Model::Least).run(&mut NoObserver);
        let (others, mass) = (peers - 1, draft.mass / peers as f64);
        let step = if others.is_power_of_two() { 0.0 } else { draft.gains.stiffness * h / mass * (others as f64 / 4.0 + 2.0) * ROUNDING * place };
        let k = ticks as f64;
        // While it moves, the mean of the velocities is off too, by as small a part of them: far less than a thousandth of the first.
        let (speed, way) = (1.001 * k * step, 1.001 * h * k * k / 2.0 * step + if step > 0.0 { k * ROUNDING * place } else { 0.0 });
        for peer in &summary.peers {
            let (moved, v) = ((peer.position[0] - place).abs(), peer.velocity[0].abs());
            assert!(moved <= way && v <= speed, "{peers} peers: {moved:e} m of {way:e}, {v:e} m/s of {speed:e}");
        }
    }
}
