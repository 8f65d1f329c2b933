use cohaptic_tests_common::properties;
use num_complex::Complex64;
use proptest::prelude::*;

use super::*;
use crate::{Matrix, Unwatched, Verdict, bounded_radius, eigenvalues};

fn scalar(now: f64, terms: &[(Kernel, f64)]) -> DelayedLoop {
    let one = |entry| Matrix::from_fn(1, 1, |_, _| entry);
    DelayedLoop::new(one(now), terms.iter().map(|(kernel, entry)| (*kernel, one(*entry))).collect()).unwrap()
}

/// Returns the explicit matrix of a loop. Its states are the newest x and all older x that the kernels use.
fn companion(looped: &DelayedLoop) -> Matrix {
    let size = looped.now.rows();
    let depth = looped.terms.iter().map(|term| term.kernel.steps()).max().unwrap_or(0) as usize;
    let mut whole = Matrix::zeros(size * (depth + 1), size * (depth + 1));
    for row in 0..size {
        for column in 0..size {
            whole[(row, column)] = looped.now[(row, column)];
            for term in &looped.terms {
                let last = term.kernel.steps() as usize;
                let first = if matches!(term.kernel, Kernel::Delay(_)) { last } else { 1 };
                for step in first..=last {
                    whole[(row, step * size + column)] += term.matrix[(row, column)];
                }
            }
        }
    }
    for place in 0..size * depth {
        whole[(place + size, place)] = 1.0;
    }
    whole
}

#[test]
fn kernels_are_what_they_stand_for() {
    for z in [Complex64::new(1.0, 0.0), Complex64::new(1.0 + 1e-9, 1e-10), Complex64::new(0.6, 0.8), Complex64::new(-1.01, 0.1)] {
        for steps in [0, 1, 2, 7, 100] {
            let powers: Vec<Complex64> = (1..=steps).map(|step| z.powi(-step)).collect();
            let sum: Complex64 = powers.iter().sum();
            let slope: Complex64 = (1..=steps).map(|step| z.powi(-step - 1) * f64::from(-step)).sum();
            let count = u32::try_from(steps).unwrap();
            assert!((Kernel::Sum(count).jet(z).value - sum).norm() < 1e-12 * (1.0 + sum.norm()));
            assert!((Kernel::Sum(count).jet(z).slope - slope).norm() < 1e-12 * (1.0 + slope.norm()));
            assert!((Kernel::Delay(count).jet(z).value - z.powi(-steps)).norm() < 1e-12);
            assert!((Kernel::Delay(count).jet(z).slope - z.powi(-steps - 1) * f64::from(-steps)).norm() < 1e-10);
        }
    }
    // At z = 1 the sum is the count, to the bit.
    assert_eq!(Kernel::Sum(10_000).jet(Complex64::from(1.0)).value, Complex64::from(10_000.0));
}

#[test]
fn matrices_that_do_not_fit_are_refused() {
    let shape = DelayedLoop::new(Matrix::identity(2), vec![(Kernel::Delay(1), Matrix::zeros(2, 3))]);
    assert_eq!(shape, Err(DelayedLoopError::Shape { rows: 2, columns: 3, size: 2 }));
    assert!(DelayedLoop::new(Matrix::default(), vec![]).is_err());
    assert_eq!(DelayedLoop::new(Matrix::identity(1).scaled(f64::NAN), vec![]), Err(DelayedLoopError::NotFinite));
    assert_eq!(scalar(0.5, &[]).count(f64::NAN, 0.0, &Unwatched), None);
    assert_eq!(scalar(0.5, &[]).count(0.0, 0.0, &Unwatched), None);
}

#[test]
fn roots_of_unity_are_counted_on_both_sides() {
    // z − c·z^−(D−1): z^D = c.
    for delay in [1, 2, 5, 60, 1000, 5000] {
        for root in [1.0 - 1e-10, 1.0 + 1e-10] {
            let looped = scalar(0.0, &[(Kernel::Delay(delay - 1), libm::pow(root, f64::from(delay)))]);
            assert_eq!(looped.count(1.0, 0.0, &Unwatched), Some(if root > 1.0 { delay as usize } else { 0 }), "{delay} {root}");
            let found = looped.bounded_radius(0.0);
            assert!((found.value - root).abs() <= found.error && found.error < 2e-11, "{found:?} for {delay} and {root}");
            assert_eq!(found.verdict(), if root > 1.0 { Verdict::Unstable } else { Verdict::Stable });
        }
    }
}

#[test]
fn a_root_on_the_circle_is_not_counted_on_either_side() {
    assert_eq!(scalar(1.0, &[]).count(1.0, 0.0, &Unwatched), None);
    assert_eq!(scalar(0.5, &[(Kernel::Delay(3), 0.5)]).count(1.0, 0.0, &Unwatched), None);
}

#[test]
fn double_roots_get_the_error_that_they_have() {
    // z − 1 + z^−1/4 = (z − 1/2)²/z, and a Jordan block without delay.
    for looped in [
        scalar(1.0, &[(Kernel::Delay(1), -0.25)]),
        DelayedLoop::new(
            Matrix::from_fn(2, 2, |row, column| {
                if row == column {
                    0.5
                } else if column == 1 {
                    1.0
                } else {
                    0.0
                }
            }),
            vec![],
        )
        .unwrap(),
    ] {
        let found = looped.bounded_radius(0.0);
        assert!((found.value - 0.5).abs() <= found.error && found.error < 1e-6, "{found:?}");
        assert_eq!(looped.count(0.4999, 0.0, &Unwatched), Some(2));
        // A perturbation of ε moves a double root by √ε.
        let wider = looped.bounded_radius(1e-8);
        assert!(wider.error > 0.9e-4 && wider.error < 2e-3, "{wider:?}");
    }
}

#[test]
fn nothing_outside_is_said_where_nothing_is_left() {
    let found = DelayedLoop::new(Matrix::zeros(2, 2), vec![]).unwrap().bounded_radius(0.0);
    assert!(found.value - found.error <= 0.0 && found.value < 1e-12, "{found:?}");
}

/// Roots of z − a − b·z^−D, found by Newton's method with 50 digits from many points around z = 1 (mpmath 1.3).
const OUTERMOST: [(f64, f64, u32, f64); 6] = [
    (0.75, 0.5, 1000, 1.000690626854833),
    (0.75, -0.5, 1000, 1.000_690_568_585_693),
    (0.5, 0.375, 5000, 0.999_942_488_245_399),
    (0.9375, -0.125, 5000, 1.000_138_187_896_088_8),
    (1.0, -0.000_488_281_25, 1000, 0.999_191_024_818_776_6),
    (1.0, -0.000_976_562_5, 5000, 1.000_165_437_423_912_8),
];

#[test]
fn long_delays_have_the_radius_of_a_reference_with_fifty_digits() {
    for (now, delayed, delay, radius) in OUTERMOST {
        let found = scalar(now, &[(Kernel::Delay(delay), delayed)]).bounded_radius(0.0);
        assert!((found.value - radius).abs() <= found.error && found.error < 1e-11, "{found:?} instead of {radius}");
    }
}

#[test]
fn ten_thousand_steps_are_no_more_than_many() {
    // (z − 1/2)(z − 1/4) closed through a delay with gain g on 1/((z − 1/2)(z − 1/4)), which is at most 8/3 on the circle: stable below 3/8.
    let now = Matrix::from_fn(2, 2, |row, column| [[0.5, 1.0], [0.0, 0.25]][row][column]);
    for (gain, verdict) in [(0.374, Verdict::Stable), (-0.374, Verdict::Stable), (0.376, Verdict::Unstable), (-0.376, Verdict::Unstable)] {
        let back = Matrix::from_fn(2, 2, |row, column| if (row, column) == (1, 0) { gain } else { 0.0 });
        let looped = DelayedLoop::new(now.clone(), vec![(Kernel::Delay(10_000), back)]).unwrap();
        assert_eq!(looped.bounded_radius(0.0).verdict(), verdict, "{gain}");
    }
}

properties! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn the_explicit_matrix_agrees(
        size in 1..=4_usize, delay in 0..=60_u32, sum in 0..=8_u32, gain in 0.01..0.6_f64, numbers in prop::collection::vec(-1.0..1.0_f64, 48),
    ) {
        let part = |start: usize, factor: f64| Matrix::from_fn(size, size, |row, column| factor * numbers[start + row * size + column]);
        let terms = vec![(Kernel::Delay(delay), part(16, gain)), (Kernel::Sum(sum), part(32, 0.1 * gain))];
        let looped = DelayedLoop::new(part(0, 0.6), terms).unwrap();
        let whole = companion(&looped);
        let all = eigenvalues(&whole);
        for radius in [0.9, 1.0, 1.05] {
            let outside = all.iter().filter(|value| value.norm() > radius).count();
            if all.iter().all(|value| (value.norm() - radius).abs() > 1e-7) {
                prop_assert_eq!(looped.count(radius, 0.0, &Unwatched), Some(outside));
            }
        }
        let found = looped.bounded_radius(0.0);
        let explicit = bounded_radius(&whole, 0.0);
        prop_assert!((found.value - explicit.value).abs() <= found.error + explicit.error, "{found:?} {explicit:?}");
        prop_assert!(found.error < 1e-6 || found.value < 0.5, "{found:?} {explicit:?}");
        // The interval for a perturbation contains the radius of a perturbed loop.
        let moved = DelayedLoop::new(looped.now.scaled(1.0 + 1e-5), looped.terms.iter().map(|term| (term.kernel, term.matrix.scaled(1.0 - 1e-5))).collect());
        let other = moved.unwrap().bounded_radius(0.0);
        let wide = looped.bounded_radius(1e-5 * 3.0);
        prop_assert!((other.value - wide.value).abs() <= other.error + wide.error, "{other:?} {wide:?}");
    }
}
