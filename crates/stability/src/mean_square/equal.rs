//! Mean-square radius of equal peers over equal links with independent losses, from two small matrices and without a bound of the error.
//!
//! A delivery with the probability p = 1 − q turns the held sample h into h + p·(u − h) + ξ. Here u is the delivered sample and ξ a noise of mean 0 and
//! variance p·q·E(u − h)², independent of all earlier events and of the other links. So the scene moves in its *mean* motion, with every link passing on
//! the share p of each sample, driven by noise with a variance from the motion. For such multiplicative noise, stability in the mean square is a gain
//! condition (Willems & Blankenship 1971; Elia 2005, Theorem 6.4; Lu & Skelton 2002).
//!
//! The mean motion of equal peers splits into the common motion and the differences, as in [`Structure`](crate::structure::Structure). Each is a node
//! hearing itself, with the weight w = 1 for the common motion and w = −1/(N−1) for the differences. Let a be the states of the peer and of its samples on the
//! way, n the held sample with losses replaced by their average, and ζ the mean over the senders of the noise still held. Each node has the states
//! y = (a, n):
//!
//! ```text
//! a ← F·a + f·(w·n + ζ)                            motion
//! n ← q·n + p·u        ζ ← q·ζ + ξ                 delivery
//! E ξ² = p·q·σ/(N − 1),    σ = E(u_j − h_ij)² = E(u − n)² − 2·E(u − n)·ζ_ij + E ζ_ij²
//! ```
//!
//! Let γ be the growth factor of the second moment over a frame, X the solution of γX = M·X·Mᵀ + Σ b_e·b_eᵀ for the frame's matrix M of (y, ζ) and the
//! unit noise b_e of each delivery. Then σ at each delivery is linear in the variances of the noise, with coefficients ≥ 0, falling as γ rises. The radius
//! is the γ with a spectral radius 1 of this relation, or the square of the spectral radius of M if the square is larger.
//!
//! [`Symmetric`](super::symmetric::Symmetric) computes the same radius from the second moment itself, more slowly and with a bound of the error. The tests
//! compare both.

use num_complex::Complex64;

use super::arrivals::Hazards;
use super::variance::Variance;
use crate::Matrix;
use crate::lifted::Lifted;
use crate::lifted::node::{External, Scale, Scratch};
use crate::rounding::real;
use crate::spectrum::{Schur, Workspace};

use crate::timetable::{Event, Timetable};

/// Relative distance from the zero at the end of the search for γ.
const TOLERANCE: f64 = 1e-13;
/// Largest number of steps of the search for γ.
const STEPS: usize = 200;

/// Frame of equal peers, without the parameters of their bodies and gains.
#[derive(Clone, Debug)]
pub(crate) struct Equal {
    /// Number of peers.
    peers: f64,
    /// Events of one node, without deliveries.
    timetable: Timetable,
    /// Deliveries on a link within the frame, in the order of time.
    deliveries: Vec<Delivery>,
    /// Number of samples of earlier frames still under way.
    depth: usize,
    /// Factor of the held noise per frame: the probability of no arrival.
    kept: f64,
}

/// Possible delivery of a sample at a tick.
#[derive(Clone, Debug)]
struct Delivery {
    /// Number of the tick in the frame.
    tick: usize,
    /// Number of the sample, counted from the first sample sent in the frame.
    sample: i64,
    /// Probability of the delivery.
    arrives: f64,
    /// Share still held just before this delivery of the noise held at the beginning of the frame, followed by the shares of the noise of each
    /// earlier delivery.
    left: Vec<f64>,
    /// Share of this delivery's noise still held at the end of the frame.
    at_end: f64,
}

/// Reusable buffers of [`Equal::radius`].
#[derive(Debug, Default)]
pub(crate) struct EqualScratch {
    rows: Matrix,
    node: Scratch,
    seen: Vec<f64>,
    heard: Matrix,
    common: Block,
    apart: Block,
    relation: Matrix,
    workspace: Workspace,
}

/// Mean motion of one kind, common or difference, in the coordinates of its triangular form.
#[derive(Debug, Default)]
struct Block {
    /// Triangular form of the frame's matrix, with the responses u − n of the deliveries as further rows and the noises as further columns.
    schur: Schur,
    /// Number of states y at the beginning of a frame.
    size: usize,
    /// Coefficients of u − n at each delivery: of the noise held at the beginning of the frame, then of the noise of each earlier delivery.
    direct: Vec<Vec<f64>>,
    variance: Variance,
}

impl Equal {
    /// Returns the frame of `peers` equal peers with the clock of `timetable`, the timetable of a single node. `hazards` are the hazards of every link.
    pub(crate) fn new(peers: usize, timetable: Timetable, hazards: &Hazards) -> Self {
        let listed = hazards.at.iter().enumerate().flat_map(|(tick, at)| at.iter().map(move |hazard| (tick, *hazard)));
        let mut deliveries: Vec<Delivery> = Vec::new();
        let mut left = vec![1.0];
        for (tick, hazard) in listed {
            let missed = 1.0 - hazard.hazard;
            deliveries.push(Delivery { tick, sample: hazard.sample, arrives: hazard.hazard, left: left.clone(), at_end: 1.0 });
            // Each later delivery overwrites the held sample with its noise in the mean: the share 1 − p of earlier noise remains.
            left.iter_mut().for_each(|left| *left *= missed);
            left.push(1.0);
        }
        for (delivery, left) in deliveries.iter_mut().zip(&left[1..]) {
            delivery.at_end = *left;
        }
        Self { peers: real(peers), timetable, deliveries, depth: hazards.depth(), kept: left[0] }
    }

    /// Returns the radius over a frame of the second moment of the states with forces; `None` if numbers overflow.
    ///
    /// `lifted` has one node. The timetable and the weights of `lifted` are ignored.
    pub(crate) fn radius(&self, lifted: &Lifted<'_>, scratch: &mut EqualScratch) -> Option<f64> {
        let EqualScratch { rows, node, seen, heard, common, apart, relation, workspace } = scratch;
        let n1 = self.peers - 1.0;
        self.block(lifted, 1.0, lifted.tied, (rows, node, seen, heard), common)?;
        self.block(lifted, -1.0 / n1, true, (rows, node, seen, heard), apart)?;
        // No γ below this bound qualifies: the noise-free motion and the held noise alone already grow by it.
        let lowest = common.modulus().max(apart.modulus()).max(self.kept).powi(2);
        // The coefficients of the relation fall as γ rises, so the inverse of its spectral radius rises and crosses 1 once.
        let mut rise = |gamma: f64| {
            self.relation(gamma, common, apart, relation);
            1.0 / workspace.radius(relation) - 1.0
        };
        let found = root(lowest.max(f64::MIN_POSITIVE), &mut rise);
        found.is_finite().then_some(found)
    }

    /// Computes the frame of the mean motion of a node hearing itself with the weight `weight`, in triangular form; `None` if numbers overflow.
    fn block(
        &self,
        lifted: &Lifted<'_>,
        weight: f64,
        tied: bool,
        (rows, scratch, seen, heard): (&mut Matrix, &mut Scratch, &mut Vec<f64>, &mut Matrix),
        block: &mut Block,
    ) -> Option<()> {
        let node = &lifted.nodes[0];
        let (position_share, velocity_share) = lifted.sampling.shares(0, lifted.time);
        let scale = Scale { time: lifted.time, compliance: node.compliance(lifted.time) };
        let own = node.rows(0);
        let (states, depth, sent) = (node.states(), self.depth, self.timetable.sent[0]);
        // Rows: states of the peer, its samples on the way, its samples of this frame, n, ζ. Columns: states at the beginning of the frame, ζ, noise of each
        // delivery.
        let (mean, noise) = (states + depth + sent, states + depth + sent + 1);
        let reference = (!tied).then_some(own.object);
        let size = states + depth + 1 - usize::from(!tied);
        let columns = size + 1 + self.deliveries.len();
        rows.reset(noise + 1, columns);
        let begins = (0..states + depth).chain([mean]).filter(|row| Some(*row) != reference);
        for (column, row) in begins.clone().enumerate() {
            rows[(row, column)] = 1.0;
        }
        rows[(noise, size)] = 1.0;
        scratch.resize(columns);
        seen.resize(columns, 0.0);
        block.size = size;
        block.direct.clear();
        // The output u − n of each delivery becomes a row below the rows of the states at the end of the frame.
        let mut outputs = Matrix::zeros(self.deliveries.len(), size);
        let (mut tick, mut sample, mut next) = (0, 0, 0);
        for event in &self.timetable.events {
            match *event {
                Event::Sample { .. } => {
                    let row = states + depth + sample;
                    for column in 0..columns {
                        rows[(row, column)] = position_share * rows[(own.object, column)] + velocity_share * rows[(own.object + 1, column)];
                    }
                    sample += 1;
                }
                Event::Deliver { .. } => {}
                Event::Tick { span, exchanges, .. } => {
                    // Deliveries of a tick come before the motion of the tick, so that the force already uses the new sample.
                    while let Some(delivery) = self.deliveries.get(next).filter(|delivery| delivery.tick == tick) {
                        let place = i64::try_from(states + depth).ok()? + delivery.sample;
                        let row = usize::try_from(place).ok()?;
                        let (arrives, missed) = (delivery.arrives, 1.0 - delivery.arrives);
                        for column in 0..columns {
                            // n ← q·n + p·u in the mean, and the old noise keeps the share q. The noise of this delivery enters with size 1.
                            let (fresh, held) = (rows[(row, column)], rows[(mean, column)]);
                            if column < size {
                                outputs[(next, column)] = fresh - held;
                            }
                            rows[(mean, column)] = missed * held + arrives * fresh;
                            rows[(noise, column)] *= missed;
                            seen[column] = fresh - held;
                        }
                        block.direct.push(seen[size..=size + next].to_vec());
                        rows[(noise, size + 1 + next)] += 1.0;
                        next += 1;
                    }
                    heard.reset(1 + node.law.memory.len(), columns);
                    for (row, by) in node.heard(lifted.sampling, 0, 0.0, lifted.time).enumerate() {
                        for (column, heard) in heard.row_mut(row).iter_mut().enumerate() {
                            *heard = by * (weight * rows[(mean, column)] + rows[(noise, column)]);
                        }
                    }
                    node.tick(rows, own, |row| heard.row(row), External::default(), (span, exchanges), scale, scratch);
                    tick += 1;
                }
            }
        }
        // If nothing ties the scene to the ground, positions are relative to the position of the copy. A translation moves a sample by its share of the
        // position only.
        let moves = |row: usize| if row >= states { position_share } else { node.displacement(own, row, lifted.time) };
        let ends: Vec<(usize, f64)> = begins
            .map(|row| (if row >= states && row < mean { row + sent } else { row }, if reference.is_some() { moves(row) } else { 0.0 }))
            .collect();
        block.schur.load(size, (self.deliveries.len(), 1 + self.deliveries.len()), |row, column| match ends.get(row) {
            Some((end, moved)) => rows[(*end, column)] - moved * rows[(own.object, column)],
            None => outputs[(row - size, column)],
        });
        block.schur.triangularise().then_some(())
    }

    /// Computes the matrix from the variances at the deliveries (columns) to the variances at the deliveries (rows), for a second moment growing by
    /// γ in a frame.
    fn relation(&self, gamma: f64, common: &mut Block, apart: &mut Block, relation: &mut Matrix) {
        let (n, n1, size) = (self.peers, self.peers - 1.0, self.deliveries.len());
        relation.reset(size, size);
        for (from, source) in self.deliveries.iter().enumerate() {
            let variance = source.arrives * (1.0 - source.arrives) / n1;
            // A certain delivery makes no noise, so its column stays zero.
            if variance == 0.0 {
                continue;
            }
            common.solve(gamma, self.kept, from, source.at_end);
            apart.solve(gamma, self.kept, from, source.at_end);
            let held = common.variance.of_noise();
            for (to, delivery) in self.deliveries.iter().enumerate() {
                let within = if from < to { delivery.left[from + 1] } else { 0.0 };
                let [one, other] = [&*common, &*apart].map(|block| block.seen(to, from, (delivery.left[0], within)));
                // σ of the module head, written with the two kinds of motion: the N·(N−1) links see one common motion and N−1 independent differences.
                let square = (one.square + n1 * other.square) / n - 2.0 / n * (one.product - other.product);
                let noise = n1 * (delivery.left[0].powi(2) * held + within * within);
                // The sum is a variance, so a negative result is rounding.
                relation[(to, from)] = (variance * (square + noise)).max(0.0);
            }
        }
    }
}

/// Second moments of u − n at a delivery: with itself (`square`), and with ζ (`product`).
#[derive(Clone, Copy, Debug)]
struct Seen {
    square: f64,
    product: f64,
}

impl Block {
    /// Returns the largest modulus of an eigenvalue of the frame's matrix.
    fn modulus(&self) -> f64 {
        (0..self.size).map(|place| self.schur.at(place, place).norm()).fold(0.0, f64::max)
    }

    /// Computes the second moment of (y, ζ) for unit noise at the delivery with the index `delivery`, once per frame.
    fn solve(&mut self, gamma: f64, kept: f64, delivery: usize, at_end: f64) {
        let Self { schur, size, variance, .. } = self;
        let size = *size;
        let matrix = |row: usize, column: usize| match (row < size, column < size) {
            // Column `size` of the triangular form is the first input, ζ at the beginning of the frame.
            (true, _) => schur.at(row, column),
            (false, true) => Complex64::default(),
            (false, false) => Complex64::from(kept),
        };
        let input = |row: usize| if row < size { schur.at(row, size + 1 + delivery) } else { Complex64::from(at_end) };
        variance.solve(gamma, size + 1, matrix, input);
    }

    /// Returns the moments at delivery `to` for unit noise at delivery `from`: the part of earlier frames, and the part within this frame if `from` is earlier
    /// than `to`. `left` and `within` are the shares still held of ζ at the beginning of the frame and of the noise of `from`.
    fn seen(&self, to: usize, from: usize, (left, within): (f64, f64)) -> Seen {
        let direct = &self.direct[to];
        let size = self.size;
        let output = |place: usize| if place < size { self.schur.at(size + to, place) } else { Complex64::from(direct[0]) };
        let (square, product) = self.variance.of_output(output);
        let at_once = if from < to { direct[from + 1] } else { 0.0 };
        Seen { square: square + at_once * at_once, product: left * product + at_once * within }
    }
}

/// Returns the zero γ above `lowest` of a rising function; `lowest` if the function is not negative within 10⁻⁹ above `lowest`. NaN if the function
/// is NaN.
///
/// The inverse of the relation's radius is nearly a straight line above the pole at `lowest`, so secants converge quickly. Bisection follows if a secant
/// leaves the bounds.
fn root(lowest: f64, rise: &mut impl FnMut(f64) -> f64) -> f64 {
    let mut before = (lowest, 0.0);
    // Close to the pole rounding can cancel a variance. The function then seems positive below its zero. Hence several distances.
    for away in [1e-12, 1e-11, 1e-10, 1e-9] {
        let gamma = lowest * (1.0 + away);
        before = (gamma, rise(gamma));
        if before.1.is_nan() || before.1 < 0.0 {
            break;
        }
    }
    if before.1.is_nan() || before.1 >= 0.0 {
        return if before.1.is_nan() { f64::NAN } else { lowest };
    }
    let (mut low, mut high) = (before.0, f64::INFINITY);
    // First secant: at the pole the inverse is zero, that is, the function is −1.
    let mut gamma = lowest + (before.0 - lowest) / (1.0 + before.1).max(f64::EPSILON);
    for _ in 0..STEPS {
        let value = rise(gamma);
        if value.is_nan() {
            return f64::NAN;
        }
        if value < 0.0 {
            low = low.max(gamma);
        } else {
            high = high.min(gamma);
        }
        let secant = gamma - value * (gamma - before.0) / (value - before.1);
        let inside = secant > low && secant < high && secant.is_finite();
        // A secant inside the bounds is best. Otherwise the middle of the bounds is next, or, without an upper bound yet, twice the distance from the pole.
        let next = match (inside, high.is_finite()) {
            (true, _) => secant,
            (false, true) => 0.5 * (low + high),
            (false, false) => low + 2.0 * (low - lowest),
        };
        // The search ends when the secant no longer moves, or when the bounds are within the tolerance.
        if value == 0.0 || (secant - gamma).abs() <= TOLERANCE * gamma || (high.is_finite() && high - low <= TOLERANCE * high) {
            return if inside { secant } else { gamma };
        }
        before = (gamma, value);
        gamma = next;
    }
    gamma
}
