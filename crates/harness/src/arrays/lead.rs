//! By how much held samples have moved on since they were sent, for laws that extrapolate.

use cohaptic_peer::age;
use cohaptic_units::Instant;

/// A sample that is held: when it was sent, and its velocity \[m/s\].
pub(super) type Moving = (Instant, f64);

/// The mean of min(age, horizon)·velocity \[m\] of samples in the order in which a peer holds them: what [`cohaptic_peer::Held::lead`] gives, to the bit.
pub(super) fn mean_lead(samples: impl Iterator<Item = Moving>, now: Instant, horizon: f64, count: f64) -> f64 {
    let mut sums = [0.0; 4];
    for (place, (sent, velocity)) in samples.enumerate() {
        sums[place % 4] += age(now, sent).min(horizon) * velocity;
    }
    let [a, b, c, d] = sums;
    ((a + b) + (c + d)) / count
}
