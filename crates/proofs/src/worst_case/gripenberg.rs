//! Bounds of the joint spectral radius by branch and bound (Gripenberg 1996), along the paths of an automaton.
//!
//! *From below.* A path that ends where it began may be repeated for ever: the joint spectral radius ρ is at least the spectral radius of its product, to the
//! power of one over its length.
//!
//! *From above.* Give every node v a norm |·|_v, and a product along a path from v to w the norm it has from |·|_v to |·|_w. Along paths that join, norms
//! multiply or do better, and this is all that is needed. Let every node have a finite tree of paths, complete in that every path from the node either
//! ends within the tree or runs through one of its leaves; let a path p have σ(p) = the least ‖A_q‖^(1/|q|) over its prefixes q that are not empty, p
//! among them; and let U be the largest σ of a leaf. Then ρ <= U: cut an infinite path where a prefix q of its leaf attains σ, which gives
//! ‖A_q‖ <= U^|q|; go on in the same way in the tree of the node where q ended. The cuts come at distances that the depth of the trees bounds, and so the
//! product of the first N steps has norm <= C·U^N, with C for the piece after the last cut. The same family of norms is used in all trees: where one path's
//! piece ends, the next begins in the norm in which the first was measured. Any family will do; this one is |x|_v = √(xᵀP_v x) with the shapes that a
//! quadratic certificate has ([`Certificate::find`]), in which single steps already grow little.
//!
//! A leaf with σ <= lower + accuracy is never looked at again. The leaf with the largest σ is branched next: as long as it is there, U is no smaller. Whether
//! another order would raise the lower bound sooner, and so have fewer leaves to branch, nobody knows beforehand.
//!
//! *Rounding.* Products are computed in coordinates in which the norms are 2-norms: X = R_to A Z for a shape P = RᵀR and a computed Z near R⁻¹. With
//! G = I − RZ, the exact R_to A R⁻¹ is (R_to A Z)(I − G)⁻¹, within ‖R_to A Z‖·g/(1 − g) of R_to A Z for ‖G‖₂ <= g < 1, and X is within γ₍₂ₙ₎|R_to||A||Z| of that,
//! entry by entry. From there errors are carried along with every product ([`Approximate`]). Any invertible R may be used, whatever its origin: it need not
//! factorise a shape exactly.

use std::cmp::Ordering;
use std::collections::{BTreeSet, BinaryHeap};

use cohaptic_stability::numerics::{cholesky, gamma, outward, real, triangle_inverse};
use cohaptic_stability::{Matrix, Watch};

use super::automaton::Automaton;
use super::growth::{Approximate, radius_below};
use super::norm::{Norms, Sharpness, frobenius_norm, norm_above};
use super::pattern::Edge;
use super::verified::Certificate;
use crate::worst_case::root::root_above;

/// How long to search.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Effort {
    /// The distance of the bounds at which the search ends; the joint spectral radius of frames is of the order of 1.
    pub accuracy: f64,
    /// The largest number of products looked at. Each edge is looked at even if this is less. Each takes some tens of bytes to the end, beside the
    /// matrices that are kept for later, which take up to 256 MiB.
    pub products: u64,
}

impl Default for Effort {
    /// 10⁻³, and 100 000 products.
    fn default() -> Self {
        Self { accuracy: 1e-3, products: 100_000 }
    }
}

/// Bounds of the joint spectral radius, and the pattern that attains the lower one.
///
/// The joint spectral radius is zero where no infinite path exists.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct WorstCase {
    /// The joint spectral radius is at least this.
    pub(crate) lower: f64,
    /// The joint spectral radius is at most this; infinite if numbers overflowed.
    pub(crate) upper: f64,
    /// The matrices whose product, in this order of time and repeated for ever, grows by the lower bound per step; empty if that is zero.
    pub(crate) cycle: Vec<usize>,
    /// How many products were looked at.
    pub(crate) products: u64,
    /// Whether the bounds are as close as was asked for.
    pub(crate) complete: bool,
    /// The quadratic certificate in whose norms the search began; `None` if numbers overflowed.
    pub(crate) certificate: Option<Certificate>,
}

impl Automaton {
    #[cfg(test)]
    /// Bounds of the joint spectral radius: how fast a state can grow per step along allowed sequences of any length.
    ///
    /// The bounds hold whatever the effort; they differ by at most its accuracy if [`WorstCase::complete`].
    #[must_use]
    pub(crate) fn worst_case(&self, effort: &Effort) -> WorstCase {
        self.worst_case_watched(effort, &cohaptic_stability::Unwatched).expect("without a watch nothing ends it")
    }

    /// [`Automaton::worst_case`], watched: it is asked before each product, and in each round of the search for a certificate; `None` if the watch ends it.
    #[must_use]
    pub(crate) fn worst_case_watched(&self, effort: &Effort, watch: &dyn Watch) -> Option<WorstCase> {
        watch.expects(real_of(effort.products) * self.product_operations());
        let exponent = self.exponent();
        let scaled = self.scaled(exponent);
        let accuracy = libm::ldexp(effort.accuracy, exponent);
        // Branching makes up for what the shapes are not.
        let certificate = Certificate::find_watched(self, accuracy.clamp(1e-6, 1e-2), watch)?.ok();
        let mut search = Search::new(&scaled, certificate.as_ref(), accuracy, watch)?;
        search.run(effort.products, watch)?;
        let lower = libm::ldexp(search.lower, -exponent);
        let upper = libm::ldexp(search.upper(), -exponent);
        // Whatever is of the order of underflow says nothing.
        let lower = if lower > f64::MIN_POSITIVE { lower } else { 0.0 };
        let cycle = if lower > 0.0 { search.cycle } else { Vec::new() };
        // The rest is not needed.
        watch.done(real_of(effort.products.saturating_sub(search.products)) * self.product_operations());
        Some(WorstCase { lower, upper, cycle, products: search.products, complete: upper - lower <= effort.accuracy, certificate })
    }

    /// What a product takes: itself, and about as much again for each of the squarings that bound its norm.
    fn product_operations(&self) -> f64 {
        4.0 * real(self.size()).powi(3)
    }
}

/// The most numbers in products that are kept for leaves, 256 MiB of them; those of further leaves are computed again when their turn comes.
const MOST_KEPT: usize = 1 << 25;

/// An edge on a cycle, in the nodes' coordinates.
struct Step {
    edge: Edge,
    image: Approximate,
    norm: f64,
}

/// A path that may have to be followed further.
struct Leaf {
    /// σ.
    bound: f64,
    /// The order in which leaves were made decides between equal bounds.
    order: u64,
    /// Where it began and where it ends.
    root: usize,
    node: usize,
    length: usize,
    /// `None` if there was no room for it.
    product: Option<Approximate>,
    norm: f64,
    /// Its last entry among the trails.
    trail: Option<usize>,
}

struct Search {
    /// Those of a product.
    operations: f64,
    accuracy: f64,
    steps: Vec<Step>,
    /// The steps from each node.
    from: Vec<Vec<usize>>,
    leaves: BinaryHeap<Leaf>,
    /// The largest σ of a leaf that is not looked at again.
    settled: f64,
    lower: f64,
    cycle: Vec<usize>,
    products: u64,
    /// Paths as (the entry before, the step).
    trails: Vec<(Option<usize>, usize)>,
    /// How many more numbers may be kept in products of leaves.
    room: usize,
    norms: Norms,
    /// Closed paths whose radius is known, from whichever of their nodes comes first in order.
    closed: BTreeSet<Vec<usize>>,
}

impl Search {
    fn new(automaton: &Automaton, certificate: Option<&Certificate>, accuracy: f64, watch: &dyn Watch) -> Option<Self> {
        let steps = steps(automaton, certificate, watch)?;
        let mut from = vec![Vec::new(); automaton.pattern().nodes()];
        for (number, step) in steps.iter().enumerate() {
            from[step.edge.from].push(number);
        }
        Some(Self {
            operations: automaton.product_operations(),
            accuracy,
            steps,
            from,
            leaves: BinaryHeap::new(),
            settled: 0.0,
            lower: 0.0,
            cycle: Vec::new(),
            products: 0,
            trails: Vec::new(),
            room: MOST_KEPT,
            norms: Norms::default(),
            closed: BTreeSet::new(),
        })
    }

    /// Goes on as long as there is something to gain; `None` if the watch ends it.
    fn run(&mut self, budget: u64, watch: &dyn Watch) -> Option<()> {
        for number in 0..self.steps.len() {
            if watch.stops() {
                return None;
            }
            watch.done(self.operations);
            let step = &self.steps[number];
            let (product, norm) = (step.image.clone(), step.norm);
            self.look_at(number, product, norm, step.edge.from, f64::INFINITY, 0, None);
        }
        // A norm that is looser than the accuracy saves squarings and costs products.
        let sharp = (0.25 * self.accuracy).clamp(1e-5, 5e-3);
        while self.products < budget && self.leaves.peek().is_some_and(|leaf| !self.is_settled(leaf.bound)) {
            let Some(mut leaf) = self.leaves.pop() else { break };
            let above = match leaf.product.take() {
                Some(product) => {
                    self.room += product.matrix.entries().len();
                    product
                }
                None => self.product(leaf.trail),
            };
            for place in 0..self.from[leaf.node].len() {
                if watch.stops() {
                    return None;
                }
                let number = self.from[leaf.node][place];
                let step = &self.steps[number];
                let product = step.image.times(step.norm, &above, leaf.norm);
                let length = leaf.length + 1;
                let enough = libm::pow(self.lower + self.accuracy, real(length)) * (1.0 - 1e-9);
                // Only its root of order `length` counts, and only if it is below the bound that the leaf has already.
                let useless = libm::pow(leaf.bound, real(length)) * (1.0 + 1e-9);
                let norm = self.norms.above(&product.matrix, Sharpness { enough, beyond: sharp * real(length), useless });
                self.look_at(number, product, norm, leaf.root, leaf.bound, leaf.length, leaf.trail);
                watch.done(self.operations);
            }
        }
        Some(())
    }

    /// Takes in the path that goes on from another by one step.
    #[expect(clippy::too_many_arguments, reason = "the parts of a path, which is not yet a leaf")]
    fn look_at(&mut self, number: usize, product: Approximate, norm: f64, root: usize, before: f64, length: usize, trail: Option<usize>) {
        self.products += 1;
        let (node, length) = (self.steps[number].edge.to, length + 1);
        let bound = before.min(root_above(product.norm(norm), 0.0, real(length)));
        self.trails.push((trail, number));
        let trail = Some(self.trails.len() - 1);
        // A radius is at most its norm.
        if node == root && bound > self.enough() {
            self.close(&product, length, trail);
        }
        if self.is_settled(bound) {
            self.settled = self.settled.max(bound);
        } else {
            let entries = product.matrix.entries().len();
            let product = (entries <= self.room).then_some(product);
            if product.is_some() {
                self.room -= entries;
            }
            self.leaves.push(Leaf { bound, order: self.products, root, node, length, product, norm, trail });
        }
    }

    /// What the radius of a cycle must exceed to be worth knowing exactly.
    fn enough(&self) -> f64 {
        // A hundredth of the accuracy is no reason to compare hundreds of equal cycles to the last digit.
        self.lower + (0.01 * self.accuracy).max(1e-12 * self.lower)
    }

    fn is_settled(&self, bound: f64) -> bool {
        bound <= self.lower + self.accuracy
    }

    /// The steps of a path, in order of time.
    fn path(&self, trail: Option<usize>) -> Vec<usize> {
        let mut path = Vec::new();
        let mut next = trail;
        while let Some(place) = next {
            let (before, number) = self.trails[place];
            path.push(number);
            next = before;
        }
        path.reverse();
        path
    }

    /// The product of a path once more.
    fn product(&mut self, trail: Option<usize>) -> Approximate {
        let path = self.path(trail);
        let mut product = self.steps[path[0]].image.clone();
        for number in &path[1..] {
            // Any bound of the norm gives a bound of the error.
            let norm = self.norms.above(&product.matrix, Sharpness { enough: f64::INFINITY, beyond: 1.0, useless: 0.0 });
            let step = &self.steps[*number];
            product = step.image.times(step.norm, &product, norm);
        }
        product
    }

    /// Looks whether a closed path grows faster than the fastest so far.
    fn close(&mut self, product: &Approximate, length: usize, trail: Option<usize>) {
        let path = self.path(trail);
        // The same cycle from another of its nodes, or several times around, has the same radius.
        let rotated = |start: usize| path[start..].iter().chain(&path[..start]);
        let first = (1..length).fold(0, |first, start| if rotated(start).cmp(rotated(first)) == Ordering::Less { start } else { first });
        let repeats = (1..length).any(|start| length.is_multiple_of(start) && rotated(start).eq(&path));
        if repeats || !self.closed.insert(rotated(first).copied().collect()) {
            return;
        }
        let radius = radius_below(product, length, self.enough());
        if radius > self.lower {
            self.lower = radius;
            self.cycle = path.iter().map(|number| self.steps[*number].edge.symbol).collect();
        }
    }

    /// U, the largest σ of a leaf.
    fn upper(&self) -> f64 {
        self.leaves.peek().map_or(0.0, |leaf| leaf.bound).max(self.settled).max(self.lower)
    }
}

/// The edges on cycles in the coordinates of a certificate's shapes; of round ones, where there is none.
fn steps(automaton: &Automaton, certificate: Option<&Certificate>, watch: &dyn Watch) -> Option<Vec<Step>> {
    let identity = || vec![Matrix::identity(automaton.size()); automaton.pattern().nodes()];
    let factors: Option<Vec<Matrix>> = certificate.and_then(|certificate| certificate.shapes().iter().map(cholesky).collect());
    let inverses = factors.as_ref().and_then(|factors| factors.iter().map(Inverse::of).collect::<Option<Vec<Inverse>>>());
    let (factors, inverses) = match (factors, inverses) {
        (Some(factors), Some(inverses)) => (factors, inverses),
        (None | Some(_), None) | (None, Some(_)) => {
            let exact = Inverse { matrix: Matrix::identity(automaton.size()), gap: 0.0 };
            (identity(), vec![exact; automaton.pattern().nodes()])
        }
    };
    let step = |edge: &Edge| {
        if watch.stops() {
            return None;
        }
        let image = image(&automaton.matrices()[edge.symbol], &factors[edge.to], &inverses[edge.from]);
        let norm = norm_above(&image.matrix, Sharpness { enough: 0.0, beyond: 1e-4, useless: f64::INFINITY });
        Some(Step { edge: *edge, image, norm })
    };
    automaton.recurrent().map(step).collect()
}

/// A computed inverse Z of an upper triangle R.
#[derive(Clone)]
struct Inverse {
    matrix: Matrix,
    /// At least g/(1 − g), with g >= ‖I − RZ‖₂; zero if the inverse is exact.
    gap: f64,
}

impl Inverse {
    /// `None` if it is no inverse at all.
    fn of(factor: &Matrix) -> Option<Self> {
        let size = factor.rows();
        let matrix = triangle_inverse(factor);
        let product = factor.times(&matrix);
        let sizes = absolute(factor).times(&absolute(&matrix));
        let entry = |i: usize, j: usize| {
            let residual = if i == j { product[(i, j)] - 1.0 } else { product[(i, j)] };
            outward(residual.abs() * (1.0 + f64::EPSILON) + gamma(2 * size + 2) * sizes[(i, j)])
        };
        let g = outward(Matrix::from_fn(size, size, entry).frobenius_norm() * (1.0 + gamma(size * size + 4)));
        // Written so that NaN fails.
        (g < 0.5).then(|| Self { matrix, gap: outward(g / (1.0 - g)) })
    }
}

/// R_to A R_from⁻¹.
fn image(matrix: &Matrix, to: &Matrix, from: &Inverse) -> Approximate {
    let size = matrix.rows();
    let image = to.times(&matrix.times(&from.matrix));
    if from.gap == 0.0 {
        // Both are the identity.
        return Approximate { matrix: image, error: 0.0 };
    }
    let sizes = frobenius_norm(&absolute(to).times(&absolute(matrix).times(&absolute(&from.matrix))));
    let rounding = outward(gamma(2 * size + 2) * sizes * (1.0 + gamma(size * size + 2 * size + 2)));
    let norm = outward(frobenius_norm(&image) * (1.0 + gamma(size * size + 2))) + rounding;
    Approximate { matrix: image, error: outward(rounding + norm * from.gap) + real(size * size) * f64::MIN_POSITIVE }
}

#[expect(clippy::cast_precision_loss, reason = "an estimate")]
fn real_of(products: u64) -> f64 {
    products as f64
}

fn absolute(matrix: &Matrix) -> Matrix {
    Matrix::from_fn(matrix.rows(), matrix.columns(), |i, j| matrix[(i, j)].abs())
}

impl Ord for Leaf {
    /// The largest bound first; of equal ones the older.
    fn cmp(&self, other: &Self) -> Ordering {
        self.bound.total_cmp(&other.bound).then(other.order.cmp(&self.order))
    }
}

impl PartialOrd for Leaf {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Leaf {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Leaf {}

#[cfg(test)]
mod tests {
    use super::*;

    /// Without room for a single product every path is multiplied again, and the bounds are the same to the rounding of their error terms.
    #[test]
    fn without_room_the_bounds_are_the_same() {
        let matrices = [[0.5, 0.4, -0.3, 0.6], [0.4, -0.6, 0.5, 0.3]].map(|entries| Matrix::from_fn(2, 2, |i, j| entries[2 * i + j]));
        let automaton = Automaton::runs(matrices.to_vec(), 1, 2).unwrap();
        let bounds = |room: usize| {
            let certificate = Certificate::find(&automaton, 1e-2).unwrap();
            let mut search = Search::new(&automaton, Some(&certificate), 1e-6, &cohaptic_stability::Unwatched).unwrap();
            search.room = room;
            search.run(3_000, &cohaptic_stability::Unwatched).unwrap();
            (search.lower, search.upper(), search.products)
        };
        let (lower, upper, products) = bounds(MOST_KEPT);
        assert!(products > 100 && upper - lower < 1e-2, "{lower} {upper} {products}");
        for room in [0, 17] {
            let (other_lower, other_upper, _) = bounds(room);
            assert!((other_lower - lower).abs() < 1e-12 && (other_upper - upper).abs() < 1e-12, "{other_lower} {other_upper}");
        }
    }
}
