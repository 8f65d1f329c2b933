//! A delay of links as a key. The range of the key falls into stretches with one frame each.
//!
//! A sample comes into force at the first tick at or after its arrival. A longer delay makes the tick no earlier, and makes no age in a law smaller. So if the
//! frames of two delays have the same events, held samples and laws, the frame of every delay between the two has the same too: a
//! *stretch* of delays is one scene. Delays are whole nanoseconds, and two stretches are neighbours if no whole nanosecond lies between them.

use cohaptic_scene::Scene;
use cohaptic_stability::KeyRange;

use super::error::ProofError;

/// Largest number of stretches of a key; a range with more is refused.
const MOST_STRETCHES: usize = 2000;

/// Returns the number of nanoseconds in the unit of a delay; `None` if the key is no delay of links.
fn per_unit(range: &KeyRange) -> Option<f64> {
    let is_delay = ["link.", "links."].iter().any(|table| range.key.starts_with(table)) && range.key.ends_with(".delay");
    let unit = match range.unit.as_str() {
        "s" => 1e9,
        "ms" => 1e6,
        "us" => 1e3,
        "ns" => 1.0,
        _ => return None,
    };
    is_delay.then_some(unit)
}

/// Returns the stretches of a key in ascending order, as values in the unit of the key. `frame` returns a text of everything that happens in a frame of the
/// scene with the given value; frames with equal texts are equal.
///
/// # Errors
///
/// [`ProofError::Key`] if the key is no delay, [`ProofError::Stretches`] if there are more than [`MOST_STRETCHES`], and the errors of `frame`.
pub(super) fn stretches(range: &KeyRange, frame: impl Fn(f64) -> Result<String, ProofError>) -> Result<Vec<[f64; 2]>, ProofError> {
    let Some(unit) = per_unit(range) else { return Err(ProofError::Key { key: range.key.clone() }) };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a delay in whole nanoseconds, which saturates")]
    // The ends of the range may lie between two whole nanoseconds; only whole nanoseconds inside the range are delays.
    let [low, high] = [(range.low * unit).ceil() as u64, (range.high * unit).floor() as u64];
    #[expect(clippy::cast_precision_loss, reason = "a delay of less than 2^53 nanoseconds")]
    let value = |nanoseconds: u64| (nanoseconds as f64 / unit).clamp(range.low, range.high);
    let (mut found, mut from, mut length) = (Vec::new(), low, 0);
    while from <= high {
        let here = frame(value(from))?;
        let is_same = |delay: u64| Ok::<_, ProofError>(frame(value(delay))? == here);
        // `same` is a delay known to belong to this stretch, `other` a delay known to lie beyond. Most stretches are as long as the stretch before, so the
        // end of a stretch of the same length is tried first: two frames then replace a bisection.
        let (mut same, mut other) = (from, high + 1);
        let guess = from.saturating_add(length);
        if guess < high && is_same(guess)? {
            same = guess;
            if !is_same(guess + 1)? {
                other = guess + 1;
            }
        }
        // One frame at the end of the range replaces the bisection of the last stretch.
        if other > high && is_same(high)? {
            same = high;
        }
        // Bisection is valid because the frames of a stretch are a contiguous range of delays.
        while same < high && other - same > 1 {
            let middle = same + (other - same) / 2;
            if is_same(middle)? {
                same = middle;
            } else {
                other = middle;
            }
        }
        found.push([value(from), value(same)]);
        if found.len() > MOST_STRETCHES {
            return Err(ProofError::Stretches { key: range.key.clone(), most: MOST_STRETCHES });
        }
        (length, from) = (same - from, same + 1);
    }
    Ok(found)
}

/// Returns whether two scenes agree in objects, coordination, peers and timeline, so only links can differ.
pub(super) fn differ_in_delays_alone(one: &Scene, other: &Scene) -> bool {
    let without = |scene: &Scene| format!("{:?} {:?} {:?} {:?}", scene.object, scene.coordination, scene.peers, scene.timeline);
    without(one) == without(other)
}
