//! Every number of equal peers at once: spans of numbers are halved until each is [decided](super::growing). Of a span without end, the other end is N = 2⁵³, which is as far from the limit as a rounding, if there is
//! a limit.

use cohaptic_scene::Scene;

use super::certificate::{NumberCertificate, needed};
use super::growing::{ENDLESS, Growing};
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
    /// The spans as they were decided, of which neighbours may agree.
    pieces: Vec<NumberSpan>,
}

/// Where nothing has a limit, numbers are followed up to this.
pub const MOST_FOLLOWED: u64 = 100_000;
/// More certificates than this are not looked for.
const MOST_ATTEMPTS: u64 = 200_000;
/// Where this number of numbers in a row are undecided, each by itself, all others beyond are left so.
const MOST_OPEN: u64 = 64;

/// Decides a scene for every number of peers from `from` to `to`, or without end, where the largest class of equal peers over equal links grows and all others stay as they are. How many of that class the scene
/// itself has does not matter, but that there are two. Numbers for which none is left are passed over. Over links that lose independently it is decided in the mean square.
///
/// # Errors
///
/// [`ProofError`] if no two peers are equal, if something is not linear, if links do something else at random than to lose independently, or if the watch ends it.
pub fn prove_every_number(scene: &Scene, from: u64, to: Option<u64>, watch: &dyn Watch) -> Result<EveryNumber, ProofError> {
    if from < 2 || to.is_some_and(|to| to < from) {
        return Err(ProofError::Numbers);
    }
    refuse_topology(scene, "the proof for every number of peers")?;
    let network = NominalNetwork::of(scene)?;
    let growing = Growing::new(scene, &network)?;
    let moments = has_chance(scene).then(|| GrowingMoments::new(&growing, &network)).transpose()?;
    if to.is_some_and(|to| to < growing.least) {
        return Err(ProofError::Fewer { least: growing.least });
    }
    let from = from.max(growing.least);
    let without_limit = if to.is_some() { None } else { growing.without_limit()? };
    let end = match to {
        Some(to) => to,
        None if without_limit.is_some() => MOST_FOLLOWED.max(from),
        None => ENDLESS,
    };
    let decide = |low, high| moments.as_ref().map_or_else(|| growing.decide(low, high, None), |moments| moments.decide(low, high));
    let (mut pieces, attempts) = search(from, end, growing.least, watch, decide)?;
    if without_limit.is_some() {
        let guarantee = if moments.is_none() && growing.is_unstable_beyond(end)? { Guarantee::Unstable } else { Guarantee::Undecided };
        pieces.push(NumberSpan { from: end + 1, to: None, guarantee });
    }
    let mut spans: Vec<NumberSpan> = Vec::new();
    for piece in &pieces {
        match spans.last_mut() {
            Some(last) if last.guarantee == piece.guarantee => last.to = piece.to,
            _ => spans.push(*piece),
        }
    }
    Ok(EveryNumber { growing: growing.first, spans, without_limit, attempts, is_mean_square: moments.is_some(), pieces })
}

/// Halves spans of numbers until each is decided, or has one number alone; also says how often it was tried. `least` has not all parts of the motion that others have.
fn search(
    from: u64,
    end: u64,
    least: u64,
    watch: &dyn Watch,
    decide: impl Fn(u64, u64) -> Result<Option<Proven>, ProofError>,
) -> Result<(Vec<NumberSpan>, u64), ProofError> {
    let (mut pieces, mut attempts, mut open) = (Vec::new(), 0, 0);
    // From the least number on: an undecided span is halved, and the far half waits.
    let mut waiting = vec![(from, end)];
    while let Some((low, high)) = waiting.pop() {
        if watch.stops() {
            return Err(ProofError::Analysis(AnalysisError::Stopped));
        }
        attempts += 1;
        // The least number has no second member of the class that grows, and no differences within it.
        let is_mixed = low == least && high > low;
        let is_left = attempts > MOST_ATTEMPTS || open > MOST_OPEN;
        let found = if is_left || is_mixed { None } else { decide(low, high)? };
        if found.is_none() && low < high && !is_left {
            let middle = if is_mixed {
                low
            } else if high / low > 4 {
                2 * low
            } else {
                low.midpoint(high)
            };
            waiting.push((middle + 1, high));
            waiting.push((low, middle));
            continue;
        }
        open = if found.is_some() { 0 } else { open + 1 };
        let guarantee = found.map_or(Guarantee::Undecided, Guarantee::from);
        pieces.push(NumberSpan { from: low, to: if high == ENDLESS { None } else { Some(high) }, guarantee });
    }
    Ok((pieces, attempts))
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
        while let Some(NumberSpan { from, to, guarantee }) = waiting.pop() {
            if watch.stops() {
                return Err(ProofError::Analysis(AnalysisError::Stopped));
            }
            let (mut parts, mut of_moments) = (Vec::new(), Vec::new());
            let is_open = guarantee == Guarantee::Undecided || to.is_none() && self.without_limit.is_some();
            let end = to.unwrap_or(ENDLESS);
            let proven = match &moments {
                _ if is_open => None,
                None => growing.decide(from, end, Some(&mut parts))?,
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
            let guarantee = proven.map_or(Guarantee::Undecided, Guarantee::from);
            found.push(NumberCertificate { from, to, guarantee, parts: needed(proven, parts), moments: of_moments });
        }
        Ok(found)
    }
}
