//! An interval that contains the spectral radius of a matrix that is known only to within a perturbation.
//!
//! A number z is an eigenvalue of T + E only if |E|·|(z − T)⁻¹| ≥ 1 (Stewart & Sun 1990, Section IV.1; Trefethen & Embree 2005, Theorem 2.1). With the
//! bound B(d) of the resolvent that [`Triangle::resolvent_below`] compares for distances d from the eigenvalues, for every E with |E|₂ ≤ ε
//!
//! ```text
//! high: no eigenvalue has |z| ≥ R          if ε·B(R − |λ_k|) < 1,            R > max |λ_k|
//! low:  one is within s of λ_i at least    if ε·B(||λ_k − λ_i| − s|) < 1
//! ```
//!
//! because eigenvalues are continuous in E and cannot cross a circle on which ε·B < 1. To first order R − |λ| and s are ε/|yᴴx|, with the classical condition
//! number (Golub & Van Loan 2013, Section 7.2.2). But the bounds hold beyond the first order: a defective eigenvalue gets its ε^(1/m) without a special case.

use super::triangle::Triangle;

/// An interval that contains the spectral radius.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interval {
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Interval {
    pub(super) fn and(self, other: Self) -> Self {
        Self { low: self.low.max(other.low), high: self.high.min(other.high) }
    }

    pub(super) fn width(self) -> f64 {
        self.high - self.low
    }
}

/// Factor between a distance that is tried and the next: the resulting distance is at most this factor above the best one.
const STEP: f64 = 1.4;
/// The largest number of factors [`STEP`] between the smallest distance and the largest.
const STEPS: u32 = 400;

/// Levels of clusters in the order of trial. A level joins eigenvalues that are within 10^(level − 15) times the radius; level 16 joins all eigenvalues.
/// Single eigenvalues are mostly a bad description because of defective eigenvalues at zero, which come from samples under way: a chain of j spreads over
/// ε^(1/j). The order begins with levels that suit such chains, because the search stops at the first good description.
const LEVELS: [i32; 17] = [13, 12, 14, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0, 15, 16];

/// Buffers of the enclosure, to be used again.
#[derive(Clone, Debug, Default)]
pub(super) struct Enclosure {
    /// Places of the eigenvalues on the diagonal, by falling modulus.
    order: Vec<usize>,
    moduli: Vec<f64>,
    distances: Vec<f64>,
}

impl Enclosure {
    /// Returns the interval for |E|₂ ≤ `epsilon`. If single eigenvalues give too wide an interval, the spectrum is divided into clusters. The matrix must have
    /// at least one row.
    pub(super) fn enclose(&mut self, triangle: &mut Triangle, epsilon: f64) -> Interval {
        triangle.amplify();
        let interval = self.around(triangle, epsilon);
        let top = self.order[0];
        let first = epsilon * triangle.amplification[triangle.block_of(top)];
        // `first` is the bound of a well-conditioned eigenvalue. A bound above the radius itself says nothing: eigenvalues that are equal but for rounding have
        // such a bound, and clusters may improve it.
        let enough = if first <= self.moduli[top] { 6.0 * first } else { 0.0 };
        if interval.width() <= enough {
            return interval;
        }
        self.clusters(triangle, epsilon, interval, enough)
    }

    /// Returns the intersection of `interval` with the intervals of clustered spectra. Every clustering gives bounds that hold; the search ends once the
    /// interval is at most `enough` wide.
    fn clusters(&mut self, triangle: &Triangle, epsilon: f64, mut interval: Interval, enough: f64) -> Interval {
        let size = triangle.size();
        let scale = self.moduli[self.order[0]].max(epsilon);
        let mut tried = vec![size];
        for level in LEVELS {
            // The last level puts all eigenvalues into one cluster.
            let reach = if level == 16 { f64::INFINITY } else { scale * libm::exp10(f64::from(level - 15)) };
            let mut labels = single_linkage(triangle, reach);
            // The clusters of different levels are nested, so that equal numbers of clusters mean equal clusters.
            let count = labels.iter().enumerate().filter(|(place, label)| place == *label).count();
            if tried.contains(&count) {
                continue;
            }
            tried.push(count);
            let mut clustered = triangle.clone();
            clustered.gather(&mut labels);
            clustered.amplify();
            interval = interval.and(self.around(&mut clustered, epsilon));
            if interval.width() <= enough {
                break;
            }
        }
        interval
    }

    /// Returns the interval that the present division into blocks gives.
    fn around(&mut self, triangle: &mut Triangle, epsilon: f64) -> Interval {
        let size = triangle.size();
        self.moduli.clear();
        self.moduli.extend((0..size).map(|place| triangle.eigenvalue(place).norm_sqr().sqrt()));
        self.order.clear();
        self.order.extend(0..size);
        let Self { order, moduli, distances } = self;
        order.sort_by(|a, b| moduli[*b].total_cmp(&moduli[*a]).then(a.cmp(b)));
        let top = moduli[order[0]];
        if triangle.amplification.iter().any(|amplification| amplification.is_infinite()) {
            return Interval { low: 0.0, high: f64::INFINITY };
        }
        let smallest = epsilon.max(top * f64::EPSILON).max(f64::MIN_POSITIVE);
        let begin = |triangle: &Triangle, place: usize| {
            let first = 1.1 * epsilon * triangle.amplification[triangle.block_of(place)];
            if first.is_finite() { first.max(smallest) } else { smallest }
        };
        let reach = begin(triangle, order[0]);
        let mut holds = |steps: u32| {
            let reach = reach * libm::pow(STEP, f64::from(steps));
            // Eigenvalues of a real matrix come in conjugate pairs, so that z in the upper half-plane is enough: from there, an eigenvalue below the real axis
            // is at least the size of its imaginary part away.
            distances.clear();
            distances.extend((0..size).map(|place| (top + reach - moduli[place]).max(-triangle.eigenvalue(place).im)));
            triangle.resolvent_below(distances, 1.0 / epsilon).then_some(top + reach)
        };
        // The bound falls with the distance: doubling finds a step that holds, bisection then the first such step.
        let mut high = holds(0).unwrap_or(f64::INFINITY);
        if high.is_infinite() {
            let (mut fails, mut last) = (0, 1);
            while last < STEPS && high.is_infinite() {
                match holds(last) {
                    Some(found) => high = found,
                    None => (fails, last) = (last, 2 * last),
                }
            }
            while high.is_finite() && last > fails + 1 {
                let middle = fails.midpoint(last);
                match holds(middle) {
                    Some(found) => (high, last) = (found, middle),
                    None => fails = middle,
                }
            }
        }
        let mut low = 0.0;
        // No point of a circle inside is farther from λ_k than |λ_k| + top. If the bound does not hold even at these distances, no circle is tried.
        distances.clear();
        distances.extend(moduli.iter().map(|modulus| modulus + top));
        if !triangle.resolvent_below(distances, 1.0 / epsilon) {
            return Interval { low, high };
        }
        for centre in order.iter() {
            let middle = triangle.eigenvalue(*centre);
            let mut reach = begin(triangle, *centre);
            while moduli[*centre] - reach > low {
                distances.clear();
                distances.extend((0..size).map(|place| ((triangle.eigenvalue(place) - middle).norm_sqr().sqrt() - reach).abs()));
                if triangle.resolvent_below(distances, 1.0 / epsilon) {
                    low = moduli[*centre] - reach;
                    break;
                }
                reach *= STEP;
            }
        }
        Interval { low, high }
    }
}

/// Returns a label for each eigenvalue: the least place of an eigenvalue that a chain of steps of at most `reach` leads to.
fn single_linkage(triangle: &Triangle, reach: f64) -> Vec<usize> {
    let size = triangle.size();
    let mut labels: Vec<usize> = (0..size).collect();
    for later in 0..size {
        for earlier in 0..later {
            if labels[later] != labels[earlier] && (triangle.eigenvalue(later) - triangle.eigenvalue(earlier)).norm() <= reach {
                let (keep, replace) = (labels[later].min(labels[earlier]), labels[later].max(labels[earlier]));
                for label in &mut labels {
                    if *label == replace {
                        *label = keep;
                    }
                }
            }
        }
    }
    labels
}
