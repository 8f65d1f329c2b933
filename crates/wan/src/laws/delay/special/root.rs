//! Root of an increasing function.

/// Returns the zero of `f` in [low, high] to the last digit, or the nearer end if `f` has no zero inside. The method is the secant method with a bracket; the
/// bracket is bisected whenever a step has not halved it.
pub(in crate::laws::delay) fn increasing(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let (mut at_low, mut at_high) = (f(low), f(high));
    if at_low >= 0.0 {
        return low;
    }
    if at_high <= 0.0 {
        return high;
    }
    // Secant steps may creep towards one end, so bisection is enforced after a poor step.
    let mut bisect = false;
    // At least every second step halves the bracket, so 200 steps reach the last digit.
    for _ in 0..200 {
        let width = high - low;
        let middle = low + 0.5 * width;
        // No number lies between the ends.
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
            // Illinois (Dowell & Jarratt 1971): the value at an end that stays is halved, so the next secant moves this end.
            at_high *= 0.5;
        } else {
            (high, at_high) = (next, value);
            at_low *= 0.5;
        }
        // After a step that has not halved the bracket, the next step bisects.
        bisect = high - low > 0.5 * width;
    }
    // Of both neighbours of the zero, the end with the smaller value is nearer.
    if -at_low < at_high { low } else { high }
}
