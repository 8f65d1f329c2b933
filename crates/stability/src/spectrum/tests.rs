use cohaptic_tests_common::properties;
use num_complex::Complex64;
use proptest::prelude::*;

use super::*;
use crate::Verdict;

fn matrix(size: usize, entries: &[f64]) -> Matrix {
    Matrix::from_fn(size, size, |row, column| entries[row * size + column])
}

/// A generator of numbers in ±1 (xorshift), the same on every run.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        f64::from(u32::try_from(self.0 >> 32).unwrap()) / f64::from(u32::MAX) * 2.0 - 1.0
    }

    fn whole(&mut self, limit: f64) -> f64 {
        (self.next() * limit).round()
    }

    fn matrix(&mut self, size: usize) -> Matrix {
        Matrix::from_fn(size, size, |_, _| self.next())
    }

    /// L·J·L⁻¹ for the given triangle J and a random unit lower triangular L of whole numbers, whose inverse is whole too: exact in integers.
    fn similar(&mut self, inner: &Matrix) -> Matrix {
        let size = inner.rows();
        let lower = Matrix::from_fn(size, size, |row, column| {
            if row == column {
                1.0
            } else if row > column {
                self.whole(1.0)
            } else {
                0.0
            }
        });
        let mut inverse = Matrix::identity(size);
        for row in 0..size {
            for column in 0..row {
                let entry = -(column..row).map(|inner| lower[(row, inner)] * inverse[(inner, column)]).sum::<f64>();
                inverse[(row, column)] = entry;
            }
        }
        assert_eq!(lower.times(&inverse), Matrix::identity(size));
        lower.times(inner).times(&inverse)
    }

    /// A matrix of the 2-norm `size` at most: one of Frobenius norm `size`.
    fn perturbation(&mut self, rows: usize, size: f64) -> Matrix {
        let any = self.matrix(rows);
        any.scaled(size * (1.0 - 1e-9) / any.frobenius_norm())
    }
}

fn sum(a: &Matrix, b: &Matrix) -> Matrix {
    Matrix::from_fn(a.rows(), a.columns(), |row, column| a[(row, column)] + b[(row, column)])
}

fn assert_contains(found: Radius, truth: f64) {
    assert!((found.value - truth).abs() <= found.error, "{truth} is outside {found:?}");
}

#[test]
fn companion_matrices_have_the_roots_of_their_polynomials() {
    // (x − 1)(x − 2)(x − 3)(x − 4) and (x² + 1)(x² − 2x + 2).
    let first = matrix(4, &[10.0, -35.0, 50.0, -24.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    for (value, root) in eigenvalues(&first).iter().zip([4.0, 3.0, 2.0, 1.0]) {
        assert!((value - root).norm() < 1e-12, "{value}");
    }
    assert_contains(bounded_radius(&first, 0.0), 4.0);
    let second = matrix(4, &[2.0, -3.0, 2.0, -2.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    let roots = [Complex64::new(1.0, 1.0), Complex64::new(1.0, -1.0), Complex64::new(0.0, 1.0), Complex64::new(0.0, -1.0)];
    for root in roots {
        assert!(eigenvalues(&second).iter().any(|value| (value - root).norm() < 1e-13));
    }
    assert_contains(bounded_radius(&second, 0.0), 2f64.sqrt());
}

#[test]
fn matrices_without_a_radius_say_so() {
    assert!(radius(&matrix(2, &[1.0, f64::NAN, 0.0, 1.0])).is_nan() && radius(&matrix(1, &[f64::INFINITY])).is_infinite());
    assert!(eigenvalues(&matrix(1, &[f64::NAN])).is_empty() && eigenvalues(&Matrix::default()).is_empty());
    assert!(bounded_radius(&matrix(1, &[f64::INFINITY]), 0.0).error.is_infinite());
    assert_eq!(bounded_radius(&matrix(1, &[f64::INFINITY]), 0.0).verdict(), Verdict::Overflow);
    assert!(bounded_radius(&matrix(1, &[0.5]), f64::NAN).error.is_infinite());
    assert_eq!(bounded_radius(&Matrix::default(), 0.0), Radius { value: 0.0, error: 0.0 });
    let mut large = Matrix::identity(70);
    large[(3, 5)] = f64::NAN;
    assert!(radius(&large).is_nan());
}

#[test]
fn very_large_and_very_small_entries_do_not_overflow() {
    let turn = [0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.5];
    for scale in [1e-250, 1e-100, 1e100, 1e250] {
        let found = radius(&matrix(3, &turn).scaled(scale));
        assert!((found / scale - 1.0).abs() < 1e-14, "{found}");
        assert!((eigenvalues(&matrix(3, &turn).scaled(scale))[0].im.abs() / scale - 1.0).abs() < 1e-14);
    }
}

#[test]
fn nilpotent_chains_are_zero_within_their_bound() {
    for size in 1..=16 {
        let chain = Matrix::from_fn(size, size, |row, column| if column == row + 1 { 1.0 } else { 0.0 });
        assert_contains(bounded_radius(&chain, 0.0), 0.0);
        // With ε in the corner the eigenvalues are the roots of z^n = ε.
        let mut bent = chain.clone();
        bent[(size - 1, 0)] += 1e-13;
        let truth = libm::pow(1e-13, 1.0 / real(size));
        assert_contains(bounded_radius(&chain, 1e-13), truth);
        assert_contains(bounded_radius(&bent, 0.0), truth);
        // A defective chain at zero does not widen the interval of an eigenvalue near 1.
        let mut beside = Matrix::from_fn(size + 1, size + 1, |row, column| if column == row + 1 && row > 0 { 1.0 } else { 0.0 });
        beside[(0, 0)] = 1.0 - 1e-10;
        let found = bounded_radius(&beside, 1e-13);
        assert_eq!(found.verdict(), Verdict::Stable, "{found:?} with a chain of {size}");
    }
}

#[test]
fn eigenvalues_close_to_one_fall_on_the_right_side() {
    let mut numbers = Numbers(7);
    for (offset, verdict) in [(1e-10, Verdict::Unstable), (-1e-10, Verdict::Stable), (0.0, Verdict::Marginal)] {
        for _ in 0..50 {
            let inner = Matrix::from_fn(5, 5, |row, column| {
                if row == column {
                    [1.0 + offset, 0.75, 0.5, -0.25, 0.0][row]
                } else if column > row {
                    numbers.whole(1.0)
                } else {
                    0.0
                }
            });
            let found = bounded_radius(&numbers.similar(&inner), 0.0);
            assert_eq!(found.verdict(), verdict, "{found:?}");
        }
    }
}

#[test]
fn jordan_blocks_stay_inside_their_bound_when_they_split() {
    // λ on the diagonal of m rows and ε in the corner: (z − λ)^m = ε exactly, whatever whole similarity transform is around it.
    let mut numbers = Numbers(99);
    for size in 2..=6 {
        for epsilon in [0.0, 1e-14, 1e-10, 1e-6] {
            let jordan = Matrix::from_fn(size, size, |row, column| {
                if row == column {
                    0.75
                } else if column == row + 1 {
                    1.0
                } else {
                    0.0
                }
            });
            let mut bent = jordan.clone();
            bent[(size - 1, 0)] = epsilon;
            let truth = 0.75 + libm::pow(epsilon, 1.0 / real(size));
            let found = bounded_radius(&jordan, epsilon);
            assert_contains(found, truth);
            // The interval must not be much wider than needed: within a factor of the m-th root of this perturbation and rounding.
            let scale = libm::pow(epsilon + 1e-14, 1.0 / real(size));
            assert!(found.error < 6.0 * scale, "{found:?} for a block of {size} and {epsilon}");
            assert_contains(bounded_radius(&numbers.similar(&jordan), 0.0), 0.75);
        }
    }
}

#[test]
fn perturbed_matrices_stay_inside_the_bound() {
    let mut numbers = Numbers(2024);
    for case in 0..600 {
        let size = 2 + case % 9;
        // Every third spectrum has repeated eigenvalues.
        let inner = Matrix::from_fn(size, size, |row, column| {
            let place = if case % 3 == 0 { row / 3 } else { row };
            if row == column {
                1.0 - 0.125 * real(place)
            } else if column > row {
                numbers.whole(1.0)
            } else {
                0.0
            }
        });
        let known = numbers.similar(&inner);
        let epsilon = libm::exp10(-3.0 - 9.0 * numbers.next().abs());
        let found = bounded_radius(&known, epsilon);
        assert_contains(found, 1.0);
        for _ in 0..3 {
            let other = bounded_radius(&sum(&known, &numbers.perturbation(size, epsilon)), 0.0);
            // The interval of the other matrix is far narrower, and both intervals contain its true radius.
            assert!((other.value - found.value).abs() <= found.error + other.error, "{other:?} of {found:?}");
        }
    }
}

#[test]
fn badly_scaled_matrices_are_balanced() {
    // Powers of two, so that the scaling itself is exact: eigenvalues 3, 1, −1 in coordinates from 2^-30 to 2^30.
    let plain = matrix(3, &[1.0, 2.0, 0.0, 2.0, 1.0, 0.0, 1.0, 1.0, 1.0]);
    let scale = [power_of_two(-30), 1.0, power_of_two(30)];
    let found = bounded_radius(&Matrix::from_fn(3, 3, |row, column| plain[(row, column)] * scale[row] / scale[column]), 0.0);
    assert_contains(found, 3.0);
    assert!(found.error < 1e-12, "{found:?}");
}

/// Arrays are reduced column by column and matrices row by row, with the same bits.
#[test]
fn an_array_and_a_matrix_are_reduced_to_the_same_bits() {
    let mut numbers = Numbers(31);
    for _ in 0..100 {
        let mut matrix = numbers.matrix(9);
        let mut array: [[f64; 9]; 9] = std::array::from_fn(|row| std::array::from_fn(|column| matrix[(row, column)]));
        hessenberg::reduce(&mut array);
        hessenberg::reduce(&mut matrix);
        let bits = |entries: &[f64]| entries.iter().map(|entry| entry.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(array.as_flattened()), bits(matrix.entries()));
    }
}

#[test]
fn sizes_on_both_sides_of_every_limit_agree_with_each_other() {
    // A rotation block of modulus 1.25 and a smaller diagonal, mixed by a whole transform; the same for all sizes.
    let mut numbers = Numbers(5);
    for size in [2, 15, 16, 17, 40, 90, 250] {
        let mixed = Matrix::from_fn(size, size, |row, column| match (row, column) {
            (0, 0) | (1, 1) => 0.75,
            (0, 1) => 1.0,
            (1, 0) => -1.0,
            _ if row == column => 0.5 * numbers.next(),
            _ if column > row => 0.1 * numbers.next(),
            _ => 0.0,
        });
        let shuffled = Matrix::from_fn(size, size, |row, column| mixed[((row * 7 + 3) % size, (column * 7 + 3) % size)]);
        let found = bounded_radius(&shuffled, 0.0);
        assert_contains(found, 1.25);
        assert!(found.error < 1e-6 && (radius(&shuffled) - 1.25).abs() < 1e-9 && eigenvalues(&shuffled).len() == size);
    }
}

/// Pairs each eigenvalue with the nearest unpaired one of the other list, and returns the largest distance of a pair.
fn distance(ours: &[Complex64], mut theirs: Vec<Complex64>) -> f64 {
    ours.iter().fold(0.0, |largest, value| {
        let nearest = (0..theirs.len()).min_by(|a, b| (theirs[*a] - value).norm().total_cmp(&(theirs[*b] - value).norm())).unwrap();
        f64::max(largest, (theirs.swap_remove(nearest) - value).norm())
    })
}

properties! {
    #![proptest_config(ProptestConfig::with_cases(3000))]

    #[test]
    fn real_reflections_agree_with_complex_rotations(size in 1..=20_usize, seed in 1..u64::MAX, sparse in 0..4_u32) {
        let mut numbers = Numbers(seed);
        let any = Matrix::from_fn(size, size, |_, _| if numbers.next() < 0.5 * f64::from(sparse) - 1.0 { 0.0 } else { numbers.next() });
        let ours = eigenvalues(&any);
        // The reference comes from another method, which has no step in common with the first.
        let mut other = Schur::default();
        other.load(size, (0, 0), |row, column| any[(row, column)]);
        prop_assert!(other.triangularise());
        let theirs: Vec<Complex64> = (0..size).map(|place| other.at(place, place)).collect();
        // Sparse matrices may be defective, which costs digits (up to the root of the multiplicity); the bound of the radius covers that loss.
        let bound = bounded_radius(&any, 0.0);
        let radius_of_theirs = theirs.iter().fold(0.0, |largest: f64, value| largest.max(value.norm()));
        prop_assert!((bound.value - radius_of_theirs).abs() <= 2.0 * bound.error, "{bound:?} {radius_of_theirs}");
        prop_assert!((bound.value - radius(&any)).abs() <= 2.0 * bound.error, "{bound:?} {}", radius(&any));
        if sparse == 0 {
            prop_assert!(distance(&ours, theirs) < 1e-6);
        }
    }
}

/// 10^200·[[2, 1], [1, 2]] has the eigenvalues 10^200 and 3·10^200, and diag(10^300, 10^300) twice 10^300: squares of these are no numbers.
#[test]
fn matrices_whose_squares_overflow_have_their_radius() {
    let found = bounded_radius(&matrix(2, &[2e200, 1e200, 1e200, 2e200]), 1e180);
    assert!((found.value / 3e200 - 1.0).abs() < 1e-14 && found.error < 1e187, "{found:?}");
    assert_eq!(found.verdict(), Verdict::Unstable);
    let found = bounded_radius(&matrix(2, &[1e300, 0.0, 0.0, -1e300]), 0.0);
    assert!((found.value / 1e300 - 1.0).abs() < 1e-14 && found.verdict() == Verdict::Unstable, "{found:?}");
    // The norm overflows; the radius is still known to be above 1.
    assert_eq!(bounded_radius(&Matrix::from_fn(100, 100, |_, _| 1e307), 0.0).verdict(), Verdict::Unstable);
}
