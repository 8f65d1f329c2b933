//! Ticks of the clock that showed the delays.
//!
//! A clock of tick g shows a delay v for all true delays from v − g/2 to v + g/2 if it rounds, and from v to v + g if it cuts. A cut delay is moved by half a
//! tick ([`Measurements::cut_to`]), and is a rounded delay from then on.

use super::{Measurements, MeasurementsError};

/// Tick of the clock for each packet.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) enum Ticks {
    /// Not known: the greatest common step of the delays is taken.
    #[default]
    Found,
    /// Known \[s\], above zero, the same for all packets.
    One(f64),
    /// Known \[s\], above zero, indexed by packet: programs print long delays with fewer digits.
    Each(Vec<f64>),
}

impl Ticks {
    /// Returns the tick of a packet \[s\]; `None` if the tick is not known.
    pub(super) fn of(&self, packet: usize) -> Option<f64> {
        match self {
            Self::Found => None,
            Self::One(tick_s) => Some(*tick_s),
            Self::Each(ticks_s) => ticks_s.get(packet).copied(),
        }
    }

    /// Returns the ticks of the packets with numbers in `range`.
    pub(super) fn part(&self, range: std::ops::Range<usize>) -> Self {
        match self {
            Self::Each(ticks_s) => Self::Each(ticks_s[range].to_vec()),
            whole @ (Self::Found | Self::One(_)) => whole.clone(),
        }
    }
}

impl Measurements {
    /// Returns the measurements of a clock that rounds delays to multiples of `tick_s` \[s\]. A tick that is not known is the greatest common step of the
    /// delays.
    ///
    /// # Errors
    ///
    /// [`MeasurementsError::Tick`] if the tick is not a finite number above zero.
    pub fn rounded_to(self, tick_s: f64) -> Result<Self, MeasurementsError> {
        if !(tick_s.is_finite() && tick_s > 0.0) {
            return Err(MeasurementsError::Tick { tick_s });
        }
        Ok(Self { ticks: Ticks::One(tick_s), ..self })
    }

    /// Returns the measurements of a clock that cuts delays to multiples of `tick_s` \[s\]. Half a tick is added to each delay, because the true delay is as
    /// likely in the lower half of the tick as in the upper half.
    ///
    /// # Errors
    ///
    /// [`MeasurementsError::Tick`] if the tick is not a finite number above zero, [`MeasurementsError::NotFinite`] if a sum is not finite.
    pub fn cut_to(self, tick_s: f64) -> Result<Self, MeasurementsError> {
        self.rounded_to(tick_s)?.shifted(tick_s / 2.0)
    }

    /// Returns the measurements with the tick \[s\] of each packet.
    ///
    /// # Panics
    ///
    /// In debug builds, if the numbers of ticks and packets differ.
    pub(super) fn rounded_each(self, ticks_s: Vec<f64>) -> Self {
        debug_assert_eq!(ticks_s.len(), self.packets.len(), "one tick of each packet");
        Self { ticks: Ticks::Each(ticks_s), ..self }
    }

    /// Returns measurements of one way from measurements of round trips: the share `share` of each delay and of each tick. A packet that was lost on either
    /// way stays lost.
    ///
    /// # Errors
    ///
    /// [`MeasurementsError::Share`] if the share is not above 0 and at most 1.
    pub fn share_of_round_trip(&self, share: f64) -> Result<Self, MeasurementsError> {
        // The condition is negated so that NaN is refused, too.
        if !(share > 0.0 && share <= 1.0) {
            return Err(MeasurementsError::Share { share });
        }
        let ticks = match &self.ticks {
            Ticks::Found => Ticks::Found,
            Ticks::One(tick_s) => Ticks::One(tick_s * share),
            Ticks::Each(ticks_s) => Ticks::Each(ticks_s.iter().map(|tick_s| tick_s * share).collect()),
        };
        let packets = self.packets.iter().map(|packet| super::Measurement { delay_s: packet.delay_s.map(|delay| delay * share), ..*packet });
        Ok(Self { packets: packets.collect(), ticks, removed: self.removed })
    }
}

#[cfg(test)]
mod tests {
    use crate::fit::tests::{in_an_order_without_memory, one_clock};
    use crate::fit::{FitError, Measurements, fit};

    const COUNTS: [(u32, usize); 8] = [(20, 22), (21, 61), (22, 53), (23, 31), (24, 17), (25, 9), (26, 4), (27, 3)];

    /// Returns the delays of [`COUNTS`] in milliseconds, moved by `by_ms`.
    fn sample(by_ms: f64) -> Measurements {
        one_clock(&in_an_order_without_memory(&COUNTS, 77).iter().map(|delay| (f64::from(*delay) + by_ms) * 1e-3).collect::<Vec<_>>())
    }

    #[test]
    fn a_given_tick_is_an_interval() {
        let found = fit(&sample(0.0)).unwrap();
        let given = fit(&sample(0.0).rounded_to(1e-3).unwrap()).unwrap();
        for (one, other) in found.goodness.laws.iter().zip(&given.goodness.laws) {
            assert!(one.distribution == other.distribution && (one.log_likelihood - other.log_likelihood).abs() < 1e-6, "{one:?} {other:?}");
        }
        // A clock that cuts shows 20 for all between 20 and 21 ms: as a clock that rounds, half a millisecond later.
        let cut = fit(&sample(0.0).cut_to(1e-3).unwrap()).unwrap();
        assert!((cut.link.delay_s - found.link.delay_s - 0.5e-3).abs() < 1e-7 && (cut.link.jitter.sd_s - found.link.jitter.sd_s).abs() < 1e-7);
        // A finer clock than the data show: the probability of an interval falls with its width.
        let finer = fit(&sample(0.0).rounded_to(1e-5).unwrap()).unwrap();
        assert!(finer.goodness.laws[0].log_likelihood < found.goodness.laws[0].log_likelihood - 200.0, "{:#?}", finer.goodness);
        assert!((finer.goodness.resolution_s - 1e-5).abs() < 1e-15);
    }

    #[test]
    fn half_of_a_round_trip_has_half_the_tick() {
        let half = sample(0.0).rounded_to(1e-3).unwrap().share_of_round_trip(0.5).unwrap();
        let (whole, half) = (fit(&sample(0.0)).unwrap(), fit(&half).unwrap());
        assert!((half.goodness.resolution_s - 0.5e-3).abs() < 1e-15 && (half.link.delay_s - whole.link.delay_s / 2.0).abs() < 1e-7);
        for share in [0.0, 1.5, -0.5, f64::NAN] {
            assert!(sample(0.0).share_of_round_trip(share).unwrap_err().to_string().contains("expected above 0 and at most 1"));
        }
    }

    #[test]
    fn delays_within_one_tick_are_a_constant() {
        let delays: Vec<f64> = (0..60).map(|i| 0.1 + 1e-5 * f64::from(i % 3)).collect();
        let error = fit(&one_clock(&delays).rounded_to(1e-3).unwrap()).unwrap_err();
        assert!(matches!(error, FitError::OneTick { received: 60, .. }), "{error}");
        assert!(error.to_string().contains("all 60 delays are 0.1 s, to half a tick of 0.001 s"), "{error}");
        for tick_s in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(one_clock(&delays).rounded_to(tick_s).is_err());
        }
    }
}
