//! Storage of the held samples of one peer along one axis, with a layout for a mean of few instructions.

use cohaptic_peer::State;

/// Samples of four senders in L runs: four positions \[m\], then four velocities \[m/s\].
///
/// A mean adds every fourth sample to the same one of four sums, as [`cohaptic_peer::Held::refresh`] does. The four sums of positions and the four sums of
/// velocities are the lanes of a register.
pub(super) type Quad<const L: usize> = [[f64; L]; 8];

/// Number in places without a sender: −0, whose addition changes no sum, not even the sign of a zero.
const NOBODY: f64 = -0.0;

/// Returns quads for the given number of samples, all empty.
pub(super) fn empty<const L: usize>(samples: usize) -> Vec<Quad<L>> {
    vec![[[NOBODY; L]; 8]; samples.div_ceil(4)]
}

/// Replaces the sample at index `place` in a run.
#[inline(always)]
pub(super) fn set<const L: usize>(quads: &mut [Quad<L>], place: usize, run: usize, position: f64, velocity: f64) {
    let quad = &mut quads[place / 4];
    quad[place % 4][run] = position;
    quad[place % 4 + 4][run] = velocity;
}

/// Returns the sample at index `place` in a run. `quads` is indexed by axis.
pub(super) fn state<const A: usize, const L: usize>(quads: &[Vec<Quad<L>>; A], place: usize, run: usize) -> State<A> {
    let number = |axis: usize, part: usize| quads[axis][place / 4][place % 4 + part][run];
    State { position: std::array::from_fn(|axis| number(axis, 0)), velocity: std::array::from_fn(|axis| number(axis, 4)) }
}

/// Returns the velocity of the sample at index `place` in a run.
pub(super) fn velocity<const L: usize>(quads: &[Quad<L>], place: usize, run: usize) -> f64 {
    quads[place / 4][place % 4 + 4][run]
}

/// Swaps the sample at index `one` with `other`, in all runs.
#[inline(always)]
pub(super) fn swap<const L: usize>(quads: &mut [Quad<L>], one: usize, other: &mut ([f64; L], [f64; L])) {
    let quad = &mut quads[one / 4];
    std::mem::swap(&mut quad[one % 4], &mut other.0);
    std::mem::swap(&mut quad[one % 4 + 4], &mut other.1);
}

/// Returns the mean position and velocity of `count` samples, indexed by run.
#[inline(always)]
pub(super) fn mean<const L: usize>(quads: &[Quad<L>], count: f64) -> ([f64; L], [f64; L]) {
    // Eight independent sums fill a register. Padding adds −0 and changes none.
    let mut sums: Quad<L> = [[0.0; L]; 8];
    for quad in quads {
        for place in 0..8 {
            for run in 0..L {
                sums[place][run] += quad[place][run];
            }
        }
    }
    let mean = |first: usize| -> [f64; L] {
        // The order of additions equals the order in `Held::refresh`, or the last bit would differ.
        std::array::from_fn(|run| ((sums[first][run] + sums[first + 1][run]) + (sums[first + 2][run] + sums[first + 3][run])) / count)
    };
    (mean(0), mean(4))
}

#[cfg(test)]
mod tests {
    use cohaptic_peer::Held;

    use super::*;

    #[test]
    fn a_mean_is_that_of_what_a_peer_holds_to_the_bit() {
        for count in 1..=13_u32 {
            let value = |place: u32| (f64::from(place * 7 + 1).sin(), -f64::from(place * 3 + 2).cos());
            let mut quads = empty::<2>(count as usize);
            for place in 0..count {
                let (position, velocity) = value(place);
                set(&mut quads, place as usize, 0, position, velocity);
                set(&mut quads, place as usize, 1, -0.0, velocity * 1e300);
            }
            let (positions, velocities) = mean(&quads, f64::from(count));
            for (run, scale) in [(0, 1.0), (1, 1e300)] {
                let held = Held::new((0..count).map(|place| {
                    let (position, velocity) = value(place);
                    State { position: [if run == 0 { position } else { -0.0 }], velocity: [velocity * scale] }
                }));
                assert_eq!(held.mean().position[0].to_bits(), positions[run].to_bits(), "{count}");
                assert_eq!(held.mean().velocity[0].to_bits(), velocities[run].to_bits(), "{count}");
            }
        }
    }
}
