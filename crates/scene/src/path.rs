//! Line along which a task moves the object.

/// Keys of a task that moves the object along a line.
#[derive(Clone, PartialEq, Debug)]
pub struct PathTask {
    /// Corners of the line \[m\], at least two; neighbours differ. Components beyond the scene's axes are zero.
    pub points: Vec<[f64; 3]>,
    /// Width of the lane around the line \[m\]; above zero. A copy farther than half of the width from the line is outside.
    pub width: f64,
    /// Effect of a copy that leaves the lane.
    pub leave: Leave,
}

/// Effect of a copy that leaves the lane of a path.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Leave {
    /// The time outside is measured.
    Count,
    /// The task fails.
    Fail,
}

impl PathTask {
    /// Returns whether points are the corners of a line: at least two, of which neighbours are apart.
    pub(crate) fn is_line(points: &[[f64; 3]]) -> bool {
        points.len() >= 2 && points.windows(2).all(|corners| distance(corners[0], corners[1]) > 0.0)
    }

    /// Returns the length of the line \[m\].
    #[must_use]
    pub fn length(&self) -> f64 {
        self.points.windows(2).fold(0.0, |length, corners| length + distance(corners[0], corners[1]))
    }

    /// Returns whether a copy with the progress `progress` \[m\] is at the end of the line: at most a hundredth of the width before the end. A copy that comes to
    /// rest at the end comes ever closer and may never be there exactly.
    #[must_use]
    pub fn is_at_end(&self, progress: f64) -> bool {
        progress >= self.length() - 0.01 * self.width
    }

    /// Returns the point of the line after a length `along` \[m\]: an end of the line for a length below zero or above the length of the line.
    #[must_use]
    pub fn point(&self, along: f64) -> [f64; 3] {
        // A length below zero would extend the first leg backwards beyond the first corner.
        let mut left = along.max(0.0);
        for corners in self.points.windows(2) {
            let length = distance(corners[0], corners[1]);
            if left <= length {
                return between(corners, left / length);
            }
            left -= length;
        }
        // The subtraction of rounded lengths can leave a remainder after the last leg, also for the length of the whole line.
        self.points.last().copied().unwrap_or_default()
    }

    /// Returns the point of the line that is nearest to a position, of those from the length `progress` to one width further: its length along the line \[m\]
    /// and its distance \[m\]. A copy that takes a short cut beyond the next width makes no progress by it. Of equally near points the first counts.
    #[must_use]
    pub fn nearest(&self, position: [f64; 3], progress: f64) -> (f64, f64) {
        let last = self.length().min(progress + self.width);
        let (mut nearest, mut begin) = ((progress, f64::INFINITY), 0.0);
        for corners in self.points.windows(2) {
            let length = distance(corners[0], corners[1]);
            let end = begin + length;
            if end >= progress && begin <= last {
                let [a, b] = [corners[0], corners[1]];
                // Neighbouring corners differ, as the reader of scenes has checked, so no leg has the length zero.
                let projected = (0..3).map(|axis| (position[axis] - a[axis]) * (b[axis] - a[axis])).sum::<f64>() / length;
                let (low, high) = ((progress - begin).max(0.0), (last - begin).min(length));
                // The ends are taken as they are: a rounded sum would never be the length of the line.
                let (along, at) = if projected >= high { (high, last.min(end)) } else { (projected.max(low), begin + projected.max(low)) };
                let away = distance(position, between(corners, along / length));
                // A strict comparison keeps the first of equally near points, as at a corner that belongs to two legs.
                if away < nearest.1 {
                    nearest = (at, away);
                }
            }
            begin = end;
        }
        nearest
    }
}

/// Returns a point of the line from one corner to the next, at a part of the way from 0 to 1.
fn between(corners: &[[f64; 3]], part: f64) -> [f64; 3] {
    core::array::from_fn(|axis| corners[0][axis] + part * (corners[1][axis] - corners[0][axis]))
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| (a[axis] - b[axis]) * (a[axis] - b[axis])).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A line to the right and then up, of 0.1 and 0.2 m.
    fn corner() -> PathTask {
        PathTask { points: vec![[0.0; 3], [0.1, 0.0, 0.0], [0.1, 0.2, 0.0]], width: 0.05, leave: Leave::Count }
    }

    #[test]
    fn points_lie_on_the_line() {
        let path = corner();
        assert!((path.length() - 0.3).abs() < 1e-15);
        for (along, expected) in [(-1.0, [0.0, 0.0]), (0.04, [0.04, 0.0]), (0.1, [0.1, 0.0]), (0.2, [0.1, 0.1]), (9.0, [0.1, 0.2])] {
            let [x, y, _] = path.point(along);
            assert!((x - expected[0]).abs() < 1e-15 && (y - expected[1]).abs() < 1e-15, "{along}: {x} {y}");
        }
    }

    #[test]
    fn progress_goes_at_most_one_width_further_and_never_back() {
        let path = corner();
        let near = |position: [f64; 2], progress: f64| {
            let (along, away) = path.nearest([position[0], position[1], 0.0], progress);
            ((along * 1e6).round(), (away * 1e6).round())
        };
        assert_eq!(near([0.03, 0.004], 0.0), (30_000.0, 4_000.0));
        assert_eq!(near([0.01, 0.0], 0.03), (30_000.0, 20_000.0));
        // Around the corner, and across it: the nearest point of the whole line is 0.2 m further.
        assert_eq!(near([0.103, 0.02], 0.09), (120_000.0, 3_000.0));
        assert_eq!(near([0.1, 0.2], 0.05), (100_000.0, 200_000.0));
        // A point beside the leg before, which is behind the progress.
        assert_eq!(near([0.13, 0.0], 0.15), (150_000.0, 58_310.0));
        for place in 1..100 {
            let up = 0.013 * f64::from(place);
            let path = PathTask { points: vec![[0.0; 3], [0.1, 0.0, 0.0], [0.1, up, 0.0]], ..corner() };
            assert_eq!(path.nearest([0.1, 2.0, 0.0], path.length() - 0.01).0.to_bits(), path.length().to_bits(), "{up}");
        }
    }

    #[test]
    fn the_end_begins_a_hundredth_of_the_width_before_the_last_point() {
        let path = corner();
        assert!(path.is_at_end(path.length()) && path.is_at_end(0.2996) && !path.is_at_end(0.2994));
    }

    #[test]
    fn the_first_of_equally_near_points_counts() {
        let path = PathTask { points: vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 2.0, 0.0]], width: 1.0, leave: Leave::Count };
        assert_eq!(path.nearest([0.75, 0.25, 0.0], 0.5), (0.75, 0.25));
    }
}
