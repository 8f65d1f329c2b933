//! Bounds for links with independent losses and delays, at any number of equal peers.
//!
//! Every link has the same states and steps. Let e be the difference between the samples of a link at a receiver and the samples of a link that delivers each
//! sample as soon as possible, one entry per stretch of ticks with the same sample. The difference e is a combination of the steps v from sample to sample of
//! the sender. For each state c of a link, let Q_c be a quadratic form of these steps, and let S be a quadratic form of e and v with
//!
//! ```text
//! Q_next(v after) + S(e, v) <= ρ²·Q_c(v before)         for everything that a link in the state c may do,
//! V(after) <= ρ²·V(before) + Σ S(e_ij, v_j)             for all states, and all e_ij whatever
//! ```
//!
//! Then V + ΣQ grows by ρ² a step at most, whatever each link does. For the second inequality, let V be a form for the average and a form for differences; e_ij
//! of the link from j to i takes part by its mean over j, and S adds up over all links. Permutations of peers take e apart: into a part common to all, into
//! a_i·r + a_j·c with Σa = 0, and into parts in S alone. S is not below zero there, since S is not below zero for v = 0. With Σa² = 1, the sums over i ≠ j of
//! a_i², a_i·a_j and a_j² are N − 1, −1 and N − 1. So there are two inequalities:
//!
//! ```text
//! average:      V⁺ − ρ²V − (N−1)·S(e, v)                                                             heard: y + e
//! differences:  V⁺ − ρ²V − [(N−1)·R(r, r) − 2·R(r, c) + (N−1)·R(c, c)
//!                           + 2·T((N−1)·c − r, v) + (N−1)·U(v, v)]        heard: −y/(N−1) + r − c/(N−1)
//! ```
//!
//! with S = R(e, e) + 2·T(e, v) + U(v, v). Their size does not depend on N. Links that act all together are a special case, and this case gives the lower
//! bound; between the two the growth stays open.
//!
//! Rows of the second inequality are composed of rows of a frame; [`Composed`] bounds their errors.

use cohaptic_scene::Scene;
use cohaptic_stability::frames::{Autonomous, Combination, Event, FrameMap, Lifted, NominalNetwork, Structure, Timetable};
use cohaptic_stability::numerics::real;
use cohaptic_stability::{AnalysisError, Matrix, PartKind, Watch};

use super::channel::{Channel, Symbol};
use super::composed::Composed;
use super::error::SceneWorstCaseError;
use super::part::{WorstPart, of_combination};
use super::patterns::{Links, Patterns};
use super::prepared::Prepared;
use crate::inequality::{Inequality, Part, Product, Row, holds, search};
use crate::newton::upper;
use crate::worst_case::gripenberg::Effort;

/// Relative distance of the bound from the least growth with a certificate at the end of the halving.
const NEAR: f64 = 2e-3;
/// Largest growth per step in the search for a certificate.
const LARGEST: f64 = 4.0;
/// Largest number of states of a link.
const MOST_STATES: usize = 64;

/// Returns bounds for at least three equal peers; `None` if the peers are not all equal, are fewer, or a link has too many states.
pub(super) fn bounds(
    scene: &Scene,
    network: &NominalNetwork,
    combination: &Combination,
    patterns: &Patterns,
    (effort, watch): (&Effort, &dyn Watch),
) -> Result<Option<Vec<WorstPart>>, SceneWorstCaseError> {
    let structure = Structure::of(&[scene], network, &combination.contacts)?;
    if structure.classes.len() != 1 || structure.peers < 3 {
        return Ok(None);
    }
    let together = Patterns { links: Links::Together, ..*patterns };
    let Prepared { channels, .. } = Prepared::of(scene, network, &structure, &together)?;
    let Some(link) = Link::of(&channels[0]) else { return Ok(None) };
    let mut parts = of_combination(scene, network, combination, &together, (effort, watch))?;
    let nodes = structure.nodes(scene);
    let unit = Matrix::identity(1);
    let timetable = link.timetable(&structure.timetable);
    // The sample of each stretch is an input here, so the single node hears itself with the weight 1, and the weights of peers enter through the rows.
    let one = |tied: bool| Lifted { nodes: &nodes, weights: &unit, timetable: &timetable, tied, ..structure.quotient(scene, &nodes) };
    let frames = [one(structure.tied).frame(&mut Autonomous), one(true).frame(&mut Autonomous)];
    let is_loose = |part: &WorstPart| matches!(part.kind, PartKind::LooseDevice { .. });
    let worst = parts.iter().filter(|part| !is_loose(part)).max_by(|one, other| one.lower.total_cmp(&other.lower)).cloned();
    let Some(worst) = worst else { return Ok(None) };
    let certified = |rate: f64| {
        let asked = link.inequality(&frames, real(structure.peers), rate);
        search(&asked, watch, |solution| holds(&asked, solution).then_some(())).is_some()
    };
    let upper = least(worst.lower, certified, watch).ok_or(AnalysisError::Stopped)?;
    // Both inequalities share the multipliers of S, so one search covers the average and the differences.
    let dimension = frames.iter().map(|frame| frame.state_unknowns() + link.depth).sum();
    let rounding = frames.iter().map(|frame| frame.error).fold(0.0, f64::max);
    parts.retain(is_loose);
    parts.insert(0, WorstPart { kind: PartKind::Whole, dimension, upper, certificate: upper.is_finite().then_some(upper), rounding, ..worst });
    Ok(Some(parts))
}

/// Returns nearly the least growth with a certificate; infinite if no growth up to the largest has a certificate, and `None` if the watch ends the search.
fn least(lower: f64, certified: impl Fn(f64) -> bool, watch: &dyn Watch) -> Option<f64> {
    let (mut low, mut high) = (lower, f64::INFINITY);
    // The lower bound has no certificate below it, so the search goes upward from there, and then halves.
    let mut tried = lower.max(0.01) * 1.05;
    while high.is_infinite() && tried < LARGEST {
        if certified(tried) {
            high = tried;
        } else {
            (low, tried) = (tried, tried * 1.15);
        }
        if watch.stops() {
            return None;
        }
    }
    while high.is_finite() && high > low * (1.0 + NEAR) {
        let middle = 0.5 * (low + high);
        if certified(middle) {
            high = middle
        } else {
            low = middle
        }
        if watch.stops() {
            return None;
        }
    }
    Some(high)
}

/// The ages of possibly delivered samples of a link, as states and steps.
struct Link {
    /// First tick of each stretch.
    stretches: Vec<usize>,
    /// Age in frames of the sample heard in each stretch if every sample arrives as soon as possible.
    nominal: Vec<usize>,
    /// Steps: the state before, the state after, and the age in frames of the sample heard in each stretch.
    steps: Vec<(usize, usize, Vec<usize>)>,
    /// Number of states.
    states: usize,
    /// Largest age heard, in frames.
    depth: usize,
}

impl Link {
    /// Returns the link of a channel, or `None` if the link has too many states.
    fn of(channel: &Channel) -> Option<Self> {
        let age = channel.links[0].age;
        let ticks = |symbol: &Symbol| symbol.late[0].into_iter().chain(symbol.now[0]).collect::<Vec<_>>();
        let mut stretches: Vec<usize> = channel.symbols.iter().flat_map(ticks).chain([0]).collect();
        stretches.sort_unstable();
        stretches.dedup();
        // Before the first possible arrival of this frame's sample even the fastest link still gives the sample of the frame before.
        let first = channel.symbols.iter().filter_map(|symbol| symbol.now[0]).min()?;
        let nominal = stretches.iter().map(|tick| if *tick < first { age + 1 } else { age }).collect();
        // A state of the link is a node of the pattern, with the age of the sample held when a frame begins.
        let mut states = vec![(0, age + 1)];
        let mut steps = Vec::new();
        let mut done = 0;
        // Breadth-first search over the reachable states. A held sample grows older by a frame per lost frame, so the states are finitely many.
        while done < states.len() && done < MOST_STATES {
            let (node, held) = states[done];
            for edge in channel.pattern.edges().iter().filter(|edge| edge.from == node) {
                let symbol = &channel.symbols[edge.symbol];
                let heard = |tick: usize| {
                    let since = |arrival: Option<usize>| arrival.is_some_and(|arrival| arrival <= tick);
                    if since(symbol.now[0]) {
                        age
                    } else if since(symbol.late[0]) {
                        age + 1
                    } else {
                        held
                    }
                };
                let next = (edge.to, heard(usize::MAX) + 1);
                let place = states.iter().position(|state| *state == next).unwrap_or(states.len());
                if place == states.len() {
                    states.push(next);
                }
                steps.push((done, place, stretches.iter().map(|tick| heard(*tick)).collect::<Vec<_>>()));
            }
            done += 1;
        }
        let depth = steps.iter().flat_map(|(_, _, ages)| ages.iter().copied()).chain([age + 1]).max()?;
        (states.len() <= MOST_STATES).then_some(Self { stretches, nominal, steps, states: states.len(), depth })
    }

    /// Returns the timetable of one node with a different heard sample in each stretch: number −1 in the first stretch, −2 in the second, and so on.
    fn timetable(&self, nominal: &Timetable) -> Timetable {
        let (mut events, mut tick) = (Vec::new(), 0);
        for event in &nominal.events {
            match event {
                Event::Deliver { .. } => {}
                Event::Sample { .. } => events.push(*event),
                Event::Tick { .. } => {
                    let stretch = self.stretches.iter().position(|first| *first == tick);
                    events.extend(stretch.map(|stretch| Event::Deliver { from: 0, to: 0, sample: -(i64::try_from(stretch).unwrap_or(0) + 1) }));
                    events.push(*event);
                    tick += 1;
                }
            }
        }
        Timetable { frame: nominal.frame, events, sent: nominal.sent.clone(), depth: vec![0], held: Vec::new(), clocks: nominal.clocks.clone() }
    }

    /// Returns the inequalities for a growth per step of at most `rate`.
    fn inequality(&self, frames: &[FrameMap; 2], peers: f64, rate: f64) -> Inequality {
        let (stretches, steps) = (self.stretches.len(), self.depth);
        let size = stretches + steps;
        let parts = frames.iter().enumerate().map(|(place, frame)| self.part(frame, place, peers, rate));
        let mut shapes: Vec<usize> = frames.iter().map(|frame| frame.state_unknowns() + self.depth).collect();
        let links = self.steps.iter().map(|(from, to, ages)| {
            // The unknowns are the differences v between successive samples, of this frame and of earlier frames, newest first.
            let mut part = Part { unknowns: steps + 1, ..Part::empty(2 + from, 2 + to) };
            let mut put = |entries: Vec<f64>| part.put(Row { entries, error: 0.0 });
            let unit = |place: usize, by: f64| (0..=steps).map(|other| if other == place { by } else { 0.0 }).collect::<Vec<f64>>();
            // The sample of age a differs from the nominal sample by the sum of the steps between the two, with a negative sign.
            let deviation = |(age, nominal): (&usize, &usize)| {
                (0..=steps).map(|step| if (*nominal..*age).contains(&step) { -1.0 } else { 0.0 }).collect::<Vec<f64>>()
            };
            let rows: Vec<usize> =
                ages.iter().zip(&self.nominal).map(deviation).chain((0..steps).map(|step| unit(step, 1.0))).map(&mut put).collect();
            let before = (1..=steps).map(|step| put(unit(step, rate))).collect();
            part.after.rows = rows[stretches..].to_vec();
            part.before.rows = before;
            part.products = upper(size)
                .enumerate()
                .map(|(multiplier, (i, j))| Product { factors: [rows[i], rows[j]], multiplier, weight: twice(i, j) })
                .collect();
            part
        });
        let parts = parts.chain(links).collect();
        shapes.extend(std::iter::repeat_n(steps, self.states));
        Inequality { shapes, parts, free: vec![true; size * (size + 1) / 2] }
    }

    /// Returns the inequality of the average (`place` 0) or of the differences (`place` 1).
    fn part(&self, frame: &FrameMap, place: usize, peers: f64, rate: f64) -> Part {
        let (others, stretches) = (peers - 1.0, self.stretches.len());
        let apart = place == 1;
        let states = frame.state_unknowns();
        // The unknowns are the states, the samples sent before, and e. The differences have r and c instead of e.
        let inputs = states + self.depth;
        let unknowns = inputs + if apart { 2 * stretches } else { stretches };
        let unit = |place: usize, by: f64| -> Vec<f64> { (0..unknowns).map(|other| if other == place { by } else { 0.0 }).collect() };
        let mut heard: Vec<Composed> = Vec::new();
        // Composes a row of the frame. Sample −k of the frame is the sample heard in stretch k − 1.
        let composed = |row: &[f64], heard: &[Composed]| {
            let rows: Vec<Option<&Composed>> = frame.used.iter().map(|(_, age)| heard.get(age - 1)).collect();
            Composed::of(row, states, &rows, unknowns, frame.error)
        };
        let sent = frame.sent_by(0).start;
        let own = if apart { -1.0 / others } else { 1.0 };
        for (stretch, age) in self.nominal.iter().enumerate() {
            // A sample sent in this frame depends only on samples heard before, and their rows are in `heard` already.
            let sample = if *age == 0 { composed(frame.sent.row(sent), &heard) } else { Composed::exact(unit(states + age - 1, 1.0)) };
            let by_others = apart.then_some((inputs + stretches + stretch, -1.0 / others));
            heard.push(sample.heard(own, inputs + stretch, by_others));
        }
        let reference = frame.reference().map(|row| composed(frame.states.row(row), &heard));
        let moved = |row: Composed, by: f64| reference.as_ref().map_or_else(|| row.clone(), |reference| row.less(reference, by));
        let mut part = Part { unknowns, ..Part::empty(place, place) };
        let put = |part: &mut Part, Composed { entries, error }: Composed| part.put(Row { entries, error });
        let kept = (0..frame.states.rows()).filter(|row| Some(*row) != frame.reference());
        for (state, row) in kept.enumerate() {
            let after = put(&mut part, moved(composed(frame.states.row(row), &heard), frame.displacement(row)));
            let before = part.put(Row { entries: unit(state, rate), error: 0.0 });
            part.after.rows.push(after);
            part.before.rows.push(before);
        }
        let newest = composed(frame.sent.row(sent), &heard);
        let sample = |age: usize| if age == 0 { newest.clone() } else { Composed::exact(unit(states + age - 1, 1.0)) };
        for age in 0..self.depth {
            let after = put(&mut part, moved(sample(age), frame.translation(1)));
            let before = part.put(Row { entries: unit(states + age, rate), error: 0.0 });
            part.after.rows.push(after);
            part.before.rows.push(before);
        }
        // The quadratic forms of the links measure the steps v from sample to sample, newest first.
        let steps: Vec<usize> = (0..self.depth).map(|age| put(&mut part, sample(age).less(&sample(age + 1), 1.0))).collect();
        let input = |part: &mut Part, first: usize, stretch: usize| part.put(Row { entries: unit(first + stretch, 1.0), error: 0.0 });
        let e: Vec<usize> = (0..stretches).map(|stretch| input(&mut part, inputs, stretch)).collect();
        let c: Vec<usize> = if apart { (0..stretches).map(|stretch| input(&mut part, inputs + stretches, stretch)).collect() } else { Vec::new() };
        for (multiplier, (i, j)) in upper(stretches + steps.len()).enumerate() {
            let by = twice(i, j);
            let mut add =
                |one: usize, other: usize, weight: f64| part.products.push(Product { factors: [one, other], multiplier, weight: -by * weight });
            // The terms of the two inequalities of the module head: R for (e, e), T for (e, v) and U for (v, v).
            match (i < stretches, j < stretches) {
                (true, true) if apart => {
                    add(e[i], e[j], others);
                    add(e[i], c[j], -1.0);
                    add(e[j], c[i], -1.0);
                    add(c[i], c[j], others);
                }
                (true, true) => add(e[i], e[j], others),
                (true, false) if apart => {
                    add(e[i], steps[j - stretches], -1.0);
                    add(c[i], steps[j - stretches], others);
                }
                (true, false) => add(e[i], steps[j - stretches], others),
                _ => add(steps[i - stretches], steps[j - stretches], others),
            }
        }
        part
    }
}

/// Returns how often an entry of the upper triangle occurs in a symmetric matrix.
fn twice(i: usize, j: usize) -> f64 {
    if i == j { 1.0 } else { 2.0 }
}
