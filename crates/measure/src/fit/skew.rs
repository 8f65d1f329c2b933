//! The drift of one clock against another, from one-way delays.

use serde::Serialize;

/// The linear drift of the receiver's clock against the sender's.
///
/// Of all lines below every point (sending, delay), the one with the least sum of distances: it lies along the packets that waited least (Moon, Skelly
/// & Towsley 1999, INFOCOM, "Estimation and removal of clock skew from network delay measurements"). A path whose least delay itself grows linearly
/// looks the same. The constant offset of the clocks cannot be found from one direction.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
#[non_exhaustive]
pub struct Skew {
    /// Seconds that the receiver's clock gains each second of the sender's.
    pub seconds_per_second: f64,
}

impl Skew {
    /// `points` are in the order of sending.
    pub(super) fn of(points: &[(f64, f64)]) -> Option<Self> {
        let hull = lower_hull(points);
        // The sum of distances Σ(d − αt − β) of a supporting line falls as it comes to the point above the mean of t: so the edge there is the best.
        let mean = crate::series::mean(&points.iter().map(|point| point.0).collect::<Vec<_>>())?;
        let edge = hull.windows(2).find(|edge| edge[1].0 >= mean)?;
        Some(Self { seconds_per_second: (edge[1].1 - edge[0].1) / (edge[1].0 - edge[0].0) })
    }
}

/// The lower convex hull from left to right (Andrew 1979), one point for every abscissa.
fn lower_hull(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut hull: Vec<(f64, f64)> = Vec::new();
    for &point in points {
        if let Some(last) = hull.last_mut()
            && last.0 >= point.0
        {
            if point.1 >= last.1 {
                continue;
            }
            hull.pop();
        }
        while let [.., before, last] = hull[..]
            && (last.0 - before.0) * (point.1 - before.1) <= (last.1 - before.1) * (point.0 - before.0)
        {
            hull.pop();
        }
        hull.push(point);
    }
    hull
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, Exp1};

    use super::*;
    use crate::test_rng::TestRng;

    #[test]
    fn drift_is_found_below_the_queueing() {
        // 20 000 packets in 160 s, exponential queueing of mean 2 ms, drift 50 ppm (8 ms in all, four times the jitter).
        let mut rng = TestRng::new(3);
        let points: Vec<(f64, f64)> = (0..20_000_u32)
            .map(|i| {
                let queueing: f64 = Exp1.sample(&mut rng);
                let t = f64::from(i) * 0.008;
                (t, 0.02 + 50e-6 * t + 0.002 * queueing)
            })
            .collect();
        let skew = Skew::of(&points).unwrap().seconds_per_second;
        // The lower ends of both halves are known to 2 ms/10 000 = 0.2 µs: over 80 s, 2.5e-9. Allowed: ten times that.
        assert!((skew - 50e-6).abs() < 2.5e-8, "{skew}");
    }

    #[test]
    fn the_line_is_the_best_of_all_lines_through_two_points() {
        let mut rng = TestRng::new(8);
        for _ in 0..200 {
            let mut points: Vec<(f64, f64)> = (0..12).map(|_| ((rng.unit() * 6.0).floor(), rng.unit())).collect();
            points.sort_by(|one, other| one.0.total_cmp(&other.0));
            let Some(Skew { seconds_per_second: slope }) = Skew::of(&points) else { continue };
            let cost = |slope: f64| {
                let height = points.iter().map(|(t, d)| d - slope * t).fold(f64::INFINITY, f64::min);
                points.iter().map(|(t, d)| d - slope * t - height).sum::<f64>()
            };
            for (i, one) in points.iter().enumerate() {
                for other in points[i + 1..].iter().filter(|other| other.0 > one.0) {
                    assert!(cost(slope) <= cost((other.1 - one.1) / (other.0 - one.0)) + 1e-9);
                }
            }
        }
    }

    #[test]
    fn one_instant_has_no_slope() {
        assert_eq!(Skew::of(&[(1.0, 0.3), (1.0, 0.2)]), None);
        assert_eq!(Skew::of(&[]), None);
    }
}
