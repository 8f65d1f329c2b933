//! The root of an increasing function.

/// Where `f` crosses zero in [low, high], to the last digit: the secant method with a bracket, which is bisected whenever it has not halved. If `f` has no zero inside, the end next to it.
pub(in crate::laws::delay) fn increasing(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let (mut at_low, mut at_high) = (f(low), f(high));
    if at_low >= 0.0 {
        return low;
    }
    if at_high <= 0.0 {
        return high;
    }
    let mut bisect = false;
    for _ in 0..200 {
        let width = high - low;
        let middle = low + 0.5 * width;
        if middle <= low || middle >= high {
            break;
        }
        let secant = low - at_low * width / (at_high - at_low);
        let next = if !bisect && secant > low && secant < high { secant } else { middle };
        let value = f(next);
        if value == 0.0 {
            return next;
        }
        if value < 0.0 {
            (low, at_low) = (next, value);
            // Illinois (Dowell & Jarratt 1971): an end that stays has half its weight.
            at_high *= 0.5;
        } else {
            (high, at_high) = (next, value);
            at_low *= 0.5;
        }
        // A step that has not halved the bracket is followed by one that does.
        bisect = high - low > 0.5 * width;
    }
    if -at_low < at_high { low } else { high }
}
