//! Every number of equal peers at once: spans of numbers are halved until each is [decided](super::growing). Of a span without end, the other end is N = 2⁵³, which is as far from the limit as a rounding, if there is
//! a limit.

use cohaptic_scene::Scene;

use super::certificate::{NumberCertificate, needed};
use super::growing::{ENDLESS, Growing, PartPlace};
use super::mean_square::GrowingMoments;
use super::{Guarantee, ProofError, Proven};
use crate::network::NominalNetwork;
use crate::pieces::refuse_topology;
use crate::{AnalysisError, Watch, has_chance};

/// Numbers of peers from one to another, ends included, of which one verdict holds.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct NumberSpan {
    /// The least.
    pub from: u64,
    /// The greatest; `None`: all beyond.
    pub to: Option<u64>,
    /// The verdict on each.
    pub guarantee: Guarantee,
}

/// The verdicts on all numbers of equal peers.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct EveryNumber {
    /// The first of the equal peers of which there are more and more, by its place in [`Scene::peers`].
    pub growing: usize,
    /// In order, without gaps; neighbours differ.
    pub spans: Vec<NumberSpan>,
    /// What grows or vanishes without a limit as N grows, in words.
    pub without_limit: Option<String>,
    /// How many certificates were looked for.
    pub attempts: u64,
    /// Whether they are verdicts in the mean square, since links lose.
    pub is_mean_square: bool,
    /// Whether all numbers were looked at, and the proof was not ended before.
    pub is_whole: bool,
    /// The spans as they were decided, of which neighbours may agree.
    pieces: Vec<NumberSpan>,
}

/// Where something has no limit, or numbers without end are not decided together, they are followed up to this.
pub const MOST_FOLLOWED: u64 = 100_000;
/// More certificates than this are not looked for.
const MOST_ATTEMPTS: u64 = 200_000;
/// Where this number of numbers in a row are undecided, each by itself, all others beyond are left so.
const MOST_OPEN: u64 = 64;

/// A scene that can be decided for every number of peers.
#[derive(Debug)]
pub struct NumberProof {
    network: NominalNetwork,
    growing: Growing,
    is_mean_square: bool,
    from: u64,
    to: Option<u64>,
    without_limit: Option<String>,
}

/// Decides a scene for every number of peers from `from` to `to`, or without end, as [`NumberProof`] does.
///
/// # Errors
///
/// Those of [`NumberProof::new`].
pub fn prove_every_number(scene: &Scene, from: u64, to: Option<u64>, watch: &dyn Watch) -> Result<EveryNumber, ProofError> {
    NumberProof::new(scene, from, to)?.prove(watch)
}

impl NumberProof {
    /// Of all numbers of peers from `from` to `to`, or without end, where the largest class of equal peers over equal links grows and all others stay as they are. How many of that class the scene
    /// itself has does not matter, but that there are two. Numbers for which none is left are passed over.
    ///
    /// # Errors
    ///
    /// [`ProofError`] if no two peers are equal, if something is not linear, or if links do something else at random than to lose independently.
    pub fn new(scene: &Scene, from: u64, to: Option<u64>) -> Result<Self, ProofError> {
        if from < 2 || to.is_some_and(|to| to < from) {
            return Err(ProofError::Numbers);
        }
        refuse_topology(scene, "the proof for every number of peers")?;
        let network = NominalNetwork::of(scene)?;
        let growing = Growing::new(scene, &network)?;
        if growing.has_waves() && has_chance(scene) {
            return Err(AnalysisError::OtherStrategy { strategy: scene.coordination.strategy.name() }.into());
        }
        if to.is_some_and(|to| to < growing.least) {
            return Err(ProofError::Fewer { least: growing.least });
        }
        let from = from.max(growing.least);
        let without_limit = if to.is_some() { None } else { growing.without_limit()? };
        let proof = Self { network, growing, is_mean_square: has_chance(scene), from, to, without_limit };
        proof.moments()?;
        Ok(proof)
    }

    /// In the mean square, over links that lose independently.
    fn moments(&self) -> Result<Option<GrowingMoments<'_>>, ProofError> {
        self.is_mean_square.then(|| GrowingMoments::new(&self.growing, &self.network)).transpose()
    }

    /// Decides all numbers, or what the watch leaves it time for. A span that is looked at is an operation of the watch.
    ///
    /// # Errors
    ///
    /// [`ProofError::Remembered`], [`ProofError::Drift`] or [`ProofError::Numerous`] of numbers that are no box.
    pub fn prove(&self, watch: &dyn Watch) -> Result<EveryNumber, ProofError> {
        let Self { growing, from, to, without_limit, .. } = self;
        let moments = self.moments()?;
        let end = match to {
            Some(to) => *to,
            None if without_limit.is_some() => MOST_FOLLOWED.max(*from),
            None => ENDLESS,
        };
        let decide = |low, high, stable: &mut Vec<PartPlace>| match &moments {
            None => growing.decide(low, high, stable, None),
            Some(moments) => moments.decide(low, high),
        };
        let is_unstable_beyond = |low| Ok(without_limit.is_some() && moments.is_none() && growing.is_unstable_beyond(low)?);
        let Search { mut pieces, attempts, is_whole } = search([*from, end, growing.least], watch, decide, is_unstable_beyond)?;
        if without_limit.is_some() && pieces.last().is_some_and(|last| last.to.is_some()) {
            let guarantee = if is_whole && is_unstable_beyond(end)? { Guarantee::Unstable } else { Guarantee::Undecided };
            pieces.push(NumberSpan { from: end + 1, to: None, guarantee });
        }
        let mut spans: Vec<NumberSpan> = Vec::new();
        for piece in &pieces {
            match spans.last_mut() {
                Some(last) if last.guarantee == piece.guarantee => last.to = piece.to,
                _ => spans.push(*piece),
            }
        }
        let without_limit = without_limit.clone();
        Ok(EveryNumber { growing: growing.first, spans, without_limit, attempts, is_mean_square: self.is_mean_square, is_whole, pieces })
    }
}

/// What comes out of a search.
struct Search {
    pieces: Vec<NumberSpan>,
    /// How many spans were looked at.
    attempts: u64,
    is_whole: bool,
}

/// Halves spans of numbers until each is decided, or has one number alone. `least` has not all parts of the motion that others have. Behind numbers that are unstable, all beyond are asked for at once.
fn search(
    [from, end, least]: [u64; 3],
    watch: &dyn Watch,
    decide: impl Fn(u64, u64, &mut Vec<PartPlace>) -> Result<Option<Proven>, ProofError>,
    is_unstable_beyond: impl Fn(u64) -> Result<bool, ProofError>,
) -> Result<Search, ProofError> {
    let (mut pieces, mut attempts, mut open, mut is_whole) = (Vec::new(), 0, 0, true);
    // From the least number on: an undecided span is halved, and the far half waits. Parts that are stable for all of its numbers are so for those of the halves.
    let mut waiting: Vec<(u64, u64, Vec<PartPlace>)> = vec![(from, end, Vec::new())];
    watch.expects(1.0);
    while let Some((low, high, mut stable)) = waiting.pop() {
        is_whole = is_whole && !watch.stops();
        if !is_whole {
            pieces.push(piece(low, high, None));
            continue;
        }
        attempts += 1;
        // The least number has no second member of the class that grows, and no differences within it.
        let is_mixed = low == least && high > low;
        let is_left = attempts > MOST_ATTEMPTS || open > MOST_OPEN;
        let is_behind_unstable = pieces.last().is_some_and(|last: &NumberSpan| last.guarantee == Guarantee::Unstable);
        if is_behind_unstable && high == end && low < high && is_unstable_beyond(low)? {
            pieces.push(NumberSpan { from: low, to: None, guarantee: Guarantee::Unstable });
            watch.done(1.0);
            continue;
        }
        let found = if is_left || is_mixed { None } else { decide(low, high, &mut stable)? };
        // Beyond the numbers that are followed, an end without a verdict is not halved: its limit may lie on the circle.
        let is_far = low > MOST_FOLLOWED && high == ENDLESS;
        if found.is_none() && low < high && !is_left && !is_far {
            let middle = if is_mixed {
                low
            } else if high / low > 4 {
                2 * low
            } else {
                low.midpoint(high)
            };
            waiting.push((middle + 1, high, stable.clone()));
            waiting.push((low, middle, stable));
            watch.expects(2.0);
            watch.done(1.0);
            continue;
        }
        open = if found.is_some() { 0 } else { open + 1 };
        pieces.push(piece(low, high, found));
        watch.done(1.0);
    }
    Ok(Search { pieces, attempts, is_whole })
}

fn piece(low: u64, high: u64, found: Option<Proven>) -> NumberSpan {
    NumberSpan { from: low, to: if high == ENDLESS { None } else { Some(high) }, guarantee: found.map_or(Guarantee::Undecided, Guarantee::from) }
}

impl EveryNumber {
    /// The spans that are decided with all by which they can be checked, halved as often as that takes, and the others. Of a span beyond all limits nothing can be checked, so that it counts as undecided there. Each is decided once more.
    ///
    /// # Errors
    ///
    /// As [`prove_every_number`], of the scene that was proven.
    pub fn certify(&self, scene: &Scene, watch: &dyn Watch) -> Result<Vec<NumberCertificate>, ProofError> {
        let network = NominalNetwork::of(scene)?;
        let growing = Growing::new(scene, &network)?;
        let moments = self.is_mean_square.then(|| GrowingMoments::new(&growing, &network)).transpose()?;
        let mut found = Vec::new();
        // An undecided span is halved, and the far half waits: with a certificate there is less room than without.
        let mut waiting: Vec<NumberSpan> = self.pieces.iter().rev().copied().collect();
        let mut open = 0;
        while let Some(NumberSpan { from, to, guarantee }) = waiting.pop() {
            if watch.stops() {
                return Err(ProofError::Analysis(AnalysisError::Stopped));
            }
            if to.is_none() && self.without_limit.is_some() && guarantee != Guarantee::Undecided && from <= MOST_FOLLOWED {
                waiting.push(NumberSpan { from: MOST_FOLLOWED + 1, to, guarantee });
                waiting.push(NumberSpan { from, to: Some(MOST_FOLLOWED), guarantee });
                continue;
            }
            let (mut parts, mut of_moments) = (Vec::new(), Vec::new());
            let is_open = guarantee == Guarantee::Undecided || to.is_none() && self.without_limit.is_some() || open > MOST_OPEN;
            let end = to.unwrap_or(ENDLESS);
            let proven = match &moments {
                _ if is_open => None,
                None => growing.decide(from, end, &mut Vec::new(), Some(&mut parts))?,
                Some(moments) => moments.certify(from, end)?.map(|(proven, moments)| {
                    of_moments = moments;
                    proven
                }),
            };
            if proven.is_none() && !is_open && from < end {
                let middle = if end / from > 4 { 2 * from } else { from.midpoint(end) };
                waiting.push(NumberSpan { from: middle + 1, to, guarantee });
                waiting.push(NumberSpan { from, to: Some(middle), guarantee });
                continue;
            }
            open = if proven.is_some() { 0 } else { open + 1 };
            let guarantee = proven.map_or(Guarantee::Undecided, Guarantee::from);
            found.push(NumberCertificate { from, to, guarantee, parts: needed(proven, parts), moments: of_moments });
        }
        Ok(found)
    }
}
