//! Correlation of monotone functions of correlated Gaussian numbers: ρ(φ) = Σ c(k)²·φᵏ/Σ c(k)².
//!
//! c(k) are the coefficients of g(z) = F⁻¹(Φ(z)) in orthonormal Hermite polynomials, because two standard normals of correlation φ have E[he_j(X)·he_k(Y)] =
//! φᵏ if j = k and 0 otherwise (Mehler 1866). Smooth laws need some dozens of coefficients. A kink of g makes c(k)² fall like k^(−5/2), and a jump like
//! k^(−3/2). The sum of the squares after the last coefficient is known, because all squares add up to the variance; the remainder is spread over the higher
//! orders by that power.

use alloc::vec;
use alloc::vec::Vec;

use super::special::{normal, quadrature};

/// Decay of the squares of the coefficients of a rough function.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Roughness {
    /// Decay like k^(−5/2).
    Kinks,
    /// Decay like k^(−3/2).
    Jumps,
}

/// Series of the squares of the coefficients of orders 1, 2, …, divided by their infinite sum.
#[derive(Clone, Debug)]
pub(super) struct Series {
    /// Squares, indexed by order minus 1.
    squares: Vec<f64>,
    /// Sums of the squares of all higher odd orders, and of all higher even orders.
    rest: [f64; 2],
    roughness: Roughness,
}

/// Ends of the integrals. At −13 the normal density is 10⁻³⁷; at 20 its product with the square of the Pareto law's g is 10⁻²⁹.
const ENDS: (f64, f64) = (-13.0, 20.0);
/// Width of the widest panel. The polynomial of order 256 has a wave length of 0.4.
const PANEL: f64 = 0.125;
const ORDERS: usize = 256;

impl Series {
    /// Returns the series of g, with mean 0 and variance 1, smooth except for kinks at `breaks`, in ascending order.
    pub(super) fn of_function(g: impl Fn(f64) -> f64, breaks: impl Iterator<Item = f64>) -> Self {
        let mut coefficients = vec![0.0; ORDERS];
        let recurrence = Recurrence::new(ORDERS);
        let mut low = ENDS.0;
        for end in breaks.chain([ENDS.1]) {
            // A break outside of the ends is moved to the nearer end, without an additional range.
            let end = end.clamp(low, ENDS.1);
            while low < end {
                let high = if end - low > PANEL { low + PANEL } else { end };
                quadrature::panel(low, high, |z, weight| {
                    let weight = weight * normal::density(z) * g(z);
                    recurrence.each(z, |order, value| coefficients[order] += weight * value);
                });
                low = high;
            }
        }
        Self::new(coefficients.iter().skip(1).map(|c| c * c).collect(), Roughness::Kinks)
    }

    /// Returns the series of max(z, cut), divided by its standard deviation. The second derivative of g is a pulse at the cut, so c(k) = φ(cut)·he(k −
    /// 2)/√(k·(k − 1)).
    pub(super) fn of_cut_normal(cut: f64, sd: f64) -> Self {
        let orders = 4096;
        let mut squares = vec![0.0; orders];
        let first = normal::below(-cut) / sd;
        squares[0] = first * first;
        let mut k = 1.0;
        Recurrence::new(orders - 1).each(cut, |order, value| {
            k += 1.0;
            let c = normal::density(cut) * value / (sd * libm::sqrt(k * (k - 1.0)));
            squares[order + 1] = c * c;
        });
        Self::new(squares, Roughness::Kinks)
    }

    /// Returns the series of a step function with variance 1 and `jumps` (z, height): c(k) = Σ height·φ(z)·he(k − 1)/√k.
    pub(super) fn of_jumps(jumps: &[(f64, f64)]) -> Self {
        // A function with few jumps has large jumps and needs many orders. The number of operations stays bounded.
        let orders = (4_000_000 / jumps.len().max(1)).clamp(ORDERS, 16_384);
        let mut sums = vec![0.0; orders];
        let recurrence = Recurrence::new(orders);
        for &(z, height) in jumps {
            let weight = height * normal::density(z);
            recurrence.each(z, |order, value| sums[order] += weight * value);
        }
        let mut k = 0.0;
        let square = |sum: &f64| {
            k += 1.0;
            sum * sum / k
        };
        Self::new(sums.iter().map(square).collect(), Roughness::Jumps)
    }

    /// Returns the series with the given squares, after computing the remainder.
    fn new(squares: Vec<f64>, roughness: Roughness) -> Self {
        let rest = (1.0 - squares.iter().sum::<f64>()).max(0.0);
        // The remainder is divided into odd and even orders in the same ratio as the last half of the squares.
        let last_half = squares[squares.len() / 2..].chunks_exact(2).fold([0.0, 0.0], |[a, b], pair| [a + pair[0], b + pair[1]]);
        let [first, second] = last_half.map(|part| if part == 0.0 { 0.0 } else { part / (last_half[0] + last_half[1]) });
        // Order 1 has index 0, so an even index is an odd order.
        let odd_first = (squares.len() / 2).is_multiple_of(2);
        let rest = if odd_first { [rest * first, rest * second] } else { [rest * second, rest * first] };
        Self { squares, rest, roughness }
    }

    /// Returns ρ(φ).
    pub(super) fn at(&self, phi: f64) -> f64 {
        let (mut sum, mut power, mut order) = (0.0, 1.0, 0.5);
        for square in &self.squares {
            power *= phi;
            order += 1.0;
            sum += square * power;
            // All squares add up to 1, so the remaining orders add at most 10⁻¹⁸.
            if power.abs() < 1e-18 {
                return sum;
            }
        }
        let left = share_left(-order * libm::log(phi.abs()), self.roughness);
        let [odd, even] = self.rest;
        // Odd powers of a negative φ are negative.
        sum + left * (even + libm::copysign(odd, phi))
    }
}

/// Returns ∫ k^(−s)·e^(−ck) over k > 1, divided by the same integral without the exponential.
fn share_left(c: f64, roughness: Roughness) -> f64 {
    // √c·Γ(½, c), by `erfc`. Both integrals follow by parts.
    let root = libm::sqrt(core::f64::consts::PI * c) * libm::erfc(libm::sqrt(c));
    match roughness {
        Roughness::Jumps => libm::exp(-c) - root,
        Roughness::Kinks => libm::exp(-c) - 2.0 * c * (libm::exp(-c) - root),
    }
}

/// Recurrence of the orthonormal Hermite polynomials: he(k + 1) = (z·he(k) − √k·he(k − 1))/√(k + 1), he(0) = 1.
struct Recurrence {
    /// Square roots of 1, 2, 3, ….
    roots: Vec<f64>,
}

impl Recurrence {
    /// Returns the recurrence for the orders below `orders`.
    fn new(orders: usize) -> Self {
        let mut k = 0.0;
        let root = |()| {
            k += 1.0;
            libm::sqrt(k)
        };
        Self { roots: vec![(); orders].into_iter().map(root).collect() }
    }

    /// Calls `at` with each order from zero and the polynomial's value at z.
    fn each(&self, z: f64, mut at: impl FnMut(usize, f64)) {
        let (mut before, mut value, mut root_before) = (0.0, 1.0, 0.0);
        for (order, root) in self.roots.iter().enumerate() {
            at(order, value);
            (before, value) = (value, (z * value - root_before * before) / root);
            root_before = *root;
        }
    }
}
