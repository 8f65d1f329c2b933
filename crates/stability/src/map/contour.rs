//! Lines of equal radius by marching squares.
//!
//! Pieces of line cross each square of four neighbouring nodes. A piece enters and leaves where the two nodes of a side lie on different sides of the level.
//! Pieces have a direction, the stable side on their left, so each crossing ends a piece and begins the next piece, and following the pieces gives the lines.

use std::collections::BTreeMap;

use super::Map;

/// A line through the plane of a map.
#[derive(Clone, PartialEq, Debug)]
pub struct Polyline {
    /// Points (x, y) of the line. A closed line does not repeat its first point at the end.
    pub points: Vec<(f64, f64)>,
    /// `true` if the line goes on from the last point to the first.
    pub closed: bool,
}

impl Polyline {
    /// Returns the points to draw the line through. A closed line ends with its first point again.
    #[must_use]
    pub fn path(&self) -> Vec<(f64, f64)> {
        let again = self.points.first().filter(|_| self.closed);
        self.points.iter().chain(again).copied().collect()
    }
}

impl Map {
    /// Returns the lines where the radius is 1, with the stable side on their left, x to the right and y up. A line without an end at the edge of the map is
    /// closed. Between two nodes the logarithm of the radius is taken to be linear; rows without values count as unstable.
    #[must_use]
    pub fn contour(&self) -> Vec<Polyline> {
        contour(self, false)
    }

    /// Returns the stable region as closed polylines along its edge and the edge of the map, anticlockwise around stable cells and clockwise around holes. Both
    /// fill rules (even-odd and nonzero) give the region.
    #[must_use]
    pub fn regions(&self) -> Vec<Polyline> {
        contour(self, true)
    }
}

/// A side of a square, from the node at `row` and `column` to the next node to the right, or to the next node up.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
struct Side {
    row: usize,
    column: usize,
    up: bool,
}

/// A map with a margin of nodes around it, 1 wide for lines closed along the edge of the map, otherwise 0.
struct Field<'a> {
    map: &'a Map,
    margin: usize,
}

impl Field<'_> {
    fn columns(&self) -> usize {
        self.map.x.len() + 2 * self.margin
    }

    fn rows(&self) -> usize {
        self.map.y.len() + 2 * self.margin
    }

    /// Returns the logarithm of the radius at a node, below zero at stable nodes; the margin has the largest level.
    fn level(&self, row: usize, column: usize) -> f64 {
        // The exact size of radii beyond e^±50 does not matter, and infinite levels would have no point between them.
        const LARGEST: f64 = 50.0;
        match self.radius(row, column) {
            Some(radius) if radius.is_nan() => LARGEST,
            Some(radius) => libm::log(radius).clamp(-LARGEST, LARGEST),
            None => LARGEST,
        }
    }

    fn stable(&self, row: usize, column: usize) -> bool {
        self.radius(row, column).is_some_and(|radius| radius < 1.0)
    }

    fn radius(&self, row: usize, column: usize) -> Option<f64> {
        let row = self.map.radius.get(row.checked_sub(self.margin)?)?;
        row.get(column.checked_sub(self.margin)?).copied()
    }

    /// Returns the point of a side at which the level is zero. The margin lies on the edge of the map itself.
    fn point(&self, side: Side) -> (f64, f64) {
        let (row, column) = if side.up { (side.row + 1, side.column) } else { (side.row, side.column + 1) };
        let (from, to) = (self.level(side.row, side.column), self.level(row, column));
        // The two levels have different signs, so the difference is not zero and the share lies between 0 and 1.
        let share = from / (from - to);
        let at = |values: &[f64], place: usize| values[place.saturating_sub(self.margin).min(values.len() - 1)];
        let between = |values: &[f64], first: usize, second: usize| {
            let (first, second) = (at(values, first), at(values, second));
            first + (second - first) * share
        };
        (between(&self.map.x, side.column, column), between(&self.map.y, side.row, row))
    }

    /// Returns the directed pieces of line, from one side to another, within the square above and to the right of a node.
    fn pieces(&self, row: usize, column: usize) -> [Option<(Side, Side)>; 2] {
        let corners = [(row, column), (row, column + 1), (row + 1, column + 1), (row + 1, column)];
        let [a, b, c, d] = corners.map(|(row, column)| self.stable(row, column));
        let bottom = Side { row, column, up: false };
        let right = Side { row, column: column + 1, up: true };
        let top = Side { row: row + 1, column, up: false };
        let left = Side { row, column, up: true };
        // A piece runs from the side with the stable node on its left. Two adjacent squares give a common side to one piece as its end and to one as its start.
        match (a, b, c, d) {
            (false, false, false, false) | (true, true, true, true) => [None, None],
            (true, false, false, false) => [Some((bottom, left)), None],
            (false, true, false, false) => [Some((right, bottom)), None],
            (false, false, true, false) => [Some((top, right)), None],
            (false, false, false, true) => [Some((left, top)), None],
            (true, true, false, false) => [Some((right, left)), None],
            (false, true, true, false) => [Some((top, bottom)), None],
            (false, false, true, true) => [Some((left, right)), None],
            (true, false, false, true) => [Some((bottom, top)), None],
            (false, true, true, true) => [Some((left, bottom)), None],
            (true, false, true, true) => [Some((bottom, right)), None],
            (true, true, false, true) => [Some((right, top)), None],
            (true, true, true, false) => [Some((top, left)), None],
            // At a saddle the level in the middle decides whether the two stable corners are connected.
            (true, false, true, false) | (false, true, false, true) => {
                let middle = corners.map(|(row, column)| self.level(row, column)).iter().sum::<f64>();
                match (a, middle < 0.0) {
                    (true, true) => [Some((bottom, right)), Some((top, left))],
                    (true, false) => [Some((bottom, left)), Some((top, right))],
                    (false, true) => [Some((left, bottom)), Some((right, top))],
                    (false, false) => [Some((right, bottom)), Some((left, top))],
                }
            }
        }
    }
}

/// Returns every line in the order of first sides: first the lines that end at the edge of the map, then the closed lines.
pub(super) fn contour(map: &Map, to_the_edge: bool) -> Vec<Polyline> {
    let field = Field { map, margin: usize::from(to_the_edge) };
    let mut next: BTreeMap<Side, Side> = BTreeMap::new();
    for row in 0..field.rows().saturating_sub(1) {
        for column in 0..field.columns().saturating_sub(1) {
            next.extend(field.pieces(row, column).into_iter().flatten());
        }
    }
    // A side without a piece ending there lies on the edge of the map, and an open line begins there. All remaining lines are closed.
    let ends: std::collections::BTreeSet<Side> = next.values().copied().collect();
    let open: Vec<Side> = next.keys().filter(|side| !ends.contains(side)).copied().collect();
    let mut lines = Vec::new();
    for first in open {
        lines.push(Polyline { points: follow(&field, &mut next, first), closed: false });
    }
    while let Some(first) = next.keys().next().copied() {
        let mut points = follow(&field, &mut next, first);
        // A closed line has reached its first point again, which is not repeated.
        points.pop();
        lines.push(Polyline { points, closed: true });
    }
    lines
}

fn follow(field: &Field<'_>, next: &mut BTreeMap<Side, Side>, first: Side) -> Vec<(f64, f64)> {
    let mut points = vec![field.point(first)];
    let mut side = first;
    while let Some(following) = next.remove(&side) {
        points.push(field.point(following));
        side = following;
    }
    points
}
