//! Every number of equal peers at once: spans of numbers are halved until each is [decided](super::growing). Of a span without end, the other end is N = 2⁵³,
//! which is as far from the limit as a rounding, if there is a limit.

use cohaptic_scene::Scene;
use cohaptic_stability::frames::{NominalNetwork, refuse_topology};
use cohaptic_stability::{AnalysisError, Watch, has_chance};

use super::certificate::{NumberCertificate, needed};
use super::error::ProofError;
use super::growing::{ENDLESS, Growing, PartPlace};
use super::guarantee::{Guarantee, Proven};
use super::mean_square::GrowingMoments;

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

/// Why numbers are undecided.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Openness {
    /// The proof was ended before it had looked at them all.
    Ended,
    /// Something has no limit, and they are beyond [`MOST_FOLLOWED`].
    Beyond,
    /// No second moment was found that shows a verdict on the first of them.
    Moment,
    /// A frame of the first of them has eigenvalues that are nearer to the unit circle, or to each other, than its bounds tell apart.
    Near(Nearness),
    /// The first of them is stable; a frame of the limit, as N grows, has such eigenvalues.
    Limit(Nearness),
    /// More certificates were looked for than a search may.
    Exhausted,
}

/// How far a frame is known whose eigenvalues decide nothing.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Nearness {
    /// The size of the largest eigenvalue of a part that is not proven stable, nearly.
    pub radius: f64,
    /// The largest bound of an entry of such a part; infinite if an entry or a bound is no finite number.
    pub bound: f64,
}

/// The verdicts on all numbers of equal peers.
#[derive(Clone, PartialEq, Debug)]
pub struct EveryNumber {
    /// The first of the equal peers of which there are more and more, by its place in [`Scene::peers`].
    pub growing: usize,
    /// In order, without gaps; neighbours differ.
    pub spans: Vec<NumberSpan>,
    /// Why each of the undecided ones among them is, in their order.
    pub open: Vec<Openness>,
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
    /// Of all numbers of peers from `from` to `to`, or without end, where the largest class of equal peers over equal links grows and all others stay as they
    /// are. How many of that class the scene itself has does not matter, but that there are two. Numbers for which none is left are passed over.
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
        let undecided = spans.iter().filter(|span| span.guarantee == Guarantee::Undecided);
        let open = undecided.map(|span| self.openness(span, is_whole)).collect::<Result<_, ProofError>>()?;
        let without_limit = without_limit.clone();
        Ok(EveryNumber { growing: growing.first, spans, open, without_limit, attempts, is_mean_square: self.is_mean_square, is_whole, pieces })
    }

    /// Why a span is undecided, of a proof that has looked at all numbers or not.
    fn openness(&self, span: &NumberSpan, is_whole: bool) -> Result<Openness, ProofError> {
        let nearness = |number| Ok::<_, ProofError>(self.growing.nearness(number)?.map(|[radius, bound]| Nearness { radius, bound }));
        Ok(match self {
            _ if !is_whole => Openness::Ended,
            Self { without_limit: Some(_), .. } if span.from > MOST_FOLLOWED => Openness::Beyond,
            Self { is_mean_square: true, .. } => Openness::Moment,
            _ => match (nearness(span.from)?, span.to) {
                (Some(near), _) => Openness::Near(near),
                (None, None) => nearness(ENDLESS)?.map_or(Openness::Exhausted, Openness::Limit),
                (None, Some(_)) => Openness::Exhausted,
            },
        })
    }
}

/// What comes out of a search.
struct Search {
    pieces: Vec<NumberSpan>,
    /// How many spans were looked at.
    attempts: u64,
    is_whole: bool,
}

/// Halves spans of numbers until each is decided, or has one number alone. `least` has not all parts of the motion that others have. Behind numbers that are
/// unstable, all beyond are asked for at once.
fn search(
    [from, end, least]: [u64; 3],
    watch: &dyn Watch,
    decide: impl Fn(u64, u64, &mut Vec<PartPlace>) -> Result<Option<Proven>, ProofError>,
    is_unstable_beyond: impl Fn(u64) -> Result<bool, ProofError>,
) -> Result<Search, ProofError> {
    let (mut pieces, mut attempts, mut open, mut is_whole) = (Vec::new(), 0, 0, true);
    // From the least number on: an undecided span is halved, and the far half waits. Parts that are stable for all of its numbers are so for those of the
    // halves.
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
    /// The numbers of which a certificate says nothing though they have a verdict, from where to where (`None`: without end), in order.
    #[must_use]
    pub fn uncertified(&self, certificate: &[NumberCertificate]) -> Vec<(u64, Option<u64>)> {
        let last = |to: Option<u64>| to.unwrap_or(u64::MAX);
        let mut found: Vec<(u64, Option<u64>)> = Vec::new();
        let open = certificate.iter().filter(|span| span.guarantee == Guarantee::Undecided);
        let decided = |open: &NumberCertificate| {
            let (from, to) = (open.from, last(open.to));
            let decided = self.spans.iter().filter(|span| span.guarantee != Guarantee::Undecided);
            decided.map(move |span| (span.from.max(from), last(span.to).min(to))).filter(|(from, to)| from <= to).collect::<Vec<_>>()
        };
        for (from, to) in open.flat_map(decided) {
            let to = Some(to).filter(|to| *to < u64::MAX);
            match found.last_mut() {
                Some(before) if before.1.is_some_and(|end| end + 1 == from) => before.1 = to,
                _ => found.push((from, to)),
            }
        }
        found
    }

    /// The spans that are decided with all by which they can be checked, halved as often as that takes, and the others. Of a span beyond all limits nothing can
    /// be checked, so that it counts as undecided there. Each is decided once more.
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

#[cfg(test)]
mod tests {
    use super::*;
    use cohaptic_stability::Unwatched;

    /// Numbers to 9 are stable one by one, from 10 on unstable in spans that end below 1000, and from 70 on all beyond at once: no number is left out, or twice
    /// in a piece.
    #[test]
    fn pieces_have_no_gaps() {
        let decide = |low: u64, high: u64, _: &mut Vec<PartPlace>| {
            Ok(match () {
                () if low >= 10 && high < 1000 => Some(Proven::Unstable),
                () if low == high && low < 10 => Some(Proven::Stable),
                () => None,
            })
        };
        let Search { pieces, is_whole, .. } = search([2, MOST_FOLLOWED, 2], &Unwatched, decide, |from| Ok(from >= 70)).unwrap();
        assert!(is_whole && pieces.iter().all(|piece| piece.guarantee != Guarantee::Undecided), "{pieces:?}");
        assert_eq!((pieces[0].from, pieces[pieces.len() - 1].to), (2, None));
        assert!(pieces.windows(2).all(|pair| pair[0].to.is_some_and(|end| end + 1 == pair[1].from)), "{pieces:?}");
        assert!(pieces[pieces.len() - 1].from >= 70 && pieces[pieces.len() - 2].guarantee == Guarantee::Unstable, "{pieces:?}");
    }
}
