//! Largest angle between two copies of a rotating object.

/// Largest angle between two copies so far.
///
/// Angles grow with the chords between quaternions, 2·sin(θ/4), so chords are compared instead of angles. A chord is at most the sum of the chords to a third
/// copy, which excludes most pairs: one copy is the reference, and pairs are examined only if the two longest chords to the reference are together longer than
/// the longest chord so far. The copy farthest from the reference can then become the new reference.
#[derive(Clone, Debug, Default)]
pub(crate) struct Spread {
    /// Square of the longest chord so far.
    longest: f64,
    /// Index in `copies` of the reference.
    reference: usize,
    /// Orientations of the present copies, as quaternions.
    copies: Vec<[f64; 4]>,
    /// Squares of the chords to the reference, indexed like `copies`.
    near: Vec<f64>,
    /// Squares of the chords to the copy farthest from the reference, indexed like `copies`.
    far: Vec<f64>,
}

/// Returns the square of the chord between two orientations. The quaternions q and −q are the same orientation, so the shorter chord counts.
#[inline(always)]
fn squared_chord(one: &[f64; 4], other: &[f64; 4]) -> f64 {
    let square = |sign: f64| {
        let [w, x, y, z] = std::array::from_fn(|part| (one[part] - sign * other[part]) * (one[part] - sign * other[part]));
        w + x + y + z
    };
    // Both sums are added in the same order, so the result does not depend on the sign of either quaternion.
    let (equal, opposite) = (square(1.0), square(-1.0));
    if equal < opposite { equal } else { opposite }
}

/// Returns the longest and the second longest of some chords, from their squares.
#[inline(always)]
fn two_longest(squares: &[f64]) -> [f64; 2] {
    let two = squares.iter().fold([0.0, 0.0], |[first, second], square| {
        if *square > first {
            [*square, first]
        } else if *square > second {
            [first, *square]
        } else {
            [first, second]
        }
    });
    two.map(f64::sqrt)
}

impl Spread {
    /// Returns the largest angle so far \[rad\].
    pub(crate) fn angle(&self) -> f64 {
        4.0 * libm::asin((0.5 * libm::sqrt(self.longest)).min(1.0))
    }

    /// Updates the largest angle by all pairs of `copies`, the quaternions of the present copies.
    pub(crate) fn take(&mut self, copies: impl Iterator<Item = [f64; 4]>) {
        self.copies.clear();
        self.copies.extend(copies);
        // The number of present copies can shrink, so the former reference may be gone.
        let reference = if self.reference < self.copies.len() { self.reference } else { 0 };
        let Some(of_reference) = self.copies.get(reference) else { return };
        chords(of_reference, &self.copies, &mut self.near);
        let near = two_longest(&self.near);
        // Every pair has a chord of at most the sum of its chords to the reference, and no such sum is larger than this one.
        if near[0] + near[1] <= self.longest.sqrt() {
            return;
        }
        // The farthest copy gives a second bound for every pair, which excludes further pairs.
        let farthest = (0..self.copies.len()).max_by(|one, other| self.near[*one].total_cmp(&self.near[*other])).unwrap_or(0);
        chords(&self.copies[farthest], &self.copies, &mut self.far);
        let far = two_longest(&self.far);
        self.longest = self.near.iter().chain(&self.far).fold(self.longest, |longest, square| longest.max(*square));
        self.look_at_pairs();
        // The reference with the smaller sum excludes more pairs at the next instant.
        if far[0] + far[1] < near[0] + near[1] {
            self.reference = farthest;
        }
    }

    /// Examines the pairs that chords to the reference and to the farthest copy do not exclude. In a pair beyond the longest chord, at least one copy is more
    /// than half of the longest chord away from the reference, and likewise from the farthest copy.
    fn look_at_pairs(&mut self) {
        let Self { longest, copies, near, far, .. } = self;
        let count = |squares: &[f64]| squares.iter().filter(|square| 4.0 * **square > *longest).count();
        // Start from the bound with fewer candidates: the loops below skip all copies that are near to that copy.
        let few = if count(near) < count(far) { &*near } else { &*far };
        let above = |squares: &[f64], one: usize, other: usize, longest: f64| squares[one].sqrt() + squares[other].sqrt() > longest.sqrt();
        for one in 0..copies.len() {
            // The bounds use square roots only for candidates, because most pairs fail the first test.
            for other in 0..copies.len() {
                if 4.0 * few[one] > *longest && above(near, one, other, *longest) && above(far, one, other, *longest) {
                    *longest = longest.max(squared_chord(&copies[one], &copies[other]));
                }
            }
        }
    }
}

fn chords(from: &[f64; 4], copies: &[[f64; 4]], squares: &mut Vec<f64>) {
    squares.clear();
    squares.extend(copies.iter().map(|copy| squared_chord(from, copy)));
}

#[cfg(test)]
mod tests {
    use cohaptic_peer::rotation::Attitude;

    use super::*;

    fn turned(sigma: [f64; 3]) -> Attitude {
        let mut attitude = Attitude::REST;
        attitude.turn(sigma);
        attitude
    }

    /// Moving copies with an outlier at the first, a middle or the last index: the result is the largest angle of all pairs at all instants.
    #[test]
    fn the_largest_angle_is_that_of_all_pairs() {
        for outlier in [0, 4, 8] {
            let (mut spread, mut largest) = (Spread::default(), 0.0_f64);
            for instant in 0..60_u32 {
                let copies: Vec<Attitude> = (0..9_u32)
                    .map(|place| {
                        let phase = f64::from(instant) * 0.1 + f64::from(place);
                        let size = if place == outlier { 1.1 } else { 0.3 };
                        let copy = turned([size * phase.sin(), size * (1.3 * phase).cos(), size * (0.7 * phase).sin()]);
                        if place % 2 == 0 { copy } else { Attitude { orientation: copy.orientation.map(|q| -q), ..copy } }
                    })
                    .collect();
                spread.take(copies.iter().map(|copy| copy.orientation));
                let all = copies.iter().flat_map(|one| copies.iter().map(|other| one.angle_to(&other.orientation)));
                largest = all.fold(largest, f64::max);
                assert!((spread.angle() - largest).abs() <= 4.0 * f64::EPSILON, "{outlier} at {instant}: {} is not {largest}", spread.angle());
            }
        }
    }

    #[test]
    fn one_copy_is_nowhere_apart() {
        let mut spread = Spread::default();
        spread.take(std::iter::empty());
        spread.take([turned([1.0, 2.0, 0.0]).orientation].into_iter());
        assert_eq!(spread.angle().to_bits(), 0.0_f64.to_bits());
    }
}
