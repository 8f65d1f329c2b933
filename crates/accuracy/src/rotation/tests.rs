//! The closed form against a series with 100 bits, and the methods against their orders and their conserved quantities.

use qd::Quad;

use super::*;
use crate::Unwatched;

/// Components of the orientation, then of the angular velocity.
type Numbers = [Quad; 7];

/// Makes one step by Taylor's series of ω̇ = γ(ω), q̇ = ½·q·(0, ω), coefficient by coefficient. In a span of 10 ms the terms fall by a factor of 20 or more,
/// because no singularity is nearer than π/2 over λ = 6.6/s.
fn taylor(start: &Numbers, gyration: &[Quad; 3], span: Quad) -> Numbers {
    const ORDER: usize = 26;
    let mut terms = vec![*start];
    for n in 0..ORDER {
        let sum = |a: usize, b: usize| (0..=n).fold(Quad::ZERO, |sum, k| sum + terms[k][a] * terms[n - k][b]);
        #[expect(clippy::cast_precision_loss, reason = "a small number")]
        let over = Quad::ONE / Quad::from_f64((n + 1) as f64);
        let half = over * Quad::from_f64(0.5);
        terms.push([
            -half * (sum(1, 4) + sum(2, 5) + sum(3, 6)),
            half * (sum(0, 4) + sum(2, 6) - sum(3, 5)),
            half * (sum(0, 5) + sum(3, 4) - sum(1, 6)),
            half * (sum(0, 6) + sum(1, 5) - sum(2, 4)),
            over * gyration[0] * sum(5, 6),
            over * gyration[1] * sum(6, 4),
            over * gyration[2] * sum(4, 5),
        ]);
    }
    from_fn(|place| terms.iter().rev().fold(Quad::ZERO, |sum, term| sum * span + term[place]))
}

/// The tolerances are roundings of the closed form. u = λ·t + ε up to 132 has an error of some 10⁻¹⁴, which is 2·10⁻¹⁵ s of a motion at 12 rad/s. φ up to 240
/// rad has an error of some 10⁻¹⁴ relative to 100 rad.
#[test]
fn the_closed_form_is_the_series_with_100_bits() {
    let j = INERTIA.map(Quad::from_f64);
    let gyration = [(j[1] - j[2]) / j[0], (j[2] - j[0]) / j[1], (j[0] - j[1]) / j[2]];
    let mut numbers: Numbers = from_fn(|place| Quad::from_f64(if place < 4 { START.orientation[place] } else { RATE[place - 4] }));
    let span = Quad::ONE / Quad::from_f64(100.0);
    for right in FreeTop::new(INERTIA, RATE).attitudes(0.01, SECONDS * 100) {
        numbers = taylor(&numbers, &gyration, span);
        let found: [f64; 7] = from_fn(|place| numbers[place].0);
        let apart = right.angle_to(&from_fn(|place| found[place]));
        assert!(apart < 5e-13, "{apart:e}");
        for axis in 0..3 {
            assert!((right.rate[axis] - found[4 + axis]).abs() < 2e-12, "{:e}", right.rate[axis] - found[4 + axis]);
        }
    }
}

#[test]
fn each_method_has_its_order() {
    let reference = reference();
    for (method, order, micros) in [
        (Method::Exponential, 4.0, 4000),
        (Method::RungeKutta, 4.0, 4000),
        (Method::Split, 2.0, 4000),
        (Method::Midpoint, 2.0, 4000),
        (Method::Held, 1.0, 20),
        (Method::Euler, 1.0, 20),
    ] {
        // Within a second of motion, a method of first order still counts the flips correctly.
        let error = |micros: u64| errors(&reference[..250], method, Duration::from_micros(micros))[0];
        let found = libm::log2(error(micros) / error(micros / 2));
        assert!((found - order).abs() < 0.1, "{method:?} has order {found}");
    }
}

/// Each of 20000 steps has some ten roundings of at most 2⁻⁵³.
#[test]
fn split_and_midpoint_keep_what_they_promise() {
    let reference = reference();
    let tick = Duration::from_millis(1);
    let rounding = 20_000.0 * 10.0 * 0.5 * f64::EPSILON;
    let [_, energy, momentum] = errors(&reference, Method::Midpoint, tick);
    assert!(energy < rounding && momentum < rounding, "{energy:e} {momentum:e}");
    let [_, energy, momentum] = errors(&reference, Method::Split, tick);
    assert!(energy > 1e-8 && momentum < rounding, "{energy:e} {momentum:e}");
}

#[test]
fn every_method_has_rows_with_an_error() {
    let rows = rows(Options { quick: true }, &Unwatched).unwrap();
    assert_eq!(rows.len(), Method::ALL.len() * 3 * ERRORS.len());
    assert!(rows.iter().all(|row| row.cost.is_some_and(|cost| cost > 0.0) && row.error.is_some_and(|error| error >= 0.0)));
}
