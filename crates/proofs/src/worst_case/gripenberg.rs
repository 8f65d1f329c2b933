//! Bounds of the joint spectral radius by branch and bound (Gripenberg 1996), along the paths of an automaton.
//!
//! *From below.* A path that ends where it began may be repeated for ever: the joint spectral radius ρ is at least the spectral radius of its product, to the
//! power of one over its length.
//!
//! *From above.* Give every node v a norm |·|_v, and a product along a path from v to w the operator norm from |·|_v to |·|_w. The norm of a joined path is at
//! most the product of the norms of its pieces. The proof needs no other property of the norms. Let every node have a finite tree of paths, complete in that
//! every path from the node either ends within the tree or runs through one of its leaves; let a path p have σ(p) = the least ‖A_q‖^(1/|q|) over its prefixes q
//! that are not empty, p among them; and let U be the largest σ of a leaf. Then ρ <= U: cut an infinite path where a prefix q of its leaf attains σ, which
//! gives ‖A_q‖ <= U^|q|; go on in the same way in the tree of the node where q ended. The cuts come at distances that the depth of the trees bounds, and so the
//! product of the first N steps has norm <= C·U^N, with C for the piece after the last cut. The same family of norms is used in all trees: where one path's
//! piece ends, the next begins in the norm in which the first was measured. Any family will do; this one is |x|_v = √(xᵀP_v x) with the shapes that a quadratic
//! certificate has ([`Certificate::find`]), in which single steps already grow little.
//!
//! A leaf with σ <= lower + accuracy is settled and never branched. The leaf with the largest σ is branched next, because U cannot fall while that leaf exists.
//! Another order might raise the lower bound sooner, and so need fewer branches, but no rule for such an order is known.
//!
//! *Rounding.* Products are computed in coordinates in which the norms are 2-norms: X = R_to A Z for a shape P = RᵀR and a computed Z near R⁻¹. With
//! G = I − RZ, the exact R_to A R⁻¹ is (R_to A Z)(I − G)⁻¹, within ‖R_to A Z‖·g/(1 − g) of R_to A Z for ‖G‖₂ <= g < 1, and X is within γ₍₂ₙ₎|R_to||A||Z| of
//! that, entry by entry. From there errors are carried along with every product ([`Approximate`]). Any invertible R may be used, whatever its origin: it need
//! not factorise a shape exactly.

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

/// The limits of a search.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Effort {
    /// Distance of the bounds at which the search ends. The joint spectral radius of frames is of the order of 1.
    pub accuracy: f64,
    /// Largest number of products that the search computes. The search computes the product of each single edge even if this number is smaller. Each product
    /// takes some tens of bytes until the search ends; the matrices that are kept take up to 256 MiB more.
    pub products: u64,
}

impl Default for Effort {
    /// Returns an accuracy of 10⁻³ and 100 000 products.
    fn default() -> Self {
        Self { accuracy: 1e-3, products: 100_000 }
    }
}

/// Bounds of the joint spectral radius, and the pattern that attains the lower bound.
///
/// The joint spectral radius is zero where no infinite path exists.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct WorstCase {
    /// Lower bound of the joint spectral radius.
    pub(crate) lower: f64,
    /// Upper bound of the joint spectral radius; infinite if numbers overflowed.
    pub(crate) upper: f64,
    /// Symbols, in the order of time, whose matrices repeated for ever grow by the lower bound per step; empty if the lower bound is zero.
    pub(crate) cycle: Vec<usize>,
    /// Number of products that the search computed.
    pub(crate) products: u64,
    /// `true` if the distance of the bounds is at most the accuracy of the effort.
    pub(crate) complete: bool,
    /// Quadratic certificate whose shapes are the norms of the search; `None` if numbers overflowed.
    pub(crate) certificate: Option<Certificate>,
}

impl Automaton {
    #[cfg(test)]
    /// Returns bounds of the joint spectral radius, the fastest growth per step of a state along allowed sequences of any length.
    ///
    /// The bounds hold for every effort. They differ by at most the accuracy of the effort if [`WorstCase::complete`].
    #[must_use]
    pub(crate) fn worst_case(&self, effort: &Effort) -> WorstCase {
        self.worst_case_watched(effort, &cohaptic_stability::Unwatched).expect("without a watch nothing ends it")
    }

    /// Returns bounds of the joint spectral radius, or `None` if the watch ends the search. The watch is asked before each product, and in each round of the
    /// search for a certificate.
    #[must_use]
    pub(crate) fn worst_case_watched(&self, effort: &Effort, watch: &dyn Watch) -> Option<WorstCase> {
        watch.expects(real_of(effort.products) * self.product_operations());
        let exponent = self.exponent();
        let scaled = self.scaled(exponent);
        let accuracy = libm::ldexp(effort.accuracy, exponent);
        // Branching reaches the accuracy with any shapes, so the certificate need not be as sharp.
        let certificate = Certificate::find_watched(self, accuracy.clamp(1e-6, 1e-2), watch)?.ok();
        let mut search = Search::new(&scaled, certificate.as_ref(), accuracy, watch)?;
        search.run(effort.products, watch)?;
        let lower = libm::ldexp(search.lower, -exponent);
        let upper = libm::ldexp(search.upper(), -exponent);
        // A lower bound of the order of underflow may be rounding alone.
        let lower = if lower > f64::MIN_POSITIVE { lower } else { 0.0 };
        let cycle = if lower > 0.0 { search.cycle } else { Vec::new() };
        // The search announced the whole budget of products to the watch, and needed fewer.
        watch.done(real_of(effort.products.saturating_sub(search.products)) * self.product_operations());
        Some(WorstCase { lower, upper, cycle, products: search.products, complete: upper - lower <= effort.accuracy, certificate })
    }

    /// Returns the estimated number of operations of a product: those of the product itself, and of the squarings that bound its norm.
    fn product_operations(&self) -> f64 {
        4.0 * real(self.size()).powi(3)
    }
}

/// Largest number of matrix entries that are kept for leaves, 256 MiB in total. The products of further leaves are computed again when the leaves are branched.
const MOST_KEPT: usize = 1 << 25;

/// An edge on a cycle, in the coordinates of its nodes.
struct Step {
    edge: Edge,
    /// Matrix R_to A R_from⁻¹.
    image: Approximate,
    /// Upper bound of the 2-norm of the computed image.
    norm: f64,
}

/// A path that the search may have to branch.
struct Leaf {
    /// σ of the path.
    bound: f64,
    /// Number of products at the leaf's creation. Decides between equal bounds, so that the order of the search is the same on every machine.
    order: u64,
    /// First node of the path.
    root: usize,
    /// Last node of the path.
    node: usize,
    /// Number of steps of the path.
    length: usize,
    /// Product along the path; `None` if no room was left.
    product: Option<Approximate>,
    /// Upper bound of the 2-norm of the computed product.
    norm: f64,
    /// Index of the last step of the path in `Search::trails`.
    trail: Option<usize>,
}

/// The state of a branch and bound.
struct Search {
    /// Estimated number of operations of a product.
    operations: f64,
    accuracy: f64,
    steps: Vec<Step>,
    /// Indices of the steps from each node.
    from: Vec<Vec<usize>>,
    /// Leaves that are not settled.
    leaves: BinaryHeap<Leaf>,
    /// Largest σ of the settled leaves.
    settled: f64,
    /// Best lower bound so far.
    lower: f64,
    /// Symbols of the closed path that attains `lower`.
    cycle: Vec<usize>,
    /// Number of products so far.
    products: u64,
    /// Steps of all paths as a tree: the index of the entry before, and the index of the step.
    trails: Vec<(Option<usize>, usize)>,
    /// Number of matrix entries that may still be kept for leaves.
    room: usize,
    norms: Norms,
    /// Closed paths whose radius is known, each rotated to the smallest of its rotations.
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

    /// Branches leaves until the bounds are as close as the accuracy or the budget of products is spent; `None` if the watch ends the search.
    fn run(&mut self, budget: u64, watch: &dyn Watch) -> Option<()> {
        // The trees of all nodes begin with the single steps, without which U would not be complete.
        for number in 0..self.steps.len() {
            if watch.stops() {
                return None;
            }
            watch.done(self.operations);
            let step = &self.steps[number];
            let (product, norm) = (step.image.clone(), step.norm);
            self.look_at(number, product, norm, step.edge.from, f64::INFINITY, 0, None);
        }
        // A looser norm needs fewer squarings, but leaves larger σ and so more products.
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
                // σ is the least of the roots of all prefixes, so a norm whose root is not below the leaf's σ changes nothing.
                let useless = libm::pow(leaf.bound, real(length)) * (1.0 + 1e-9);
                let norm = self.norms.above(&product.matrix, Sharpness { enough, beyond: sharp * real(length), useless });
                self.look_at(number, product, norm, leaf.root, leaf.bound, leaf.length, leaf.trail);
                watch.done(self.operations);
            }
        }
        Some(())
    }

    /// Records the path that extends a path by the step `number`: as a closed path, as a settled leaf or as a leaf to branch. `before`, `length` and `trail`
    /// are those of the path without the step, `norm` is an upper bound of the 2-norm of `product`.
    #[expect(clippy::too_many_arguments, reason = "the parts of a path, which is not yet a leaf")]
    fn look_at(&mut self, number: usize, product: Approximate, norm: f64, root: usize, before: f64, length: usize, trail: Option<usize>) {
        self.products += 1;
        let (node, length) = (self.steps[number].edge.to, length + 1);
        let bound = before.min(root_above(product.norm(norm), 0.0, real(length)));
        self.trails.push((trail, number));
        let trail = Some(self.trails.len() - 1);
        // The growth of a closed path is at most σ, so a path with a small σ cannot raise the lower bound.
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

    /// Returns the growth that a cycle must exceed to be computed exactly.
    fn enough(&self) -> f64 {
        // Hundreds of cycles may have the same growth but for rounding. A hundredth of the accuracy keeps the search from comparing all of them to the last
        // digit.
        self.lower + (0.01 * self.accuracy).max(1e-12 * self.lower)
    }

    fn is_settled(&self, bound: f64) -> bool {
        bound <= self.lower + self.accuracy
    }

    /// Returns the steps of a path, in order of time. `trail` is the index of the last step; `None` is the empty path.
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

    /// Computes the product of a path whose product was not kept.
    fn product(&mut self, trail: Option<usize>) -> Approximate {
        let path = self.path(trail);
        let mut product = self.steps[path[0]].image.clone();
        for number in &path[1..] {
            // The norm only enters the bound of the error, so the cheapest bound is sharp enough.
            let norm = self.norms.above(&product.matrix, Sharpness { enough: f64::INFINITY, beyond: 1.0, useless: 0.0 });
            let step = &self.steps[*number];
            product = step.image.times(step.norm, &product, norm);
        }
        product
    }

    /// Raises the lower bound if a closed path grows faster than all closed paths before.
    fn close(&mut self, product: &Approximate, length: usize, trail: Option<usize>) {
        let path = self.path(trail);
        // A rotation of a cycle, or a cycle taken several times, has the same growth per step and is computed once.
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

    /// Returns U, the largest σ of a leaf, settled or not.
    fn upper(&self) -> f64 {
        self.leaves.peek().map_or(0.0, |leaf| leaf.bound).max(self.settled).max(self.lower)
    }
}

/// Returns the edges on cycles in the coordinates of the certificate's shapes, or in the original coordinates without a certificate or with singular factors;
/// `None` if the watch ends the search.
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
    /// The inverse Z.
    matrix: Matrix,
    /// Upper bound of g/(1 − g), with g >= ‖I − RZ‖₂; zero if the inverse is exact.
    gap: f64,
}

impl Inverse {
    /// Returns the computed inverse of an upper triangle, or `None` if ‖I − RZ‖ is not shown to be below a half.
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

/// Returns R_to A R_from⁻¹ with a bound of its error.
fn image(matrix: &Matrix, to: &Matrix, from: &Inverse) -> Approximate {
    let size = matrix.rows();
    let image = to.times(&matrix.times(&from.matrix));
    if from.gap == 0.0 {
        // Only the exact identity has the gap zero, and then R_to is the identity too: the product is exact.
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
    /// Compares two leaves. The leaf with the larger bound is greater, so that the heap yields this leaf first. Of equal bounds the older leaf is greater.
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

    /// Without room for a single product the search computes every path again, and the bounds are the same to the rounding of their error terms.
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
