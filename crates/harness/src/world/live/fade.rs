//! Numbers moving between 0 and 1 at a given speed.

use std::time::Duration;

use cohaptic_peer::Age;
use cohaptic_units::Instant;

/// A number from 0 to 1, moving towards one end, by 1 in the time `over`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Ramp {
    /// Value at `since`.
    from: f64,
    since: Instant,
    /// `true` if the number moves towards 1.
    rises: bool,
    /// Time from 0 to 1.
    over: Duration,
}

impl Ramp {
    /// Returns a ramp at rest at 0.
    pub(crate) const fn down(over: Duration) -> Self {
        Self { from: 0.0, since: Instant::ZERO, rises: false, over }
    }

    /// Returns a ramp at rest at 1.
    pub(crate) const fn up(over: Duration) -> Self {
        Self { from: 1.0, since: Instant::ZERO, rises: true, over }
    }

    pub(crate) fn value(&self, now: Instant) -> f64 {
        // The value is computed from the start and not step by step, so the value does not depend on how often it is asked for.
        let way = now.saturating_duration_since(self.since).as_secs_f64() / self.over.as_secs_f64();
        if self.rises { (self.from + way).min(1.0) } else { (self.from - way).max(0.0) }
    }

    /// Makes the number rise or fall from its value at `at`.
    pub(crate) fn turn(&mut self, at: Instant, rises: bool) {
        // Turning towards the present direction changes nothing: the ramp keeps its start.
        if self.rises != rises {
            *self = Self { from: self.value(at), since: at, rises, ..*self };
        }
    }

    /// Makes the number rise from 0 at `at`.
    pub(crate) fn restart(&mut self, at: Instant) {
        *self = Self { from: 0.0, since: at, rises: true, ..*self };
    }
}

/// Strength of one peer at another peer over time, by the rule of silence of a session. Instants must not go back.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Fade {
    /// Weight of the peer's pull.
    weight: Ramp,
    /// Share of the way from the state held before a return to the present state.
    share: Ramp,
}

impl Fade {
    /// Returns the fade of a never heard peer. `over`: time from no strength to the whole strength, and back; above zero.
    #[must_use]
    pub const fn unheard(over: Duration) -> Self {
        Self { weight: Ramp::down(over), share: Ramp::up(over) }
    }

    /// Returns the fade of a peer with full weight.
    pub(crate) const fn whole(over: Duration) -> Self {
        Self { weight: Ramp::up(over), share: Ramp::up(over) }
    }

    /// Notes that the peer has been silent since `at`: its strength falls to zero from there.
    pub fn fall(&mut self, at: Instant) {
        self.weight.turn(at, false);
    }

    /// Notes that the peer is heard again from `at` on: its strength rises.
    pub fn rise(&mut self, at: Instant) {
        self.weight.turn(at, true);
    }

    /// Notes a jump of the held sample. The way to the new state begins at `at`, unless the weight is 0: then nobody feels a jump.
    pub fn moved(&mut self, at: Instant) {
        if self.weight.value(at) > 0.0 {
            self.share.restart(at);
        } else {
            self.share = Ramp::up(self.share.over);
        }
    }

    /// Returns the age of the peer at an instant.
    #[must_use]
    pub fn age(&self, now: Instant) -> Age {
        Age { weight: self.weight.value(now), share: self.share.value(now) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(millis: u64) -> Instant {
        Instant::from_nanos(millis * 1_000_000)
    }

    /// With a fade of 256 ms, steps of 64 ms are exact quarters.
    #[test]
    fn the_weight_is_linear_both_ways_and_turns_where_it_is() {
        let mut fade = Fade::unheard(Duration::from_millis(256));
        assert_eq!(fade.age(at(999)), Age::GONE);
        fade.moved(at(1000));
        fade.rise(at(1000));
        assert_eq!(fade.age(at(1064)), Age { weight: 0.25, share: 1.0 });
        fade.rise(at(1100));
        fade.fall(at(1192));
        assert_eq!(fade.age(at(1192)), Age { weight: 0.75, share: 1.0 });
        assert_eq!(fade.age(at(1256)), Age { weight: 0.5, share: 1.0 });
        fade.moved(at(1256));
        fade.rise(at(1256));
        assert_eq!(fade.age(at(1320)), Age { weight: 0.75, share: 0.25 });
        assert_eq!(fade.age(at(1512)), Age::WHOLE);
        fade.fall(at(2000));
        assert_eq!(fade.age(at(2300)), Age::GONE);
    }
}
