//! Operator on the second moment of any number of equal peers over equal links with independent losses, at a cost independent of that number.
//!
//! A second moment unchanged by every permutation of the peers keeps this symmetry through every event. Such a moment is determined by its entries for one,
//! two, three and four peers. With a_i the state of peer i (bodies, samples on the way) and h_ij the sample of peer j held by peer i:
//!
//! ```text
//! A0 = E a_i a_iᵀ    A1 = E a_i a_jᵀ    r = E a_i h_ij    s = E a_i h_ji    o = E a_i h_jk
//! h  = E of h_ij times: [0] h_ij  [1] h_ji  [2] h_ik  [3] h_kj  [4] h_jk (and h_ki)  [5] h_kl
//! ```
//!
//! Every event is a short formula in these moments. Let q be the probability of missing a sample u_j = cᵀa_j, and p = 1 − q. Delivering on all links at once
//! maps E h_ij h_kl to q²·E h_ij h_kl + q·p·(E h_ij u_l + E u_j h_kl) + p²·E u_j u_l for two different links, and E h_ij² to q·E h_ij² + p·E u_j².
//!
//! The space decomposes under the permutations into the common motion (once), the differences of peers (N − 1 copies: a_i, and the sums of h over
//! senders and over receivers) and two kinds of h whose sums are zero, symmetric and antisymmetric. A moment is positive definite if its block of each
//! kind is, so these blocks are the coordinates.
//!
//! All receivers hold nearly the same sample of a sender, so the sums of h grow with N − 1, and their components in an orthonormal basis with √(N − 1), while
//! a_i does not grow. Without scaling, more peers would cost more digits. In the blocks of the first two kinds h is therefore divided by √(N − 1). The division
//! turns the sums into the means used by the forces on peers. Then every coefficient of a frame is of size 1 for any N, and no coefficient is a difference of
//! large numbers.

use super::arrivals::Hazards;
use super::events::Signs;
use super::positive::{Positive, pack, unpack};
use super::tracked::Tracked;
use crate::Matrix;
use crate::lifted::Lifted;
use crate::lifted::node::Scale;
use crate::rounding::real;

use crate::timetable::Event;

/// Operator of one frame of equal peers.
#[derive(Clone, Debug)]
pub struct Symmetric {
    /// Number of peers, as a real number.
    peers: f64,
    /// Number of peers.
    count: usize,
    /// Steps of the frame in order.
    steps: Vec<Step>,
    /// Number of states of a peer at the beginning of a frame.
    size: usize,
    /// Displacement of a peer's states and of a held sample per unit of a common translation. Positions are then relative to the mean over all copies. `None`
    /// if the scene is tied to the ground.
    translation: Option<(Vec<f64>, f64)>,
    /// Index of the copy's position among the states of a peer.
    position: usize,
    /// Sum of the roundings of the maps of all steps.
    roundings: usize,
}

#[derive(Clone, Debug)]
enum Step {
    /// Motion of every peer: a ← own·a + held·(mean of h), with the coefficients of `map`. `sizes` bounds the terms of these coefficients.
    Move { map: Map, sizes: Map },
    /// Delivery on all links at once: each link takes in the state with the index `state` of its sender, independently, with probability `probability`.
    Deliver { state: usize, probability: f64 },
}

/// Coefficients of a peer's own states and of the mean of the held samples.
#[derive(Clone, Debug)]
struct Map {
    own: Matrix,
    held: Vec<f64>,
}

/// Second moment unchanged by every permutation of the peers, in the notation of the module.
#[derive(Clone, Debug)]
struct Moment {
    /// A0, the moment of a peer's states.
    own: Matrix,
    /// A1, the moment of the states of two different peers.
    other: Matrix,
    /// Moments r, s and o of a peer's states: with a sample held by the peer, with a sample of the peer held by another peer, and with a sample between
    /// two other peers.
    with: [Vec<f64>; 3],
    /// Moments h of two held samples, in the order of the module.
    held: [f64; 6],
}

impl Symmetric {
    /// Builds the frame of `peers` peers equal to the only node of `lifted`. The timetable of `lifted` has no deliveries; `hazards` has them.
    pub fn new(peers: usize, lifted: &Lifted<'_>, hazards: &Hazards) -> Self {
        let node = &lifted.nodes[0];
        let scale = Scale { time: lifted.time, compliance: node.compliance(lifted.time) };
        let rows = node.rows(0);
        let (states, depth, sent) = (node.states(), hazards.depth(), lifted.timetable.sent[0]);
        let (size, full) = (states + depth, states + depth + sent);
        // Map of the ticks since the last delivery. The columns are the states after the delivery, followed by the mean of the held samples.
        let mut map = Tracked::new(full, size, 1);
        let mut steps = Vec::new();
        let (mut tick, mut sample, mut roundings) = (0, 0, 0);
        let mut flush = |map: &Tracked, order: &dyn Fn(usize) -> usize, rows: usize| {
            let columns = map.value.columns() - 1;
            let chosen = |matrix: &Matrix| Map {
                own: Matrix::from_fn(rows, columns, |row, column| matrix[(order(row), column)]),
                held: (0..rows).map(|row| matrix[(order(row), columns)]).collect(),
            };
            roundings += map.roundings();
            Step::Move { map: chosen(&map.value), sizes: chosen(&map.sizes()) }
        };
        for event in &lifted.timetable.events {
            match *event {
                Event::Sample { .. } => {
                    let (position, velocity) = lifted.sampling.shares(0, lifted.time);
                    map.combine(states + depth + sample, [(rows.object, position), (rows.object + 1, velocity)]);
                    sample += 1;
                }
                Event::Deliver { .. } => {}
                Event::Tick { span, exchanges, .. } => {
                    // A delivery changes the held samples and is random, so the deterministic ticks before must be complete as one map.
                    if !hazards.at[tick].is_empty() {
                        steps.push(flush(&map, &|row| row, full));
                        map = Tracked::new(full, full, 1);
                        for hazard in &hazards.at[tick] {
                            let place = i64::try_from(states + depth).unwrap_or(i64::MAX) + hazard.sample;
                            steps.push(Step::Deliver { state: usize::try_from(place).unwrap_or(0), probability: hazard.hazard });
                        }
                    }
                    map.tick(node, lifted, (span, exchanges), scale);
                    tick += 1;
                }
            }
        }
        // In the next frame the samples of this frame are samples of an earlier frame, hence the shift by `sent` rows.
        steps.push(flush(&map, &|row| if row < states { row } else { row + sent }, size));
        let translation = (!lifted.tied).then(|| {
            let moved = lifted.sampling.translation(0, lifted.time);
            let mut states: Vec<f64> = (0..states).map(|row| node.displacement(rows, row, lifted.time)).collect();
            states.resize(size, moved);
            (states, moved)
        });
        Self { peers: real(peers), count: peers, steps, size, translation, position: rows.object, roundings }
    }

    /// Returns the number of operations of an image. At each step both blocks are multiplied by the step's matrix from the left and from the right.
    pub fn operations(&self) -> f64 {
        let of = |step: &Step| match step {
            Step::Move { map: Map { own, .. }, .. } => 4.0 * real(own.rows()) * real(own.columns()) * (real(own.rows()) + real(own.columns())),
            Step::Deliver { .. } => 4.0 * real(self.size) * real(self.size),
        };
        self.steps.iter().map(of).sum()
    }

    /// Returns the moment after a motion of every peer. Moments of more peers than the scene has get the factor zero.
    fn moved(&self, moment: &Moment, Map { own: map, held }: &Map) -> Moment {
        let Moment { own, other, with: [r, s, o], held: h } = moment;
        let n = self.peers;
        let w = 1.0 / (n - 1.0);
        // Moments with the mean of the N − 1 samples held by a peer: each sum over senders is split by how the two index pairs overlap.
        let others: Vec<f64> = s.iter().zip(o).map(|(s, o)| w * (s + (n - 2.0) * o)).collect();
        let own_held = w * (h[0] + (n - 2.0) * h[2]);
        let other_held = w * w * (h[1] + 2.0 * (n - 2.0) * h[4] + (n - 2.0) * h[3] + (n - 2.0) * (n - 3.0) * h[5]);
        let quadratic = |core: &Matrix, cross: &[f64], square: f64| {
            let half = map.times(core);
            let cross = map.times_column(cross);
            let transposed = map.transposed();
            let mut result = half.times(&transposed);
            for row in 0..result.rows() {
                for column in 0..result.columns() {
                    result[(row, column)] += cross[row] * held[column] + held[row] * cross[column] + square * held[row] * held[column];
                }
            }
            result
        };
        let linear =
            |with: &[f64], mean: f64| -> Vec<f64> { map.times_column(with).iter().zip(held).map(|(with, held)| with + mean * held).collect() };
        Moment {
            own: quadratic(own, r, own_held),
            other: quadratic(other, &others, other_held),
            with: [
                linear(r, own_held),
                linear(s, w * (h[1] + (n - 2.0) * h[4])),
                linear(o, w * (h[4] + h[3] + if self.count > 3 { (n - 3.0) * h[5] } else { 0.0 })),
            ],
            held: *h,
        }
    }

    /// Returns the moment after a delivery on all links at once.
    fn delivered(moment: &Moment, state: usize, probability: f64) -> Moment {
        let (p, q) = (probability, 1.0 - probability);
        let Moment { own, other, with: [r, s, o], held: h } = moment;
        let blend = |with: &[f64], core: &Matrix| -> Vec<f64> { with.iter().zip(core.row(state)).map(|(with, core)| q * with + p * core).collect() };
        let (own_square, other_square) = (own[(state, state)], other[(state, state)]);
        // Two different links miss or deliver independently, hence q², q·p and p². The same link twice has q and p only.
        let pair = |before: f64, cross: f64, square: f64| q * q * before + q * p * cross + p * p * square;
        Moment {
            with: [blend(r, other), blend(s, own), blend(o, other)],
            held: [
                q * h[0] + p * own_square,
                pair(h[1], 2.0 * r[state], other_square),
                pair(h[2], 2.0 * o[state], other_square),
                pair(h[3], 2.0 * s[state], own_square),
                pair(h[4], o[state] + r[state], other_square),
                pair(h[5], 2.0 * o[state], other_square),
            ],
            own: own.clone(),
            other: other.clone(),
        }
    }

    /// Makes positions relative to the mean position of all copies, if the scene is not tied to the ground.
    fn relative(&self, moment: &mut Moment, signs: Signs) {
        let Some((states, held)) = &self.translation else {
            return;
        };
        let (n, minus) = (self.peers, signs.minus());
        let at = self.position;
        let Moment { own, other, with: [r, s, o], held: h } = moment;
        // Moments with the mean position m of all copies. Subtracting m times the translation from every state gives the three terms of (a − t·m)(a − t·m)ᵀ.
        let with_mean: Vec<f64> = own.row(at).iter().zip(other.row(at)).map(|(own, other)| (own + (n - 1.0) * other) / n).collect();
        let held_mean = (r[at] + s[at] + (n - 2.0) * o[at]) / n;
        let square = with_mean[at];
        for core in [own, other] {
            for row in 0..core.rows() {
                for column in 0..core.columns() {
                    core[(row, column)] +=
                        square * states[row] * states[column] + minus * (states[row] * with_mean[column] + with_mean[row] * states[column]);
                }
            }
        }
        for with in [r, s, o] {
            for (row, with) in with.iter_mut().enumerate() {
                *with += states[row] * held * square + minus * (with_mean[row] * held + states[row] * held_mean);
            }
        }
        for h in h {
            *h += held * held * square + minus * 2.0 * held * held_mean;
        }
    }

    /// Returns the blocks of a moment: of the common motion, of the differences, and of the held samples whose sums are zero, symmetric and antisymmetric.
    fn blocks(&self, moment: &Moment, signs: Signs) -> (Matrix, Matrix, f64, f64) {
        let Moment { own, other, with: [r, s, o], held: h } = moment;
        let (n, minus) = (self.peers, signs.minus());
        let (n1, n2, n3, size) = (n - 1.0, n - 2.0, n - 3.0, self.size);
        // For three peers this factor is negative itself, so sizes need its absolute value.
        let n4 = if signs == Signs::Kept { n - 4.0 } else { (n - 4.0).abs() };
        let (even, odd) = (h[0] + h[1], h[0] + minus * h[1]);
        let (y, z) = (h[2] + h[3] + 2.0 * h[4], h[2] + h[3] + minus * 2.0 * h[4]);
        let common = Matrix::from_fn(size + 1, size + 1, |row, column| match (row < size, column < size) {
            (true, true) => own[(row, column)] + n1 * other[(row, column)],
            (false, false) => (even + n2 * y + n2 * n3 * h[5]) / n1,
            _ => {
                let row = row.min(column);
                r[row] + s[row] + n2 * o[row]
            }
        });
        let extra = if self.count > 2 { 2 } else { 1 };
        let apart = Matrix::from_fn(size + extra, size + extra, |row, column| {
            let (low, high) = (row.min(column), row.max(column));
            match (low < size, high < size) {
                (true, true) => own[(row, column)] + minus * other[(row, column)],
                (true, false) if high == size => (0.5 * n / n1).sqrt() * (r[low] + minus * s[low]),
                (true, false) => (0.5 * n2 / n1).sqrt() * (r[low] + s[low] + minus * 2.0 * o[low]),
                _ if high == size => (odd + 0.5 * n2 * z) / n1,
                _ if low == size => 0.5 * (n * n2).sqrt() * (h[2] + minus * h[3]) / n1,
                _ => (even + 0.5 * n4 * y + minus * 2.0 * n3 * h[5]) / n1,
            }
        });
        (common, apart, even + minus * y + 2.0 * h[5], odd + minus * z)
    }

    /// Returns the moment with these blocks, the inverse of [`blocks`](Self::blocks).
    fn moment(&self, (common, apart, symmetric, antisymmetric): &(Matrix, Matrix, f64, f64), signs: Signs) -> Moment {
        let (n, minus) = (self.peers, signs.minus());
        let (n1, n2, size) = (n - 1.0, n - 2.0, self.size);
        let other = Matrix::from_fn(size, size, |row, column| (common[(row, column)] + minus * apart[(row, column)]) / n);
        let own = Matrix::from_fn(size, size, |row, column| apart[(row, column)] + other[(row, column)]);
        let (mut r, mut s, mut o) = (vec![0.0; size], vec![0.0; size], vec![0.0; size]);
        for row in 0..size {
            let whole = common[(row, size)];
            let difference = apart[(row, size)] / (0.5 * n / n1).sqrt();
            let rest = if self.count > 2 { apart[(row, size + 1)] / (0.5 * n2 / n1).sqrt() } else { 0.0 };
            o[row] = if self.count > 2 { (whole + minus * rest) / n } else { 0.0 };
            let sum = if self.count > 2 { rest + 2.0 * o[row] } else { whole };
            r[row] = 0.5 * (sum + difference);
            s[row] = 0.5 * (sum + minus * difference);
        }
        let whole = n1 * common[(size, size)];
        let held = if self.count == 2 {
            let odd = apart[(size, size)];
            [0.5 * (whole + odd), 0.5 * (whole + minus * odd), 0.0, 0.0, 0.0, 0.0]
        } else {
            let z = 2.0 * (n1 * apart[(size, size)] + minus * antisymmetric) / n;
            let odd = antisymmetric + z;
            // Three peers have no moment of four different peers, so y and `even` follow from two equations instead of three.
            let rest = n1 * apart[(size + 1, size + 1)];
            let (y, apart_four, even) = if self.count == 3 {
                let y = (whole + minus * rest) / 1.5;
                (y, 0.0, whole + minus * y)
            } else {
                let (one, two) = (2.0 * (rest + minus * symmetric) / n2, (whole + minus * symmetric) / n1);
                let four = (two + minus * one) / n;
                let y = one + 4.0 * four;
                (y, four, symmetric + y + minus * 2.0 * four)
            };
            let difference = 2.0 * n1 * apart[(size, size + 1)] / (n * n2).sqrt();
            let sum = 0.5 * (y + z);
            [
                0.5 * (even + odd),
                0.5 * (even + minus * odd),
                0.5 * (sum + difference),
                0.5 * (sum + minus * difference),
                0.25 * (y + minus * z),
                apart_four,
            ]
        };
        Moment { own, other, with: [r, s, o], held }
    }

    /// Returns the coordinates of an element from its blocks. If positions are relative to the mean over all copies, the position of the mean is zero and is
    /// left out. Blocks that do not exist for two or three peers are left out too.
    fn packed(&self, (common, apart, symmetric, antisymmetric): (Matrix, Matrix, f64, f64)) -> Vec<f64> {
        let kept: Vec<usize> = (0..=self.size).filter(|row| self.translation.is_none() || *row != self.position).collect();
        let common = Matrix::from_fn(kept.len(), kept.len(), |row, column| common[(kept[row], kept[column])]);
        let mut packed = Vec::with_capacity(self.unknowns());
        pack(&common, &mut packed);
        pack(&apart, &mut packed);
        packed.extend((self.count > 3).then_some(symmetric));
        packed.extend((self.count > 2).then_some(antisymmetric));
        packed
    }

    /// Returns the blocks of an element from its coordinates, with zeros for the parts left out by [`packed`](Self::packed).
    fn unpacked(&self, element: &[f64]) -> (Matrix, Matrix, f64, f64) {
        let skipped = if self.translation.is_some() { self.position } else { usize::MAX };
        let kept = self.size + usize::from(self.translation.is_none());
        let (common, rest) = unpack(kept, element);
        let place = |row: usize| if row > skipped { row - 1 } else { row };
        let common = Matrix::from_fn(self.size + 1, self.size + 1, |row, column| {
            if row == skipped || column == skipped { 0.0 } else { common[(place(row), place(column))] }
        });
        let (apart, rest) = unpack(self.size + if self.count > 2 { 2 } else { 1 }, rest);
        match rest {
            [symmetric, antisymmetric] => (common, apart, *symmetric, *antisymmetric),
            [antisymmetric] => (common, apart, 0.0, *antisymmetric),
            _ => (common, apart, 0.0, 0.0),
        }
    }

    fn run(&self, element: &[f64], signs: Signs) -> Vec<f64> {
        let mut moment = self.moment(&self.unpacked(element), signs);
        for step in &self.steps {
            moment = match step {
                Step::Move { map, sizes } => self.moved(&moment, if signs == Signs::Kept { map } else { sizes }),
                Step::Deliver { state, probability } => Self::delivered(&moment, *state, *probability),
            };
        }
        self.relative(&mut moment, signs);
        self.packed(self.blocks(&moment, signs))
    }
}

impl Positive for Symmetric {
    fn unknowns(&self) -> usize {
        let half = |size: usize| size * (size + 1) / 2;
        half(self.size + usize::from(self.translation.is_none())) + half(self.size + if self.count > 2 { 2 } else { 1 }) + self.count.min(4) - 2
    }

    fn base(&self) -> Vec<f64> {
        let apart = Matrix::identity(self.size + if self.count > 2 { 2 } else { 1 });
        self.packed((Matrix::identity(self.size + 1), apart, 1.0, 1.0))
    }

    fn apply(&self, element: &[f64]) -> Vec<f64> {
        self.run(element, Signs::Kept)
    }

    fn sizes(&self, element: &[f64]) -> Vec<f64> {
        self.run(element, Signs::Dropped)
    }

    fn roundings(&self) -> usize {
        let of = |step: &Step| match step {
            // Products with the map from both sides, and the sums over the held samples.
            Step::Move { map, .. } => 2 * map.own.columns() + 32,
            Step::Deliver { .. } => 12,
        };
        // The last 64 are for the conversion from blocks to a moment and back, and to relative positions.
        self.steps.iter().map(of).sum::<usize>() + 2 * self.roundings + 64
    }

    fn matrices(&self, element: &[f64]) -> Vec<Matrix> {
        let kept = self.size + usize::from(self.translation.is_none());
        let (common, rest) = unpack(kept, element);
        let (apart, rest) = unpack(self.size + if self.count > 2 { 2 } else { 1 }, rest);
        let single = |entry: &f64| Matrix::from_fn(1, 1, |_, _| *entry);
        [common, apart].into_iter().chain(rest.iter().map(single)).collect()
    }
}
