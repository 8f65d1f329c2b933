//! Dead bands: conditions under which a sample is worth sending.

use core::time::Duration;

use cohaptic_units::Instant;

use crate::State;

/// Conditions for sending at an instant at which the peer may send. One fulfilled condition is enough. A peer that has never sent always sends.
///
/// The dead bands of haptic communication are a relative dead band of velocity (Hinterseer et al. 2008, in the form of the TUM library) and an absolute dead
/// band of position.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SendWhen {
    /// Relative change of velocity since the last sample, ‖v − v₀‖ ≥ part·(‖v₀‖ + 10⁻⁵ m/s); from 0, which is always fulfilled, to below 1.
    pub velocity: Option<f64>,
    /// Distance \[m\] between the copy and its position as held by receivers; above zero.
    pub position: Option<f64>,
    /// Time since the last sample on the peer's own clock; above zero.
    pub heartbeat: Option<Duration>,
}

/// Last sample of a peer.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LastSent<const A: usize> {
    /// Send time on the peer's own clock.
    pub at: Instant,
    /// State of the peer's copy in the sample.
    pub state: State<A>,
}

/// Speed \[m/s\] below which a relative difference has no meaning.
const STANDSTILL: f64 = 1e-5;

impl SendWhen {
    /// Returns whether a copy in the state `own` is to be sent at `now` on the peer's own clock. `horizon` \[s\] is the greatest age to which receivers
    /// extrapolate; `None` if they hold the state.
    #[must_use]
    pub fn is_due<const A: usize>(&self, last: Option<&LastSent<A>>, now: Instant, own: &State<A>, horizon: Option<f64>) -> bool {
        // Receivers know nothing of this peer before its first sample.
        let Some(last) = last else { return true };
        let age = now.saturating_duration_since(last.at).as_secs_f64();
        let lead = horizon.map_or(0.0, |horizon| age.min(horizon));
        let sent = &last.state;
        // The receiver's view of this copy: the sent position, extrapolated as receivers do it.
        let moved = distance::<A>(core::array::from_fn(|axis| own.position[axis] - (sent.position[axis] + lead * sent.velocity[axis])));
        let changed = distance::<A>(core::array::from_fn(|axis| own.velocity[axis] - sent.velocity[axis]));
        self.velocity.is_some_and(|part| changed >= part * (distance(sent.velocity) + STANDSTILL))
            || self.position.is_some_and(|most| moved >= most)
            || self.heartbeat.is_some_and(|most| now.saturating_duration_since(last.at) >= most)
    }
}

/// Returns the length of a vector.
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
        // The change is a quarter of 1 m/s, faster or slower; the position has no effect on this band.
        let velocity = SendWhen { velocity: Some(0.25), ..nothing };
        assert!(due(&velocity, 101, at(0.0, 1.3), None) && due(&velocity, 101, at(0.0, 0.7), None) && !due(&velocity, 101, at(5.0, 1.2), None));
        assert!(due(&SendWhen { velocity: Some(0.0), ..nothing }, 101, last.state, None), "a band of nothing is left at once");
        let position = SendWhen { position: Some(0.5), ..nothing };
        assert!(due(&position, 101, at(0.5, 1.0), None) && !due(&position, 101, at(0.25, 9.0), None));
        // The copy stands still while receivers extrapolate at 1 m/s along y: the error is 0.4 m after 400 ms, and 0.6 m after 700 ms with a horizon of 0.6
        // s.
        assert!(!due(&position, 500, at(0.0, 1.0), Some(1.0)) && due(&position, 800, at(0.0, 1.0), Some(0.6)));
        let heartbeat = SendWhen { heartbeat: Some(Duration::from_millis(8)), ..nothing };
        assert!(due(&heartbeat, 108, last.state, None) && !due(&heartbeat, 107, last.state, None));
    }
}
