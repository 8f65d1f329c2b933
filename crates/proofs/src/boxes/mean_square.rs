//! Every number of equal peers in the mean square, over equal links with independent losses.
//!
//! A delivery with the probability p = 1 − q turns the sample held, h, into q·h + p·u + ξ, with a noise ξ of variance p·q·σ², σ² = E(u − h)², independent from
//! link to link. So the second moments of N equal peers are the second moments of three kinds of motion, coupled only by σ² (see [`Symmetric`] for other
//! coordinates of the same moments):
//!
//! ```text
//! C    of √N times the mean over the peers of (a, h)        h ← q·h + p·u,                              noise ν·p·q·σ²
//! A    of the differences of (a, in, out) from the mean      in ← q·in − ν·p·u,  out ← q·out + p·u,     noise ν·p·q·σ²·[1, −ν; −ν, 1]
//! x    of samples held of which all sums are zero            x ← q²·x + p·q·σ²
//! σ² = µ·C[u − h] + (1 − µ)·A[u − out] + (1 − µ)/(1 − ν²)·A[in + ν·out] + ((1 − 2ν)/2 + (1 − ν)/(2 + 2ν))·x
//! ```
//!
//! Here a is the states of a peer and its samples in transit, `in` the mean of the samples held by the peer, and `out` the mean of the samples of the peer
//! held by all other peers. ν = 1/(N − 1), µ = 1/N, and X\[v\] = vᵀXv. Everything is analytic in ν, down to 0, and a tick is multi-affine in gains and
//! coefficients of step maps. So the image L(Y) of a fixed Y = (C, A, x) over a span of numbers is a mean, a slope along each number and a radius
//! ([`StepSpan`]). γ·Y − L(Y) is positive definite on all of the span if the matrix is so at all ends of the slopes, radius included. Y is computed at a number
//! in the middle of the span and need not be exact. If Y is positive definite and γ = 1, every number is *stable*. If Y has an entry below zero on its diagonal
//! and γ > 1, every number is
//! *unstable* ([`Positive`]).

use cohaptic_peer::Gains;
use cohaptic_stability::frames::{Event, External, Lifted, Node, NominalNetwork, Sampling, Scale, Scratch};
use cohaptic_stability::moments::{Independent, Positive, Symmetric, is_definite, is_indefinite, leaves_less, radius_watched, solution};
use cohaptic_stability::numerics::{UNIT, cholesky, gamma, is_positive, real, triangle_inverse};
use cohaptic_stability::{Matrix, Unwatched, Verdict};

use super::certificate::MomentCertificate;
use super::corners::{check_units, enclosed, takes_one_past};
use super::error::ProofError;
use super::growing::{ENDLESS, Growing, Motion, WIDER, nu};
use super::guarantee::Proven;
use super::span::StepSpan;
use super::steps::{StepMatrix, error};

/// Second moments of a scene with a growing largest class of equal peers.
pub(super) struct GrowingMoments<'a> {
    motions: Vec<(&'a Motion, Independent)>,
}

impl<'a> GrowingMoments<'a> {
    pub(super) fn new(growing: &'a Growing, network: &NominalNetwork) -> Result<Self, ProofError> {
        let of = |motion: &'a Motion| {
            if motion.part(2, None).iter().any(|node| node.law.horizon.is_some()) {
                return Err(ProofError::Ages { strategy: motion.scene.coordination.strategy.name() });
            }
            let independent = Independent::of(&motion.scene, network, &motion.structure)?.ok_or(ProofError::UnequalChance)?;
            Ok::<_, ProofError>((motion, independent))
        };
        Ok(Self { motions: growing.motions.iter().map(of).collect::<Result<_, _>>()? })
    }

    /// Returns the proven verdict on every number of peers from `low` to `high`, or `None`. Two peers have fewer kinds of motion, and the number 2 is never the
    /// end of a longer span.
    pub(super) fn decide(&self, low: u64, high: u64) -> Result<Option<Proven>, ProofError> {
        let mut all = Some(Proven::Stable);
        for (motion, independent) in &self.motions {
            let found = if high == 2 {
                of_two(motion, independent)
            } else {
                Frame { motion, independent, wider: 1.0 }.decide(low, high)?.map(|(proven, _)| proven)
            };
            match found {
                Some(Proven::Unstable) => return Ok(Some(Proven::Unstable)),
                Some(Proven::Stable) => {}
                None => all = None,
            }
        }
        Ok(all)
    }

    /// Returns the verdict on the numbers from `low` to `high` with the second moments for a check of the verdict; `None` if no verdict is proven.
    pub(super) fn certify(&self, low: u64, high: u64) -> Result<Option<(Proven, Vec<MomentCertificate>)>, ProofError> {
        let mut all = Vec::new();
        let mut is_decided = true;
        let wider = if low < high { WIDER } else { 1.0 };
        for (motion, independent) in &self.motions {
            let found = if high == 2 { moment_of_two(motion, independent) } else { Frame { motion, independent, wider }.decide(low, high)? };
            match found {
                Some((Proven::Unstable, moment)) => return Ok(Some((Proven::Unstable, vec![moment]))),
                Some((Proven::Stable, moment)) => all.push(moment),
                None => is_decided = false,
            }
        }
        Ok(is_decided.then_some((Proven::Stable, all)))
    }
}

/// Least γ for a verdict of instability, above 1 by more than roundings.
const ABOVE: f64 = 1.0 + 4096.0 * f64::EPSILON;

/// Returns the operator of second moments for a number of equal peers, each with the node `node`.
fn operator(motion: &Motion, independent: &Independent, number: u64, node: &Node, time: f64) -> Symmetric {
    let nodes = std::slice::from_ref(node);
    let lifted = Lifted {
        nodes,
        weights: &motion.structure.weights,
        timetable: &independent.timetable,
        sampling: Sampling::of(nodes),
        time,
        tied: motion.structure.tied,
    };
    Symmetric::new(usize::try_from(number).unwrap_or(usize::MAX), &lifted, &independent.hazards)
}

/// Returns the verdict on two peers by the spectral radius of the operator of their second moments.
fn of_two(motion: &Motion, independent: &Independent) -> Option<Proven> {
    let node = motion.part(2, Some(0)).swap_remove(0);
    let operator = operator(motion, independent, 2, &node, motion.time(2));
    match radius_watched(&operator, operator.operations(), &Unwatched)?.or(independent.held).verdict() {
        Verdict::Stable => Some(Proven::Stable),
        Verdict::Unstable => Some(Proven::Unstable),
        Verdict::Marginal | Verdict::Overflow => None,
    }
}

/// Returns the verdict on two peers with the second moment Y behind the verdict. The kinds of motion are the mean and the difference of both peers.
fn moment_of_two(motion: &Motion, independent: &Independent) -> Option<(Proven, MomentCertificate)> {
    let node = motion.part(2, Some(0)).swap_remove(0);
    let time = motion.time(2);
    let operator = operator(motion, independent, 2, &node, time);
    let (gamma, found) = solution(&operator, factor)?;
    let blocks = operator.matrices(&found);
    let proven = proven(gamma, &blocks)?;
    // The part of a held sample without a force is no state of Y, so a stable verdict needs this part to die out too.
    let holds = leaves_less(&operator, gamma, &found) && (proven == Proven::Unstable || independent.held.verdict() == Verdict::Stable);
    let heard = heard_by(Sampling::of(std::slice::from_ref(&node)));
    let blocks: Vec<Matrix> = blocks.iter().map(symmetric).collect();
    holds.then(|| (proven, MomentCertificate::new(gamma, time, heard, independent.hazards.depth(), &blocks.iter().collect::<Vec<_>>())))
}

/// Returns γ for a spectral radius: 1 if the radius is below 1, otherwise half the radius but above 1. A γ well below the radius leaves Y far from positive.
fn factor(radius: f64) -> f64 {
    if radius < 1.0 { 1.0 } else { (0.5 * radius).max(ABOVE) }
}

/// Returns the verdict from Y, provided that γY − L(Y) is positive definite.
fn proven(gamma: f64, y: &[Matrix]) -> Option<Proven> {
    match (is_definite(y), is_indefinite(y)) {
        (true, _) if gamma <= 1.0 => Some(Proven::Stable),
        (false, true) if gamma > 1.0 => Some(Proven::Unstable),
        _ => None,
    }
}

/// Returns the gains of a sample as one number; `None` if a sample is a position and a velocity.
const fn heard_by(sampling: Sampling) -> Option<Gains> {
    match sampling {
        Sampling::Combined(gains) => Some(gains),
        Sampling::Whole => None,
    }
}

/// Second moment Y over a box: C (`common`), A (`apart`) and x (`rest`).
#[derive(Clone)]
struct Moment {
    common: StepSpan,
    apart: StepSpan,
    rest: StepSpan,
}

/// Event of a frame of a peer: its own motion between two deliveries, or a delivery.
enum Action {
    /// The peer takes samples and then ticks, if `span` is the duration of a tick.
    Move {
        samples: Vec<usize>,
        span: Option<std::time::Duration>,
    },
    Deliver {
        row: usize,
        probability: f64,
    },
}

/// Numbers of rows of a peer, in order: its states, samples of earlier frames, samples of this frame. Held samples follow: h, or in and out.
struct Rows {
    states: usize,
    depth: usize,
    sent: usize,
    position: usize,
}

impl Rows {
    const fn held(&self) -> usize {
        self.states + self.depth + self.sent
    }

    /// Returns the number of rows between frames, without the samples of this frame and without held samples.
    const fn kept(&self) -> usize {
        self.states + self.depth
    }
}

/// Numbers of a box: the numbers of its corners, and ν as the last number.
struct Numbers {
    nu: [f64; 2],
    count: usize,
}

impl Numbers {
    fn constant(&self, matrix: Matrix) -> StepSpan {
        StepSpan::constant(matrix, self.count)
    }

    /// Encloses a function of ν over the box by its chord. Half of the second derivative of the function is at most `bend` in size.
    fn curve(&self, of: impl Fn(f64) -> f64, bend: f64) -> StepSpan {
        let [high, low] = self.nu.map(of);
        // A function leaves its chord by at most half its second derivative times the square of half the width.
        let half = 0.5 * (self.nu[0] - self.nu[1]);
        let mut span = self.constant(single(0.5 * (low + high)));
        span.slopes[self.count - 1] = single(0.5 * (high - low));
        span.radius = single(bend * half * half * (1.0 + 8.0 * UNIT) + 16.0 * UNIT * (low.abs() + high.abs()));
        span
    }

    /// Returns the matrix `constant` + ν·`slope` over the box.
    fn of_nu(&self, constant: &Matrix, slope: &Matrix) -> StepSpan {
        let (middle, half) = (0.5 * (self.nu[0] + self.nu[1]), 0.5 * (self.nu[0] - self.nu[1]));
        let entry = |i: usize, j: usize| constant[(i, j)] + middle * slope[(i, j)];
        let mut span = self.constant(Matrix::from_fn(constant.rows(), constant.columns(), entry));
        span.slopes[self.count - 1] = slope.scaled(half);
        span.radius = Matrix::from_fn(constant.rows(), constant.columns(), |i, j| 8.0 * UNIT * (constant[(i, j)].abs() + slope[(i, j)].abs()));
        span
    }
}

fn single(entry: f64) -> Matrix {
    Matrix::from_fn(1, 1, |_, _| entry)
}

/// Returns a row of the given size with the given entries, as places and values; all other entries are zero.
fn row(size: usize, entries: &[(usize, f64)]) -> Matrix {
    Matrix::from_fn(1, size, |_, column| entries.iter().filter(|(place, _)| *place == column).map(|(_, entry)| entry).sum())
}

/// Frame of a peer over links with losses.
struct Frame<'a> {
    motion: &'a Motion,
    independent: &'a Independent,
    /// Widening factor of the radius of L(Y).
    wider: f64,
}

impl Frame<'_> {
    fn decide(&self, low: u64, high: u64) -> Result<Option<(Proven, MomentCertificate)>, ProofError> {
        let nus = [low, high].map(|number| if number == ENDLESS { 0.0 } else { nu(number) });
        // ν and not N is the number of the box, because all entries are analytic in ν down to ν = 0. Y belongs to a number near the middle of ν.
        let middle = 0.5 * (nus[0] + nus[1]);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between two numbers")]
        let number = ((1.0 / middle).round() as u64 + 1).clamp(low, high);
        let ends = [low, high].map(|number| self.motion.part(number, Some(0)));
        let node = self.motion.part(number, Some(0)).swap_remove(0);
        let time = self.motion.time(number);
        let points = self.motion.corners(ends[0].clone(), [&ends[0], &ends[1]], [1.0, 1.0], true, Some(0));
        let scale = Scale { time, compliance: node.compliance(time) };
        check_units(&points, scale)?;
        if !takes_one_past(&points, scale) {
            return Err(ProofError::Remembered);
        }
        let own = node.rows(0);
        let (depth, sent) = (self.independent.hazards.depth(), self.independent.timetable.sent[0]);
        let rows = Rows { states: node.states(), depth, sent, position: own.object };
        let actions = self.actions(&rows);
        let sampling = Sampling::of(&points.iter().flat_map(|point| point.nodes.clone()).collect::<Vec<_>>());
        let moves = |held: usize| {
            enclosed(&points, &ends, |point| {
                let moves = actions.iter().filter_map(|action| match action {
                    Action::Move { samples, span } => Some((samples, *span)),
                    Action::Deliver { .. } => None,
                });
                moves.map(|(samples, span)| moved(&point.nodes[0], &rows, held, (samples, span), sampling, scale)).collect()
            })
        };
        let (common, apart) = (moves(1)?, moves(2)?);
        let numbers = Numbers { nu: nus, count: common[0].slopes.len() + 1 };
        let wider = |moves: Vec<StepSpan>| moves.into_iter().map(StepSpan::with_another_number).collect::<Vec<_>>();
        let (common, apart) = (wider(common), wider(apart));

        let operator = operator(self.motion, self.independent, number, &node, time);
        let Some((gamma, found)) = solution(&operator, factor) else { return Ok(None) };
        let Some(y) = of_blocks(&operator.matrices(&found), &numbers, nu(number)) else { return Ok(None) };
        // The sign of Y chooses which verdict the inequality can show, so Y is looked at before the costly image.
        let Some(proven) = proven(gamma, &[&y.common, &y.apart, &y.rest].map(|one| one.mean.clone())) else { return Ok(None) };
        let tied = self.motion.structure.tied;
        let translation: Option<Vec<f64>> = (!tied).then(|| {
            let of_states = (0..rows.states).map(|row| node.displacement(own, row, time));
            of_states.chain(std::iter::repeat_n(sampling.translation(0, time), depth + 1)).collect()
        });
        let image = self.image(&y, &actions, (&common, &apart), &rows, &numbers, translation.as_deref());
        let left = |y: &StepSpan, image: &StepSpan| numbers.constant(y.mean.scaled(gamma)).plus(&image.negated().widened(self.wider));
        let holds = is_everywhere_positive(&left(&y.common, &image.common))
            && is_everywhere_positive(&left(&y.apart, &image.apart))
            && is_everywhere_positive(&left(&y.rest, &image.rest));
        // A sample on a link without deliveries is held for ever: stability needs the motion of held samples to be stable as well.
        let is_proven = holds && (proven == Proven::Unstable || self.independent.held.verdict() == Verdict::Stable);
        let moment = || MomentCertificate::new(gamma, time, heard_by(sampling), depth, &[&y.common, &y.apart, &y.rest].map(|one| &one.mean));
        Ok(is_proven.then(|| (proven, moment())))
    }

    fn actions(&self, rows: &Rows) -> Vec<Action> {
        let (mut actions, mut samples, mut sample, mut tick) = (Vec::new(), Vec::new(), 0, 0);
        for event in &self.independent.timetable.events {
            match *event {
                Event::Sample { .. } => {
                    samples.push(rows.states + rows.depth + sample);
                    sample += 1;
                }
                Event::Deliver { .. } => {}
                Event::Tick { span, .. } => {
                    // Samples taken before a delivery must be in their rows by then, so a move without a tick comes first.
                    if !self.independent.hazards.at[tick].is_empty() && !samples.is_empty() {
                        actions.push(Action::Move { samples: std::mem::take(&mut samples), span: None });
                    }
                    for hazard in &self.independent.hazards.at[tick] {
                        let place = i64::try_from(rows.states + rows.depth).unwrap_or(i64::MAX) + hazard.sample;
                        actions.push(Action::Deliver { row: usize::try_from(place).unwrap_or(0), probability: hazard.hazard });
                    }
                    actions.push(Action::Move { samples: std::mem::take(&mut samples), span: Some(span) });
                    tick += 1;
                }
            }
        }
        if !samples.is_empty() {
            actions.push(Action::Move { samples, span: None });
        }
        actions
    }

    /// Returns L(Y), the second moment after a frame from the second moment Y, over the box.
    fn image(
        &self,
        y: &Moment,
        actions: &[Action],
        (common, apart): (&[StepSpan], &[StepSpan]),
        rows: &Rows,
        numbers: &Numbers,
        translation: Option<&[f64]>,
    ) -> Moment {
        let skipped = translation.map(|_| rows.position);
        // Matrices from the rows between frames to the rows within a frame at its beginning, and back at its end.
        let begins = |held: usize, skipped: Option<usize>| {
            let places: Vec<usize> = (0..rows.kept()).chain((0..held).map(|held| rows.held() + held)).filter(|row| Some(*row) != skipped).collect();
            numbers.constant(Matrix::from_fn(rows.held() + held, places.len(), |row, column| f64::from(u8::from(places[column] == row))))
        };
        let ends = |held: usize, moved: Option<&[f64]>| {
            let of = |row: usize| if row < rows.states { row } else { row + rows.sent };
            let kept: Vec<usize> = (0..rows.kept() + held).filter(|row| moved.is_none() || *row != rows.position).collect();
            let entry = |row: usize, column: usize| {
                let moves = if column == rows.position { moved.map_or(0.0, |moved| moved[kept[row]]) } else { 0.0 };
                f64::from(u8::from(of(kept[row]) == column)) - moves
            };
            numbers.constant(Matrix::from_fn(kept.len(), rows.held() + held, entry))
        };
        let mut moment = Moment { common: y.common.through(&begins(1, skipped)), apart: y.apart.through(&begins(2, None)), rest: y.rest.clone() };
        let mut moves = common.iter().zip(apart);
        let mut pending: Option<(StepSpan, StepSpan)> = None;
        // Moves between two deliveries are multiplied first: a product of matrices is cheaper than passing both moments through each move.
        let flush = |moment: &mut Moment, pending: &mut Option<(StepSpan, StepSpan)>| {
            if let Some((common, apart)) = pending.take() {
                (moment.common, moment.apart) = (moment.common.through(&common), moment.apart.through(&apart));
            }
        };
        for action in actions {
            match action {
                Action::Move { .. } => {
                    if let Some((common, apart)) = moves.next() {
                        pending = Some(match pending {
                            Some((before, apart_before)) => (common.times(&before), apart.times(&apart_before)),
                            None => (common.clone(), apart.clone()),
                        });
                    }
                }
                Action::Deliver { row, probability } => {
                    // A delivery adds noise by the present moment, so the moves before must have been applied.
                    flush(&mut moment, &mut pending);
                    moment = delivered(&moment, (rows.held(), *row), *probability, numbers);
                }
            }
        }
        flush(&mut moment, &mut pending);
        Moment { common: moment.common.through(&ends(1, translation)), apart: moment.apart.through(&ends(2, None)), rest: moment.rest }
    }
}

/// Returns the matrix of samples and a tick of a peer.
fn moved(
    node: &Node,
    rows: &Rows,
    held: usize,
    (samples, span): (&[usize], Option<std::time::Duration>),
    sampling: Sampling,
    scale: Scale,
) -> StepMatrix {
    let (own, size) = (node.rows(0), rows.held() + held);
    let mut z = Matrix::identity(size);
    let (position, velocity) = sampling.shares(0, scale.time);
    for sample in samples {
        for column in 0..size {
            z[(*sample, column)] = position * z[(own.object, column)] + velocity * z[(own.object + 1, column)];
        }
    }
    if let Some(span) = span {
        // Every tick has an exchange, because the mean square is refused for slow devices.
        // A peer hears the mean of its held samples, the first held row: h for the common motion, `in` for the differences.
        let mut heard = Matrix::zeros(1 + node.law.memory.len(), size);
        for (row, by) in node.heard(sampling, 0, 0.0, scale.time).enumerate() {
            heard[(row, rows.held())] = by;
        }
        let mut scratch = Scratch::default();
        scratch.resize(size);
        node.tick(&mut z, own, |row| heard.row(row), External::default(), (span, true), scale, &mut scratch);
    }
    StepMatrix { matrix: z, error: error(std::slice::from_ref(node), scale, 0.0) }
}

/// Returns the second moment after a delivery of the sample at row `sample` to the held samples in the rows from `held` on.
fn delivered(moment: &Moment, (held, sample): (usize, usize), probability: f64, numbers: &Numbers) -> Moment {
    let (p, q) = (probability, 1.0 - probability);
    let (sizes, constant) = ((held + 1, held + 2), |matrix| numbers.constant(matrix));
    // Terms of σ², with the factors of the formula of the module.
    let square = |of: &StepSpan, by: &StepSpan| of.through(by);
    // The bounds of half the second derivative hold for ν from 0 to 1/2, that is, from three peers on: 1/(1 + ν)³ ≤ 1 and 1/(1 − ν)³ ≤ 8.
    let mu = numbers.curve(|nu| nu / (1.0 + nu), 1.0);
    let rest_of_mu = numbers.curve(|nu| 1.0 / (1.0 + nu), 1.0);
    let steep = numbers.curve(|nu| 1.0 / (1.0 - nu), 8.0);
    let of_rest = numbers.of_nu(&single(0.5), &single(-1.0)).plus(&rest_of_mu.times(&numbers.of_nu(&single(0.5), &single(-0.5))));
    let in_and_out = numbers.of_nu(&row(sizes.1, &[(held, 1.0)]), &row(sizes.1, &[(held + 1, 1.0)]));
    let terms = [
        mu.times(&square(&moment.common, &constant(row(sizes.0, &[(sample, 1.0), (held, -1.0)])))),
        rest_of_mu.times(&square(&moment.apart, &constant(row(sizes.1, &[(sample, 1.0), (held + 1, -1.0)])))),
        rest_of_mu.times(&rest_of_mu).times(&steep).times(&square(&moment.apart, &in_and_out)),
        of_rest.times(&moment.rest),
    ];
    let sigma = terms.iter().skip(1).fold(terms[0].clone(), |sum, term| sum.plus(term));
    // Encloses a product of probabilities with its rounding.
    let factor = |value: f64| {
        let mut span = constant(single(value));
        span.radius = single(4.0 * UNIT * value.abs());
        span
    };
    let noise = factor(p * q).times(&sigma);
    let of_links = numbers.of_nu(&single(0.0), &single(1.0)).times(&noise);
    let taken = |size: usize, entries: &[(usize, usize, f64)], slope: &[(usize, usize, f64)]| {
        let entry = |list: &[(usize, usize, f64)], i: usize, j: usize| {
            list.iter().find(|(row, column, _)| (*row, *column) == (i, j)).map(|(.., entry)| *entry)
        };
        let constant = Matrix::from_fn(size, size, |i, j| entry(entries, i, j).unwrap_or_else(|| f64::from(u8::from(i == j))));
        numbers.of_nu(&constant, &Matrix::from_fn(size, size, |i, j| entry(slope, i, j).unwrap_or(0.0)))
    };
    let common = taken(sizes.0, &[(held, held, q), (held, sample, p)], &[]);
    let apart = taken(sizes.1, &[(held, held, q), (held + 1, held + 1, q), (held + 1, sample, p)], &[(held, sample, -p)]);
    let outer = |noise: &StepSpan, by: &StepSpan| noise.through(&by.transposed());
    // [1, −ν; −ν, 1] is (1, −ν) times itself, and 1 − ν² at the second place.
    let in_less_out = numbers.of_nu(&row(sizes.1, &[(held, 1.0)]), &row(sizes.1, &[(held + 1, -1.0)]));
    let less = numbers.of_nu(&single(1.0), &single(-1.0)).times(&numbers.of_nu(&single(1.0), &single(1.0)));
    let of_out = outer(&less.times(&of_links), &constant(row(sizes.1, &[(held + 1, 1.0)])));
    // The outer products of the noise follow the table of the module: C has noise in h, A in `in` and `out`, x in itself.
    Moment {
        common: moment.common.through(&common).plus(&outer(&of_links, &constant(row(sizes.0, &[(held, 1.0)])))),
        apart: moment.apart.through(&apart).plus(&outer(&of_links, &in_less_out)).plus(&of_out),
        rest: factor(q * q).times(&moment.rest).plus(&noise),
    }
}

/// Returns Y from the blocks of [`Symmetric`]. The coordinates of held samples there are differences and sums of in and out.
fn of_blocks(blocks: &[Matrix], numbers: &Numbers, nu: f64) -> Option<Moment> {
    let [common, apart, rest @ ..] = blocks else { return None };
    let size = apart.rows();
    let (difference, sum) = ((0.5 * (1.0 + nu)).sqrt(), (0.5 * (1.0 - nu)).sqrt());
    let turned = Matrix::from_fn(size, size, |i, j| match (size - i, size - j) {
        (2, 2) => difference,
        (1, 2) => -difference,
        (2 | 1, 1) => sum,
        _ => f64::from(u8::from(i == j)),
    });
    let apart = symmetric(&turned.times(apart).times(&turned.transposed()));
    let rest = rest.iter().map(|one| one[(0, 0)]).sum::<f64>() / real(rest.len().max(1));
    Some(Moment { common: numbers.constant(symmetric(common)), apart: numbers.constant(apart), rest: numbers.constant(single(rest)) })
}

fn symmetric(matrix: &Matrix) -> Matrix {
    Matrix::from_fn(matrix.rows(), matrix.columns(), |i, j| 0.5 * (matrix[(i, j)] + matrix[(j, i)]))
}

/// Returns whether a symmetric matrix is positive definite all over a box. The corners of the box are enough, since the matrix is affine but for its radius.
/// In the coordinates of the check the matrix is nearly the unit matrix in the middle of the box.
fn is_everywhere_positive(span: &StepSpan) -> bool {
    let Some(factor) = cholesky(&symmetric(&span.mean)) else { return false };
    let inverse = triangle_inverse(&factor).transposed();
    if !inverse.is_finite() {
        return false;
    }
    let span = span.through(&StepSpan::constant(inverse, span.slopes.len()));
    let size = span.mean.rows();
    (0..1_usize << span.slopes.len()).all(|corner| {
        let sign = |number: usize| if corner >> number & 1 == 1 { 1.0 } else { -1.0 };
        let at =
            |i: usize, j: usize| span.mean[(i, j)] + span.slopes.iter().enumerate().map(|(number, slope)| sign(number) * slope[(i, j)]).sum::<f64>();
        let largest = |i: usize, j: usize| span.mean[(i, j)].abs() + span.slopes.iter().map(|slope| slope[(i, j)].abs()).sum::<f64>();
        let rounded = gamma(span.slopes.len() + 4);
        // Entries (i, j) and (j, i) are the same number. Their mean is off by at most the larger of both errors.
        let error = |i: usize, j: usize| span.radius[(i, j)] + rounded * largest(i, j);
        let error = Matrix::from_fn(size, size, |i, j| error(i, j).max(error(j, i)) * (1.0 + 8.0 * UNIT));
        is_positive(&Matrix::from_fn(size, size, |i, j| 0.5 * (at(i, j) + at(j, i))), &error)
    })
}
