//! Which samples are worth sending: dead bands around what was sent last.

use core::time::Duration;

use cohaptic_units::Instant;

use crate::State;

/// When a peer sends at the instants at which it may. Each condition by itself is enough; a peer that has never sent sends.
///
/// The dead bands of haptic communication: a relative one of velocity (Hinterseer et al. 2008; the form is that of the TUM library) and an absolute one of
/// position.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SendWhen {
    /// Once the velocity differs from the one sent last by this part of its size, ‖v − v₀‖ ≥ part·(‖v₀‖ + 10⁻⁵ m/s); from 0, which is always, to below 1.
    pub velocity: Option<f64>,
    /// Once the position is that far \[m\] from where receivers hold the copy; above zero.
    pub position: Option<f64>,
    /// Once that much time has passed since the last sample, on the peer's own clock; above zero.
    pub heartbeat: Option<Duration>,
}

/// What a peer has sent last.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LastSent<const A: usize> {
    /// When, on its own clock.
    pub at: Instant,
    /// The state of its copy.
    pub state: State<A>,
}

/// Below this speed a relative difference has no meaning [m/s].
const STANDSTILL: f64 = 1e-5;

impl SendWhen {
    /// Whether a copy in the state `own` is to be sent at `now` on the peer's own clock. Receivers extrapolate for up to `horizon` \[s\], if they do.
    #[must_use]
    pub fn is_due<const A: usize>(&self, last: Option<&LastSent<A>>, now: Instant, own: &State<A>, horizon: Option<f64>) -> bool {
        let Some(last) = last else { return true };
        let age = now.saturating_duration_since(last.at).as_secs_f64();
        let lead = horizon.map_or(0.0, |horizon| age.min(horizon));
        let sent = &last.state;
        let moved = distance::<A>(core::array::from_fn(|axis| own.position[axis] - (sent.position[axis] + lead * sent.velocity[axis])));
        let changed = distance::<A>(core::array::from_fn(|axis| own.velocity[axis] - sent.velocity[axis]));
        self.velocity.is_some_and(|part| changed >= part * (distance(sent.velocity) + STANDSTILL))
            || self.position.is_some_and(|most| moved >= most)
            || self.heartbeat.is_some_and(|most| now.saturating_duration_since(last.at) >= most)
    }
}

/// The length of a vector.
fn distance<const A: usize>(vector: [f64; A]) -> f64 {
    libm::sqrt(vector.iter().map(|component| component * component).sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64, v: f64) -> State<2> {
        State { position: [x, 0.0], velocity: [0.0, v] }
    }

    #[test]
    fn each_condition_is_enough() {
        let ms = |ms: u64| Instant::from_nanos(ms * 1_000_000);
        let last = LastSent { at: ms(100), state: at(0.0, 1.0) };
        let nothing = SendWhen { velocity: None, position: None, heartbeat: None };
        let due = |when: &SendWhen, now: u64, own: State<2>, horizon: Option<f64>| when.is_due(Some(&last), ms(now), &own, horizon);
        assert!(nothing.is_due(None, ms(0), &at(0.0, 0.0), None));
        assert!(!due(&nothing, 10_000, at(9.0, 9.0), None));
        let velocity = SendWhen { velocity: Some(0.25), ..nothing };
        assert!(due(&velocity, 101, at(0.0, 1.3), None) && due(&velocity, 101, at(0.0, 0.7), None) && !due(&velocity, 101, at(5.0, 1.2), None));
        assert!(due(&SendWhen { velocity: Some(0.0), ..nothing }, 101, last.state, None), "a band of nothing is left at once");
        let position = SendWhen { position: Some(0.5), ..nothing };
        assert!(due(&position, 101, at(0.5, 1.0), None) && !due(&position, 101, at(0.25, 9.0), None));
        // Held for 400 ms at 1 m/s along y, up to the horizon: 0.4 m, or 0.6 m of 0.7 m.
        assert!(!due(&position, 500, at(0.0, 1.0), Some(1.0)) && due(&position, 800, at(0.0, 1.0), Some(0.6)));
        let heartbeat = SendWhen { heartbeat: Some(Duration::from_millis(8)), ..nothing };
        assert!(due(&heartbeat, 108, last.state, None) && !due(&heartbeat, 107, last.state, None));
    }
}
