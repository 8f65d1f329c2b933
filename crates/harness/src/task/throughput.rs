//! Throughput of movements to targets.

use std::f64::consts::{E, TAU};
use std::time::Duration;

/// Movement that ended where a target was reached, along the line to this target from the target before. The line of the first movement begins where the
/// copies were at the first judged instant. Several copies that are judged together count as one copy at their mean position.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Movement {
    /// Distance moved along the line \[m\], from the end of the movement before.
    pub distance: f64,
    /// Position of the end beyond the target, along the line \[m\].
    pub deviation: f64,
    /// Time since the target before was reached, or since the start of the task.
    pub time: Duration,
}

/// Returns the throughput of movements [bit/s] as ISO 9241-411 defines it: log₂(Aₑ/Wₑ + 1) by the mean time, with the mean distance Aₑ and the effective width
/// Wₑ = √(2πe)·s of the standard deviation s of the ends. `None` for fewer than two movements, and for movements without a deviation or without time.
#[must_use]
#[expect(clippy::cast_precision_loss, reason = "fewer movements than 2^53")]
pub fn throughput(movements: &[Movement]) -> Option<f64> {
    let count = movements.len() as f64;
    let mean = |of: fn(&Movement) -> f64| movements.iter().map(of).sum::<f64>() / count;
    let (amplitude, end, time) =
        (mean(|movement| movement.distance), mean(|movement| movement.deviation), mean(|movement| movement.time.as_secs_f64()));
    let squares: f64 = movements.iter().map(|movement| (movement.deviation - end) * (movement.deviation - end)).sum();
    let width = libm::sqrt(TAU * E * squares / (count - 1.0));
    let bits = information_rate(amplitude, width, time);
    // Also not finite for no movement and for one movement, whose means are 0/0.
    bits.is_finite().then_some(bits)
}

/// Returns the rate of information [bit/s] of movements over a distance to a target of some width, in a time \[s\].
fn information_rate(distance: f64, width: f64, time: f64) -> f64 {
    libm::log2(distance / width + 1.0) / time
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Distance, effective width [inch] and time \[s\] of the light stylus in the tapping experiment of Fitts (1954, table 1). The effective widths were
    /// computed for this test and not read: 2.066 times the nominal width, by the normal quantile of half the share of errors. Distances, times and errors were
    /// recalled from that table.
    const FITTS: [(f64, f64, f64); 16] = [
        (2.0, 1.020, 0.180),
        (2.0, 0.725, 0.212),
        (2.0, 0.444, 0.281),
        (2.0, 0.243, 0.392),
        (4.0, 1.233, 0.203),
        (4.0, 0.812, 0.260),
        (4.0, 0.468, 0.372),
        (4.0, 0.244, 0.484),
        (8.0, 1.576, 0.279),
        (8.0, 0.914, 0.357),
        (8.0, 0.446, 0.469),
        (8.0, 0.235, 0.580),
        (16.0, 1.519, 0.388),
        (16.0, 0.832, 0.481),
        (16.0, 0.468, 0.595),
        (16.0, 0.247, 0.731),
    ];

    /// The width of the first row, its 8.70 bit/s and the mean of 8.968 bit/s are those of MacKenzie (1991, table 1), so that wrong recalled numbers would
    /// show.
    #[test]
    fn tapping_has_the_throughput_that_fitts_found() {
        let rates = FITTS.map(|(distance, width, time)| information_rate(distance, width, time));
        assert!((rates[0] - 8.70).abs() < 0.005, "{}", rates[0]);
        let mean = rates.iter().sum::<f64>() / 16.0;
        assert!((mean - 8.968).abs() < 0.002, "{mean}");
    }

    #[test]
    fn the_width_is_that_of_the_ends() {
        let movement = |deviation: f64| Movement { distance: 0.1, deviation, time: Duration::from_millis(500) };
        // The ends deviate by 1 mm from their mean, with a standard deviation of √2 mm.
        let width = 1e-3 * (2.0 * TAU * E).sqrt();
        let found = throughput(&[movement(0.004), movement(0.002)]).unwrap();
        assert!((found - 2.0 * (0.1 / width + 1.0).log2()).abs() < 1e-12, "{found}");
        for none in [vec![], vec![movement(0.001)], vec![movement(0.001); 3]] {
            assert_eq!(throughput(&none), None);
        }
    }
}
