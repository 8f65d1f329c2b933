//! A delay as a key: between two values of it nothing happens but that samples are on the way for longer.
//!
//! A sample comes into force at the first tick at or after its arrival. That tick is no earlier for a longer delay, and neither is an age that a law takes from the delay. So if a frame of one delay has the same events, samples held and
//! laws as that of a longer one, so has that of every delay between them: a *stretch* of delays is one scene. Delays are whole nanoseconds, and stretches are neighbours if nothing lies between them.

use cohaptic_scene::Scene;
use cohaptic_stability::KeyRange;

use super::error::ProofError;

/// More stretches than this are refused.
const MOST_STRETCHES: usize = 2000;

/// What a nanosecond is in the unit of a delay; `None` if the key is no delay of links.
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

/// The stretches of a key, from its least value on. `frame` says of the scene with a value all that happens in a frame.
pub(super) fn stretches(range: &KeyRange, frame: impl Fn(f64) -> Result<String, ProofError>) -> Result<Vec<[f64; 2]>, ProofError> {
    let Some(unit) = per_unit(range) else { return Err(ProofError::Key { key: range.key.clone() }) };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a delay in whole nanoseconds, which saturates")]
    let [low, high] = [(range.low * unit).ceil() as u64, (range.high * unit).floor() as u64];
    #[expect(clippy::cast_precision_loss, reason = "a delay of less than 2^53 nanoseconds")]
    let value = |nanoseconds: u64| (nanoseconds as f64 / unit).clamp(range.low, range.high);
    let (mut found, mut from, mut length) = (Vec::new(), low, 0);
    while from <= high {
        let here = frame(value(from))?;
        let is_same = |delay: u64| Ok::<_, ProofError>(frame(value(delay))? == here);
        // Most stretches are as long as the one before.
        let (mut same, mut other) = (from, high + 1);
        let guess = from.saturating_add(length);
        if guess < high && is_same(guess)? {
            same = guess;
            if !is_same(guess + 1)? {
                other = guess + 1;
            }
        }
        if other > high && is_same(high)? {
            same = high;
        }
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

/// Whether two scenes differ in the delays of their links alone.
pub(super) fn differ_in_delays_alone(one: &Scene, other: &Scene) -> bool {
    let without = |scene: &Scene| format!("{:?} {:?} {:?} {:?}", scene.object, scene.coordination, scene.peers, scene.timeline);
    without(one) == without(other)
}
