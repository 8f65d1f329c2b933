//! Paths in pixels: cut at the edge of a panel, thinned to visible points, and written with two decimals.

use std::fmt::Write as _;

use crate::xml::coordinate;

/// Area of a plot \[px\]. y grows downwards.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Frame {
    pub(crate) left: f64,
    pub(crate) top: f64,
    pub(crate) right: f64,
    pub(crate) bottom: f64,
}

type Point = (f64, f64);
/// A side of a frame: access to the limited coordinate, its value, and the sign of inside (1 for greater, −1 for lesser values).
type Side = (fn(Point) -> f64, f64, f64);

impl Frame {
    pub(crate) fn width(&self) -> f64 {
        self.right - self.left
    }

    pub(crate) fn height(&self) -> f64 {
        self.bottom - self.top
    }

    /// Returns whether a point is inside, up to the rounding of coordinates.
    pub(crate) fn contains(&self, (x, y): Point) -> bool {
        (self.left - 0.01..=self.right + 0.01).contains(&x) && (self.top - 0.01..=self.bottom + 0.01).contains(&y)
    }

    /// Returns the part of a segment inside the frame (Liang & Barsky 1984); `None` if no part is inside.
    fn segment(&self, from: Point, to: Point) -> Option<(Point, Point)> {
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        // A point at the share t of the segment is inside a side as long as t·step ≤ room.
        for (step, room) in [(-dx, from.0 - self.left), (dx, self.right - from.0), (-dy, from.1 - self.top), (dy, self.bottom - from.1)] {
            if step == 0.0 {
                if room < 0.0 {
                    return None;
                }
            } else if step < 0.0 {
                enter = enter.max(room / step);
            } else {
                leave = leave.min(room / step);
            }
        }
        let at = |t: f64| (from.0 + t * dx, from.1 + t * dy);
        (enter <= leave).then(|| (if enter > 0.0 { at(enter) } else { from }, if leave < 1.0 { at(leave) } else { to }))
    }

    /// Returns the parts of a line inside the frame.
    pub(crate) fn cut_line(&self, points: &[Point]) -> Vec<Vec<Point>> {
        if let [alone] = points {
            return if self.contains(*alone) { vec![vec![*alone]] } else { Vec::new() };
        }
        let mut runs: Vec<Vec<Point>> = Vec::new();
        for pair in points.windows(2) {
            let Some((from, to)) = self.segment(pair[0], pair[1]) else { continue };
            match runs.last_mut() {
                // Continues the present part only if the segment begins where the part ended, without a cut.
                Some(run) if run.last().is_some_and(|last| near(*last, from) && near(pair[0], from)) => run.push(to),
                _ => runs.push(vec![from, to]),
            }
        }
        runs
    }

    /// Returns the part of a closed outline inside the frame (Sutherland & Hodgman 1974).
    pub(crate) fn cut_outline(&self, outline: &[Point]) -> Vec<Point> {
        let sides: [Side; 4] = [(|p| p.0, self.left, 1.0), (|p| p.0, self.right, -1.0), (|p| p.1, self.top, 1.0), (|p| p.1, self.bottom, -1.0)];
        let mut points = outline.to_vec();
        for (of, edge, sign) in sides {
            let room = |point: Point| sign * (of(point) - edge);
            let mut kept = Vec::new();
            for (place, to) in points.iter().copied().enumerate() {
                // Adding the length keeps the index of the point before the first from falling below zero.
                let from = points[(place + points.len() - 1) % points.len()];
                // Neighbours on both sides of the edge: the crossing becomes a corner of the part inside.
                if (room(from) < 0.0) != (room(to) < 0.0) {
                    let t = room(from) / (room(from) - room(to));
                    kept.push((from.0 + t * (to.0 - from.0), from.1 + t * (to.1 - from.1)));
                }
                if room(to) >= 0.0 {
                    kept.push(to);
                }
            }
            points = kept;
        }
        points
    }
}

fn near(one: Point, other: Point) -> bool {
    (one.0 - other.0).abs() < 1e-6 && (one.1 - other.1).abs() < 1e-6
}

/// Width of a column of which only the first, lowest, highest and last point are kept \[px\], narrower than any line.
const COLUMN: f64 = 0.5;

/// Removes invisible points: of each column only the first, lowest, highest and last point stay (M4 of Jugel et al. 2014), and then no points on straight
/// lines.
pub(crate) fn reduced(points: &[Point]) -> Vec<Point> {
    let mut kept: Vec<Point> = Vec::new();
    for column in points.chunk_by(|one, other| (one.0 / COLUMN).floor().to_bits() == (other.0 / COLUMN).floor().to_bits()) {
        if column.len() <= 4 {
            kept.extend(column);
            continue;
        }
        let by_height = |one: &(usize, &Point), other: &(usize, &Point)| one.1.1.total_cmp(&other.1.1);
        let lowest = column.iter().enumerate().min_by(by_height).map_or(0, |(place, _)| place);
        let highest = column.iter().enumerate().max_by(by_height).map_or(0, |(place, _)| place);
        // In order of the line, and without duplicates, since the lowest point may be the first, for example.
        let mut places = [0, lowest, highest, column.len() - 1];
        places.sort_unstable();
        for (order, place) in places.iter().enumerate() {
            if order == 0 || places[order - 1] != *place {
                kept.push(column[*place]);
            }
        }
    }
    straightened(&kept)
}

/// Removes points within 1/200 px of the straight line between the points that stay.
fn straightened(points: &[Point]) -> Vec<Point> {
    /// Largest number of points removed in a row. Each of them is checked again for every following point, so the limit bounds the work.
    const MOST: usize = 100;
    let mut kept: Vec<Point> = points.first().copied().into_iter().collect();
    let mut from = 0;
    for to in 2..=points.len() {
        // Grows the straight piece as long as all points between its ends stay close to it.
        let straight = to < points.len() && to - from < MOST && points[from + 1..to].iter().all(|point| between(points[from], *point, points[to]));
        if !straight && to > from + 1 {
            kept.push(points[to - 1]);
            from = to - 1;
        }
    }
    kept
}

/// Returns whether `point` is on the segment from `from` to `to`, within 1/200 px.
fn between(from: Point, point: Point, to: Point) -> bool {
    let (ax, ay, bx, by) = (point.0 - from.0, point.1 - from.1, to.0 - from.0, to.1 - from.1);
    let length = libm::hypot(bx, by);
    let ahead = ax * bx + ay * by;
    // Equal ends are no line: a point between them is the tip of a spike, and stays.
    length > 0.0 && (ax * by - ay * bx).abs() < 0.005 * length && (0.0..=length * length).contains(&ahead)
}

/// Returns the attribute `d` of a path through runs of points.
pub(crate) fn data(runs: &[Vec<Point>], closed: bool) -> String {
    let mut text = String::new();
    for run in runs {
        for (place, (x, y)) in run.iter().enumerate() {
            let _ = write!(text, "{}{},{}", if place == 0 { 'M' } else { 'L' }, coordinate(*x), coordinate(*y));
        }
        if closed {
            text.push('Z');
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Frame = Frame { left: 0.0, top: 0.0, right: 10.0, bottom: 10.0 };

    #[test]
    fn a_line_is_cut_where_it_leaves_the_panel_and_comes_back() {
        let runs = FRAME.cut_line(&[(1.0, 5.0), (5.0, 15.0), (9.0, 5.0), (20.0, 5.0)]);
        assert_eq!(runs, [vec![(1.0, 5.0), (3.0, 10.0)], vec![(7.0, 10.0), (9.0, 5.0), (10.0, 5.0)]]);
        assert!(FRAME.cut_line(&[(20.0, 0.0), (20.0, 9.0)]).is_empty());
    }

    #[test]
    fn an_outline_is_cut_at_the_edges() {
        let cut = FRAME.cut_outline(&[(5.0, 5.0), (15.0, 5.0), (15.0, 15.0), (5.0, 15.0)]);
        assert_eq!(cut.len(), 4);
        assert!(cut.iter().all(|point| FRAME.contains(*point)), "{cut:?}");
    }

    #[test]
    fn a_long_line_keeps_its_extremes_in_every_column_and_a_straight_one_its_ends() {
        let wave: Vec<Point> = (0..100_000_u32).map(|n| (f64::from(n) / 1000.0, if n == 31_415 { 9.0 } else { f64::from(n % 7) })).collect();
        let kept = reduced(&wave);
        assert!(kept.len() <= 4 * 201 && kept.contains(&(31.415, 9.0)), "{}", kept.len());
        let straight: Vec<Point> = (0..1000_u32).map(|n| (f64::from(n), 0.5 * f64::from(n))).collect();
        let kept = reduced(&straight);
        assert!(kept.len() < 20 && kept.first() == straight.first() && kept.last() == straight.last(), "{kept:?}");
        // An arc of fine steps, each nearly straight although the whole is not.
        let arc: Vec<Point> =
            (0..=2000_u32).map(|n| f64::from(n) / 2000.0 * 3.0).map(|turn| (50.0 * (1.0 - turn.cos()), 50.0 * turn.sin())).collect();
        let kept = straightened(&arc);
        let sag = |pair: &[Point]| 50.0 - (0.5 * (pair[0].0 + pair[1].0) - 50.0).hypot(0.5 * (pair[0].1 + pair[1].1));
        assert!(kept.windows(2).all(|pair| sag(pair) < 0.02), "{kept:?}");
    }
}
