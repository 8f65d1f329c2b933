//! Every number of equal peers at once: spans of numbers are halved until each is [decided](super::growing). A span without end ends at N = 2⁵³,
//! as far from the limit as a rounding, if there is a limit.

use cohaptic_scene::Scene;
use cohaptic_stability::frames::{NominalNetwork, refuse_slow_devices, refuse_topology};
use cohaptic_stability::{AnalysisError, Watch, has_chance};

use super::certificate::{NumberCertificate, needed, refuse_certificate};
use super::error::ProofError;
use super::growing::{ENDLESS, Growing, PartPlace};
use super::guarantee::{Guarantee, Proven};
use super::mean_square::GrowingMoments;

/// Span of numbers of peers, ends included, with one verdict.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct NumberSpan {
    /// Least number of peers.
    pub from: u64,
    /// Greatest number of peers; `None`: the span has no end.
    pub to: Option<u64>,
    /// Verdict on every number of the span.
    pub guarantee: Guarantee,
}

/// Reason why a span of numbers is undecided.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Openness {
    /// The watch ended the proof before all numbers were looked at.
    Ended,
    /// A number of the scene has no limit as N grows, and the span lies beyond [`MOST_FOLLOWED`].
    Beyond,
    /// No second moment was found for a verdict on the first number of the span.
    Moment,
    /// A frame of the first number of the span has eigenvalues nearer to the unit circle, or to each other, than the bounds of the frame tell apart.
    Near(Nearness),
    /// The first number of the span is stable, but a frame of the limit, as N grows, has eigenvalues too near to the unit circle or to each other, as in
    /// [`Openness::Near`].
    Limit(Nearness),
    /// The search reached its largest number of attempts, or too many numbers in a row stayed undecided.
    Exhausted,
}

/// Size and uncertainty of a frame without a decision by eigenvalues.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Nearness {
    /// Approximate modulus of the largest eigenvalue over all parts without a proof of stability.
    pub radius: f64,
    /// Largest bound of the error of an entry over all parts without a proof of stability; infinite if an entry or a bound is not finite.
    pub bound: f64,
}

/// Verdicts on all numbers of equal peers.
#[derive(Clone, PartialEq, Debug)]
pub struct EveryNumber {
    /// Place in [`Scene::peers`] of the first peer of the growing class.
    pub growing: usize,
    /// Spans in ascending order, without gaps. Neighbours have different verdicts.
    pub spans: Vec<NumberSpan>,
    /// Reason for each undecided span of `spans`, in the order of the undecided spans.
    pub open: Vec<Openness>,
    /// The number of the scene with unlimited growth or fall as N grows, in words; `None` if every number has a limit, or the proof has a last number
    /// of peers.
    pub without_limit: Option<String>,
    /// Number of spans looked at, spans halved afterwards included.
    pub attempts: u64,
    /// `true` if the verdicts are about the mean square, because links lose.
    pub is_mean_square: bool,
    /// `true` if the watch let the proof look at all numbers. Otherwise the remaining numbers are undecided too.
    pub is_whole: bool,
    /// Spans as decided, before neighbours with the same verdict were joined.
    pieces: Vec<NumberSpan>,
}

/// Largest followed number of peers if a number of the scene has no limit, or if the numbers beyond are not decided together.
pub const MOST_FOLLOWED: u64 = 100_000;
/// Largest number of spans of a search.
const MOST_ATTEMPTS: u64 = 200_000;
/// Number of undecided pieces in a row after which all numbers beyond are left undecided.
const MOST_OPEN: u64 = 64;

/// Scene prepared for a decision for every number of peers.
#[derive(Debug)]
pub struct NumberProof {
    network: NominalNetwork,
    growing: Growing,
    is_mean_square: bool,
    from: u64,
    to: Option<u64>,
    without_limit: Option<String>,
}

/// Decides a scene for every number of peers from `from` to `to`, or without end. Shorthand for [`NumberProof::new`] and [`NumberProof::prove`].
///
/// # Errors
///
/// [`ProofError`] for the reasons of [`NumberProof::new`] and of [`NumberProof::prove`].
pub fn prove_every_number(scene: &Scene, from: u64, to: Option<u64>, watch: &dyn Watch) -> Result<EveryNumber, ProofError> {
    NumberProof::new(scene, from, to)?.prove(watch)
}

impl NumberProof {
    /// Prepares the proof for all numbers of peers from `from` to `to`, or without end. The largest class of equal peers over equal links grows, and all other
    /// classes stay as they are. The scene itself needs two peers of the class; more peers do not change the result. Numbers without a peer in the class are
    /// passed over.
    ///
    /// # Errors
    ///
    /// [`ProofError`] if `from` is below 2 or above `to`, if no two peers are equal, if a law is not linear, or if links are random otherwise than by
    /// independent losses.
    pub fn new(scene: &Scene, from: u64, to: Option<u64>) -> Result<Self, ProofError> {
        if from < 2 || to.is_some_and(|to| to < from) {
            return Err(ProofError::Numbers);
        }
        refuse_topology(scene, "the proof for every number of peers")?;
        if has_chance(scene) {
            refuse_slow_devices(scene, "the mean square")?;
        }
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

    /// Returns the second moments of the scene if its links lose independently; `None` if the scene leaves nothing to chance.
    fn moments(&self) -> Result<Option<GrowingMoments<'_>>, ProofError> {
        self.is_mean_square.then(|| GrowingMoments::new(&self.growing, &self.network)).transpose()
    }

    /// Decides all numbers, or as many as the watch leaves time for. Each span looked at is an operation of the watch.
    ///
    /// # Errors
    ///
    /// [`ProofError::Remembered`], [`ProofError::Drift`] or [`ProofError::Numerous`] if a span of numbers of peers is no box of the numbers in the steps.
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
        // Without a limit the search ends at `MOST_FOLLOWED`, so the span from there without end is decided separately.
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

    /// Returns the reason why a span is undecided. `is_whole`: the proof has looked at all numbers.
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

/// Result of a search: the spans with their verdicts, in ascending order and without gaps.
struct Search {
    pieces: Vec<NumberSpan>,
    /// Number of spans looked at.
    attempts: u64,
    is_whole: bool,
}

/// Halves spans of numbers until each is decided, or holds a single number. The number `least` lacks some parts of the motion of larger numbers, so `least`
/// is a separate span. After an unstable span `is_unstable_beyond` is asked about all numbers beyond at once.
fn search(
    [from, end, least]: [u64; 3],
    watch: &dyn Watch,
    decide: impl Fn(u64, u64, &mut Vec<PartPlace>) -> Result<Option<Proven>, ProofError>,
    is_unstable_beyond: impl Fn(u64) -> Result<bool, ProofError>,
) -> Result<Search, ProofError> {
    let (mut pieces, mut attempts, mut open, mut is_whole) = (Vec::new(), 0, 0, true);
    // Spans are taken in ascending order: an undecided span is halved, and the far half waits. Parts stable for all numbers of a span are stable for
    // the numbers of both halves too, and are not decided again.
    let mut waiting: Vec<(u64, u64, Vec<PartPlace>)> = vec![(from, end, Vec::new())];
    watch.expects(1.0);
    while let Some((low, high, mut stable)) = waiting.pop() {
        is_whole = is_whole && !watch.stops();
        if !is_whole {
            pieces.push(piece(low, high, None));
            continue;
        }
        attempts += 1;
        // At the least number the growing class has one member, hence no differences within the class.
        let is_mixed = low == least && high > low;
        let is_left = attempts > MOST_ATTEMPTS || open > MOST_OPEN;
        let is_behind_unstable = pieces.last().is_some_and(|last: &NumberSpan| last.guarantee == Guarantee::Unstable);
        if is_behind_unstable && high == end && low < high && is_unstable_beyond(low)? {
            pieces.push(NumberSpan { from: low, to: None, guarantee: Guarantee::Unstable });
            watch.done(1.0);
            continue;
        }
        let found = if is_left || is_mixed { None } else { decide(low, high, &mut stable)? };
        // Beyond the followed numbers, an undecided span without end is not halved: an eigenvalue of the limit may lie on the unit circle.
        let is_far = low > MOST_FOLLOWED && high == ENDLESS;
        if found.is_none() && low < high && !is_left && !is_far {
            // ν = 1/(N − 1) sets the size of a box. Long spans are divided near the low end, where ν changes most; short spans in the middle.
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
    /// Returns the ranges of numbers with a verdict here and without a verdict in the certificate, as first and last number (`None`: without end) in ascending
    /// order.
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
            // Neighbouring ranges are joined, so that the message lists few.
            let to = Some(to).filter(|to| *to < u64::MAX);
            match found.last_mut() {
                Some(before) if before.1.is_some_and(|end| end + 1 == from) => before.1 = to,
                _ => found.push((from, to)),
            }
        }
        found
    }

    /// Returns all spans, the decided spans with the numbers for a check of the verdicts. Each span is decided once more, and is halved as often as
    /// the wider bounds of the checker require. The verdict on a span without end cannot be checked if a number of the scene has no limit: such a span is
    /// undecided in the certificate.
    ///
    /// # Errors
    ///
    /// [`ProofError`] if the watch ends the certification, if a device exchanges late or not at each tick, and for the reasons of [`prove_every_number`] if
    /// `scene` is not the proven scene.
    pub fn certify(&self, scene: &Scene, watch: &dyn Watch) -> Result<Vec<NumberCertificate>, ProofError> {
        refuse_certificate(scene)?;
        let network = NominalNetwork::of(scene)?;
        let growing = Growing::new(scene, &network)?;
        let moments = self.is_mean_square.then(|| GrowingMoments::new(&growing, &network)).transpose()?;
        let mut found = Vec::new();
        // A span without a verdict under the wider bounds of a certificate is halved, and the far half waits.
        let mut waiting: Vec<NumberSpan> = self.pieces.iter().rev().copied().collect();
        let mut open = 0;
        while let Some(NumberSpan { from, to, guarantee }) = waiting.pop() {
            if watch.stops() {
                return Err(ProofError::Analysis(AnalysisError::Stopped));
            }
            // A span with a verdict by growth beyond all limits is cut at `MOST_FOLLOWED`: the numbers up to there can be certified one span after another.
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

    /// The numbers up to 9 are stable one by one, the numbers from 10 on are unstable in spans that end below 1000, and from 70 on all numbers beyond are
    /// unstable at once. Every number then lies in exactly one piece.
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
