//! Where the spectral radius of a matrix can be, if the matrix is only known to within a perturbation.
//!
//! A number z is an eigenvalue of T + E only if |E|·|(z − T)⁻¹| ≥ 1 (Stewart & Sun 1990, Section IV.1; Trefethen & Embree 2005, Theorem 2.1). With the
//! bound B(d) of the resolvent that [`Triangle::resolvent_below`] compares for distances d from the eigenvalues, for every E with |E|₂ ≤ ε
//!
//! ```text
//! high: no eigenvalue has |z| ≥ R          if ε·B(R − |λ_k|) < 1,            R > max |λ_k|
//! low:  one is within s of λ_i at least    if ε·B(||λ_k − λ_i| − s|) < 1
//! ```
//!
//! because eigenvalues are continuous in E and cannot cross a circle on which ε·B < 1. To first order R − |λ| and s are ε/|yᴴx|, the classical condition
//! number (Golub & Van Loan 2013, Section 7.2.2), but nothing here is only true to first order: a defective eigenvalue's ε^(1/m) comes out by itself.

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

/// Growth from one radius that is tried to the next: the result is at most this factor from the best.
const STEP: f64 = 1.4;
/// From the smallest distances to the largest.
const STEPS: u32 = 400;

/// Powers of ten, less 15, within which eigenvalues are taken together, in the order in which they are tried. What most often makes single eigenvalues a
/// bad description are defective ones at zero, of the samples on their way: a chain of j spreads over ε^(1/j). Beginning there, stopping at the first good
/// description, and sizes of entries computed once took eight different peers with 127 states from 131 to 26 ms.
const LEVELS: [i32; 17] = [13, 12, 14, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0, 15, 16];

/// Room to work in.
#[derive(Clone, Debug, Default)]
pub(super) struct Enclosure {
    /// The eigenvalues' places by falling modulus.
    order: Vec<usize>,
    moduli: Vec<f64>,
    distances: Vec<f64>,
}

impl Enclosure {
    /// The interval for |E|₂ ≤ `epsilon`, refined by dividing the spectrum into clusters where single eigenvalues do not tell.
    pub(super) fn enclose(&mut self, triangle: &mut Triangle, epsilon: f64) -> Interval {
        triangle.amplify();
        let interval = self.around(triangle, epsilon);
        let top = self.order[0];
        let first = epsilon * triangle.amplification[triangle.block_of(top)];
        // What a well-conditioned eigenvalue comes to. A bound beyond the radius itself says nothing: eigenvalues that are equal but for rounding have one, which
        // clusters may better.
        let enough = if first <= self.moduli[top] { 6.0 * first } else { 0.0 };
        if interval.width() <= enough {
            return interval;
        }
        self.clusters(triangle, epsilon, interval, enough)
    }

    /// Single eigenvalues are a bad description: tries clusters. Each gives a bound that holds; the best counts, and one that is good enough is the last.
    fn clusters(&mut self, triangle: &Triangle, epsilon: f64, mut interval: Interval, enough: f64) -> Interval {
        let size = triangle.size();
        let scale = self.moduli[self.order[0]].max(epsilon);
        let mut tried = vec![size];
        for level in LEVELS {
            // The last level takes everything.
            let reach = if level == 16 { f64::INFINITY } else { scale * libm::exp10(f64::from(level - 15)) };
            let mut labels = single_linkage(triangle, reach);
            // Of nested clusters as many are the same.
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

    /// The interval from one division into blocks.
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
            // A real matrix's eigenvalues come in conjugate pairs, so that the upper half-plane is enough: there, an eigenvalue below the axis is at
            // least its imaginary part away.
            distances.clear();
            distances.extend((0..size).map(|place| (top + reach - moduli[place]).max(-triangle.eigenvalue(place).im)));
            triangle.resolvent_below(distances, 1.0 / epsilon).then_some(top + reach)
        };
        // The farther, the surer: the first step that holds by halving.
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
        // No circle inside is farther from λ_k than |λ_k| + top: where that is not far enough for all, none is tried.
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

/// For each eigenvalue the first one that a chain of steps of at most `reach` leads to.
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
