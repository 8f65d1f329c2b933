//! When peers tick that have clocks of their own, in windows in which each ticks at most once.

use cohaptic_peer::Clock;
use cohaptic_units::Instant;

use crate::arrays::lanes::{Mask, WIDTH};

/// The next tick of each peer, and which peers tick in the present window.
#[derive(Clone, Debug)]
pub(super) struct Timetable {
    beats: Vec<Beat>,
    /// The peers in the order of their next ticks, at one instant in their own.
    order: Vec<usize>,
    /// The shortest span between two ticks of a peer \[ns\].
    shortest: u64,
    /// How many of them, from the first on, tick in the part of the window that was begun.
    ticking: usize,
    /// Where the window ends \[ns\].
    end: u64,
    /// Whether some peers tick in the window after that part.
    is_cut: bool,
    /// The peers whose step from their next tick takes the longer of two spans, by block of peers; empty if no clock drifts.
    are_long: Vec<Mask>,
}

/// The ticks of a peer: at offset + ⌊k·Tc·10⁹/(10⁹ + drift)⌋, as [`Clock::instant`] says, by adding.
#[derive(Clone, Copy, Debug)]
struct Beat {
    /// The next tick and its instant \[ns\]; the end of time if there is none.
    tick: u64,
    at: u64,
    /// The whole nanoseconds of Tc·10⁹/speed, the remainder, and that of the next instant.
    span: u64,
    remainder: u64,
    rest: u64,
    /// 10⁹ + drift.
    speed: u64,
}

impl Beat {
    fn new(clock: &Clock) -> Self {
        let speed = 1_000_000_000_u64.saturating_add_signed(clock.drift.parts_per_billion());
        let scaled = clock.tick.as_nanos() * 1_000_000_000;
        let narrow = |number: u128| u64::try_from(number).unwrap_or(u64::MAX);
        Self {
            tick: 0,
            at: clock.instant(0).map_or(u64::MAX, Instant::as_nanos),
            span: narrow(scaled / u128::from(speed)),
            remainder: narrow(scaled % u128::from(speed)),
            rest: 0,
            speed,
        }
    }

    /// Whether the step from the next tick is a nanosecond longer than others.
    fn is_long(&self) -> bool {
        self.rest + self.remainder >= self.speed
    }

    fn advance(&mut self) {
        self.tick += 1;
        let is_long = self.is_long();
        self.at = self.at.saturating_add(self.span + u64::from(is_long));
        self.rest = self.rest + self.remainder - if is_long { self.speed } else { 0 };
    }
}

impl Timetable {
    /// The first ticks of these clocks, before any window.
    pub(super) fn new(clocks: &[Clock]) -> Self {
        let beats: Vec<Beat> = clocks.iter().map(Beat::new).collect();
        let drifts = beats.iter().any(|beat| beat.remainder > 0);
        let mut timetable = Self {
            order: (0..beats.len()).collect(),
            shortest: beats.iter().map(|beat| beat.span).min().unwrap_or(1),
            ticking: 0,
            end: 0,
            is_cut: false,
            are_long: if drifts { vec![Mask::NONE; beats.len().div_ceil(WIDTH)] } else { Vec::new() },
            beats,
        };
        timetable.sort();
        timetable
    }

    /// The first tick of all that are to come.
    pub(super) fn next_instant(&self) -> Instant {
        self.order.first().map_or(Instant::MAX, |peer| self.instant(*peer))
    }

    /// The next tick of a peer, or its tick in the present window.
    pub(super) fn instant(&self, peer: usize) -> Instant {
        Instant::from_nanos(self.beats[peer].at)
    }

    /// A window from the next tick on, which ends before that instant and before any peer ticks twice; or the rest of one that was cut. It is cut after that
    /// number of instants of ticks. Gives its number of instants.
    pub(super) fn begin(&mut self, end: Instant, most: u32) -> u32 {
        let Self { beats, order, shortest, ticking, .. } = self;
        *ticking = 0;
        let at = |place: usize| order.get(place).map(|peer: &usize| beats[*peer].at);
        if !self.is_cut {
            self.end = at(0).unwrap_or(u64::MAX).saturating_add(*shortest).min(end.as_nanos());
        }
        self.is_cut = false;
        let (mut instants, mut latest) = (0, None);
        while let Some(now) = at(*ticking).filter(|now| *now < self.end) {
            if latest != Some(now) {
                if instants == most {
                    self.is_cut = true;
                    break;
                }
                (instants, latest) = (instants + 1, Some(now));
            }
            *ticking += 1;
        }
        instants
    }

    /// Whether some peers tick in the window after the part that was begun.
    pub(super) const fn is_cut(&self) -> bool {
        self.is_cut
    }

    /// Whether the next tick of a peer is one of the window.
    pub(super) fn ticks_now(&self, peer: usize) -> bool {
        self.beats[peer].at < self.end
    }

    /// The peers that tick in the window, in the order of their ticks, with their instants and the number of their ticks.
    pub(super) fn ticks(&self) -> impl DoubleEndedIterator<Item = (usize, Instant, u64)> + ExactSizeIterator + Clone {
        self.order[..self.ticking].iter().map(|peer| {
            let beat = &self.beats[*peer];
            (*peer, Instant::from_nanos(beat.at), beat.tick)
        })
    }

    /// The latest tick in the window.
    pub(super) fn latest(&self) -> Instant {
        self.ticks().next_back().map_or(Instant::ZERO, |(_, at, _)| at)
    }

    /// The peers that do not tick in the window.
    pub(super) fn resting(&self) -> &[usize] {
        &self.order[self.ticking..]
    }

    /// Writes down the peers that tick in the window, by block of peers.
    pub(super) fn write_masks(&self, masks: &mut Vec<Mask>) {
        masks.clear();
        masks.resize(self.beats.len().div_ceil(WIDTH), Mask::ALL);
        self.resting().iter().for_each(|peer| set(masks, *peer, self.beats.len(), false));
    }

    /// The peers whose step from the next tick is the longer one, by block of peers; empty if no clock drifts.
    pub(super) fn are_long(&self) -> &[Mask] {
        &self.are_long
    }

    /// The window is over.
    pub(super) fn end(&mut self) {
        let Self { beats, order, ticking, are_long, .. } = self;
        let peers = beats.len();
        for peer in &order[..*ticking] {
            beats[*peer].advance();
        }
        if !are_long.is_empty() {
            order[..*ticking].iter().for_each(|peer| set(are_long, *peer, peers, beats[*peer].is_long()));
        }
        if *ticking < order.len() {
            order.rotate_left(*ticking);
        }
        *ticking = 0;
        self.sort();
    }

    /// Mostly they are in order: peers come as they came before.
    fn sort(&mut self) {
        let Self { beats, order, .. } = self;
        let key = |peer: &usize| (beats[*peer].at, *peer);
        if !order.is_sorted_by_key(key) {
            order.sort_by_key(key);
        }
    }

    /// How many ticks the peer with the most has made.
    pub(super) fn most_ticks(&self) -> u64 {
        self.beats.iter().map(|beat| beat.tick).max().unwrap_or(0)
    }
}

/// Writes whether something is true of a peer; what lies beyond the last peer repeats it.
fn set(masks: &mut [Mask], peer: usize, peers: usize, holds: bool) {
    let last = if peer + 1 == peers { WIDTH } else { peer % WIDTH + 1 };
    (peer % WIDTH..last).for_each(|lane| masks[peer / WIDTH].set(lane, holds));
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use cohaptic_peer::Drift;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// No tick is left out, none comes twice, each comes at the instant that its clock says, and in order; within a window each peer ticks once at most.
        #[test]
        fn windows_have_all_ticks_of_all_clocks(
            clocks in proptest::collection::vec((1..3_000_000_u64, 0..9_000_000_u64, -100_000_000..100_000_000_i64), 1..20),
            most in 1..40_u32,
        ) {
            let clocks: Vec<Clock> = clocks.into_iter().map(|(tick, offset, drift)| {
                #[expect(clippy::cast_precision_loss, reason = "below 2^53")]
                let drift = Drift::from_fraction(drift as f64 * 1e-9).unwrap();
                Clock { tick: Duration::from_nanos(tick + 1), offset: Duration::from_nanos(offset), drift }
            }).collect();
            let mut timetable = Timetable::new(&clocks);
            let mut found = Vec::new();
            for _ in 0..50 {
                let instants = timetable.begin(Instant::MAX, most);
                let mut peers: Vec<usize> = timetable.ticks().map(|(peer, ..)| peer).collect();
                let mut times: Vec<Instant> = timetable.ticks().map(|(_, at, _)| at).collect();
                for (peer, at, tick) in timetable.ticks() {
                    prop_assert_eq!(clocks[peer].instant(tick), Some(at));
                    let (short, long) = clocks[peer].spans();
                    let is_long = clocks[peer].instant(tick + 1).unwrap() - at != short;
                    prop_assert!(!is_long || clocks[peer].instant(tick + 1).unwrap() - at == long);
                    prop_assert_eq!(timetable.are_long().get(peer / WIDTH).is_some_and(|mask| mask.get(peer % WIDTH)), is_long);
                    found.push((at, peer, tick));
                }
                times.dedup();
                prop_assert_eq!(times.len(), instants as usize);
                peers.sort_unstable();
                prop_assert!(peers.windows(2).all(|pair| pair[0] < pair[1]));
                timetable.end();
            }
            prop_assert!(found.is_sorted());
            let until = found[found.len() - 1].0;
            let expected: usize = clocks.iter().map(|clock| (0..).take_while(|tick| clock.instant(*tick).unwrap() <= until).count()).sum();
            // Of the last instant some may come in the next window.
            prop_assert!(found.len() <= expected && found.len() + clocks.len() > expected);
        }
    }
}
