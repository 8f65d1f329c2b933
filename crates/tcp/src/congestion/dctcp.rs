//! DCTCP: a window that shrinks in proportion to the share of marked segments (Bensley, Thaler, Balasubramanian, Eggert & Judd, RFC 8257, 2017), in integer
//! arithmetic, so that results are equal on every machine.
//!
//! With a share p of marked segments the window W shrinks by W·p/2 in each round and grows by 1 − p, so that it settles at 2·(1 − p)/p: twice the window needs
//! half of the marks, and each round has two marks, at every rate (scalable in the sense of RFC 9331).

use crate::sequence::Position;

/// Number of bits after the point of the estimate. Linux has 10 bits, so that a share below 1/64 counts as zero.
const BITS: u32 = 20;

/// Weight of the newest round in the estimate is 1/2^4 = 1/16 (RFC 8257, section 4.2, g).
const SHIFT_G: u32 = 4;

/// Estimate of the share of marked segments, and the reductions by this share.
#[derive(Clone, Debug)]
pub(super) struct Dctcp {
    /// Estimate of the share of marked segments, alpha \[2⁻²⁰\]. As in Linux, 1 at the beginning: the first mark halves the window.
    alpha: u64,
    /// Segments that arrived in the present round.
    delivered: u64,
    /// Segments among `delivered` that were reported as marked.
    marked: u64,
    /// End of the data sent when the present round began. `None` before the first round.
    round_end: Option<Position>,
    /// End of the data sent at the latest reduction. `None` before the first reduction.
    reduced_at: Option<Position>,
    /// Part of a segment by which the window is still to shrink \[2⁻²¹ segment\]. Without this part, a window of W segments would never shrink by a share
    /// below 2/W.
    rest: u64,
}

impl Dctcp {
    pub(super) const fn new() -> Self {
        Self { alpha: 1 << BITS, delivered: 0, marked: 0, round_end: None, reduced_at: None, rest: 0 }
    }

    /// Takes an acknowledgement of positions up to `una`, with which `delivered` segments arrived, and estimates the share anew at the end of a round. `next`
    /// is the end of the data sent so far.
    pub(super) fn hear(&mut self, una: Position, next: Position, delivered: u32, is_marked: bool) {
        self.delivered += u64::from(delivered);
        if is_marked {
            self.marked += u64::from(delivered);
        }
        if self.round_end.is_some_and(|end| una < end) || self.delivered == 0 {
            return;
        }
        if self.round_end.is_some() {
            // alpha ← (1 − g)·alpha + g·F
            self.alpha = self.alpha - (self.alpha >> SHIFT_G) + ((self.marked << (BITS - SHIFT_G)) / self.delivered);
        }
        (self.round_end, self.delivered, self.marked) = (Some(next), 0, 0);
    }

    /// Returns the window \[segments\] after a reported mark, W·(1 − alpha/2) and at least 2, or `None` if the window of this round has shrunk already.
    pub(super) fn reduced(&mut self, window: u32, una: Position, next: Position) -> Option<u32> {
        if self.reduced_at.is_some_and(|at| una <= at) {
            return None;
        }
        self.reduced_at = Some(next);
        self.rest += u64::from(window) * self.alpha;
        let segments = self.rest >> (BITS + 1);
        self.rest -= segments << (BITS + 1);
        Some(window.saturating_sub(u32::try_from(segments).unwrap_or(u32::MAX)).max(2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: u64 = 1 << BITS;

    /// Hears rounds of `size` segments, of which the first `marked` are marked.
    fn rounds(dctcp: &mut Dctcp, count: u64, size: u64, marked: u64) {
        let begin = dctcp.round_end.unwrap_or(0);
        for round in 0..count {
            for place in 0..size {
                let una = begin + round * size + place + 1;
                dctcp.hear(una, una + size, 1, place < marked);
            }
        }
    }

    /// Without marks alpha falls by a sixteenth in each round: (15/16)^n. With a share F it goes to F.
    #[test]
    fn the_estimate_is_the_one_of_the_formula() {
        let mut dctcp = Dctcp::new();
        dctcp.hear(1, 11, 1, false);
        assert_eq!(dctcp.alpha, ONE, "the first acknowledgement begins the first round");
        for n in 1..=20 {
            let end = dctcp.round_end.unwrap();
            dctcp.hear(end, end + 10, 10, false);
            assert!((dctcp.alpha as f64 / ONE as f64 - (15.0_f64 / 16.0).powi(n)).abs() < 1e-5, "{n}");
        }
        let before = dctcp.alpha as f64 / ONE as f64;
        let end = dctcp.round_end.unwrap();
        dctcp.hear(end - 1, end + 9, 6, false);
        dctcp.hear(end, end + 10, 4, true);
        assert!((dctcp.alpha as f64 / ONE as f64 - (before * 15.0 / 16.0 + 0.4 / 16.0)).abs() < 1e-5);
        rounds(&mut dctcp, 300, 100, 1);
        assert!((dctcp.alpha as f64 / ONE as f64 - 0.01).abs() < 0.0001, "{}", dctcp.alpha);
    }

    #[test]
    fn the_window_shrinks_once_a_round_by_half_of_the_share() {
        let mut dctcp = Dctcp::new();
        assert_eq!(dctcp.reduced(100, 0, 100), Some(50));
        assert_eq!([dctcp.reduced(50, 60, 150), dctcp.reduced(50, 100, 150)], [None, None]);
        dctcp.alpha = ONE / 8;
        assert_eq!(dctcp.reduced(64, 101, 165), Some(60));
        assert_eq!(dctcp.reduced(3, 166, 170), Some(3));
        dctcp.alpha = ONE;
        assert_eq!(dctcp.reduced(3, 171, 175), Some(2));
        assert_eq!(dctcp.reduced(2, 176, 180), Some(2));
    }

    /// A share of 1/256 of a window of 100 is a fifth of a segment: the window shrinks by one in every fifth or sixth round.
    #[test]
    fn parts_of_segments_add_up() {
        let mut dctcp = Dctcp { alpha: ONE / 256, ..Dctcp::new() };
        let shrunk: Vec<u64> = (1..=51).filter(|round| dctcp.reduced(100, 200 * round, 200 * round + 100) == Some(99)).collect();
        assert_eq!((shrunk.len(), shrunk[..3].to_vec()), (9, vec![6, 11, 16]));
    }
}
