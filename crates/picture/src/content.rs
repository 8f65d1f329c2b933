//! Contents of a panel: lines, bands, regions, heat maps and marks.

use crate::extent::{Extent, Scale, count};
use crate::look::{Fill, Look, Marker};
use crate::text::Text;

/// Points joined by a line, marked, or both. The line is interrupted at a point that is not finite.
#[derive(Clone, PartialEq, Debug)]
pub struct Line {
    pub(crate) name: Text,
    pub(crate) look: Look,
    /// Parts of the line, each with at least one point. All points are finite.
    pub(crate) runs: Vec<Vec<(f64, f64)>>,
    pub(crate) joined: bool,
    pub(crate) marker: Option<Marker>,
}

impl Line {
    /// Creates a line through points.
    #[must_use]
    pub fn new(points: impl IntoIterator<Item = (f64, f64)>, look: Look) -> Self {
        Self::runs([points], look)
    }

    /// Creates a line of several parts, not joined to each other.
    #[must_use]
    pub fn runs<P: IntoIterator<Item = (f64, f64)>>(runs: impl IntoIterator<Item = P>, look: Look) -> Self {
        let mut parted: Vec<Vec<(f64, f64)>> = Vec::new();
        for run in runs {
            // Each run begins a part of its own, so that runs are never joined.
            parted.push(Vec::new());
            for (x, y) in run {
                match parted.last_mut() {
                    Some(last) if x.is_finite() && y.is_finite() => last.push((x, y)),
                    // A point that is not finite ends the part: no line may cross the gap.
                    _ => parted.push(Vec::new()),
                }
            }
        }
        parted.retain(|run| !run.is_empty());
        Self { name: Text::default(), look, runs: parted, joined: true, marker: None }
    }

    /// Creates a step line: each value holds until the next x.
    #[must_use]
    pub fn steps(points: impl IntoIterator<Item = (f64, f64)>, look: Look) -> Self {
        let mut stairs: Vec<(f64, f64)> = Vec::new();
        for (x, y) in points {
            // A step has two corners: the old value at the new x, then the new value.
            if let Some((_, before)) = stairs.last().copied() {
                stairs.push((x, before));
            }
            stairs.push((x, y));
        }
        Self::new(stairs, look)
    }

    /// Creates the empirical distribution function of values: at x, the share of values at or below x. Ignores values that are not finite.
    #[must_use]
    pub fn distribution(values: impl IntoIterator<Item = f64>, look: Look) -> Self {
        let mut values: Vec<f64> = values.into_iter().filter(|value| value.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        let all = count(values.len());
        // The function begins at zero, so that the first value shows a step, too.
        let first = values.first().map(|value| (*value, 0.0));
        let shares = values.iter().enumerate().map(|(place, value)| (*value, count(place + 1) / all));
        Self::steps(first.into_iter().chain(shares), look)
    }

    /// Creates a horizontal reference line over the whole panel.
    #[must_use]
    pub fn level(y: f64) -> Self {
        // A line without ends: `extents` leaves out ±f64::MAX, so that the line does not widen an axis.
        Self::new([(f64::MIN, y), (f64::MAX, y)], Look::reference())
    }

    /// Creates a vertical reference line over the whole panel.
    #[must_use]
    pub fn upright(x: f64) -> Self {
        Self::new([(x, f64::MIN), (x, f64::MAX)], Look::reference())
    }

    /// Sets the name for the legend.
    #[must_use]
    pub fn named(self, name: impl Into<Text>) -> Self {
        Self { name: name.into(), ..self }
    }

    /// Sets the look.
    #[must_use]
    pub fn look(self, look: Look) -> Self {
        Self { look, ..self }
    }

    /// Marks each point. Points at the same place are marked once.
    #[must_use]
    pub fn marked(self, marker: Marker) -> Self {
        Self { marker: Some(marker), ..self }
    }

    /// Marks each point, and leaves out the line.
    #[must_use]
    pub fn marks_only(self, marker: Marker) -> Self {
        Self { joined: false, ..self.marked(marker) }
    }
}

/// The area between two curves, such as two quantiles, or minimum and maximum.
#[derive(Clone, PartialEq, Debug)]
pub struct Band {
    pub(crate) name: Text,
    pub(crate) fill: Fill,
    /// Parts of the band as (x, low, high), each with at least two points. All numbers are finite.
    pub(crate) runs: Vec<Vec<(f64, f64, f64)>>,
}

impl Band {
    /// Creates a band of (x, low, high). The band is interrupted at a point that is not finite.
    #[must_use]
    pub fn new(points: impl IntoIterator<Item = (f64, f64, f64)>, fill: Fill) -> Self {
        let mut runs = vec![Vec::new()];
        for (x, low, high) in points {
            match runs.last_mut() {
                Some(run) if x.is_finite() && low.is_finite() && high.is_finite() => run.push((x, low, high)),
                _ => runs.push(Vec::new()),
            }
        }
        // A single x spans no area.
        runs.retain(|run: &Vec<_>| run.len() > 1);
        Self { name: Text::default(), fill, runs }
    }

    /// Sets the name for the legend.
    #[must_use]
    pub fn named(self, name: impl Into<Text>) -> Self {
        Self { name: name.into(), ..self }
    }
}

/// An area inside closed outlines, with or without a border. A place inside an even number of outlines is outside, so an inner outline is a hole.
///
/// ```
/// use cohaptic_picture::{Fill, Look, Region};
///
/// let triangle = vec![(0.0, 0.0), (2.0, 0.0), (0.0, 2.0)];
/// // Only the slope is drawn as a line: the other sides lie on the axes.
/// let stable = Region::new([triangle], Fill::Tint(0)).bordered([[(2.0, 0.0), (0.0, 2.0)]], Look::of(0)).named("stable");
/// ```
#[derive(Clone, PartialEq, Debug)]
pub struct Region {
    pub(crate) name: Text,
    pub(crate) fill: Fill,
    pub(crate) outlines: Vec<Vec<(f64, f64)>>,
    /// Line on the border of the area. `None` for an area without such a line.
    pub(crate) border: Option<Line>,
}

impl Region {
    /// Creates a region from outlines, closed automatically. Ignores outlines of fewer than three points, or with a point that is not finite.
    #[must_use]
    pub fn new(outlines: impl IntoIterator<Item = Vec<(f64, f64)>>, fill: Fill) -> Self {
        // An outline of two points has no inside. An outline without one of its points would have another shape, so the whole outline is left out.
        let finite = |outline: &Vec<(f64, f64)>| outline.len() > 2 && outline.iter().all(|(x, y)| x.is_finite() && y.is_finite());
        Self { name: Text::default(), fill, outlines: outlines.into_iter().filter(finite).collect(), border: None }
    }

    /// Creates a region of the grid cells (column, row) with `shown` true. `xs` and `ys` are values at the centres of columns and rows, ascending. A cell
    /// reaches halfway to the next centre, and an outermost cell ends at its centre.
    #[must_use]
    pub fn cells(xs: &[f64], ys: &[f64], fill: Fill, shown: impl Fn(usize, usize) -> bool) -> Self {
        Self::between(&edges(xs), &edges(ys), fill, shown)
    }

    /// Creates a region of the grid cells (column, row) with `shown` true. `columns` and `rows` are the edges of the cells, ascending, one more than cells.
    #[must_use]
    pub fn between(columns: &[f64], rows: &[f64], fill: Fill, shown: impl Fn(usize, usize) -> bool) -> Self {
        let (across, up) = (columns.len().saturating_sub(1), rows.len().saturating_sub(1));
        let mut outlines = Vec::new();
        for row in 0..up {
            let mut column = 0;
            // Neighbouring cells of a row become one rectangle, which keeps the document small.
            while column < across {
                let begin = column;
                while column < across && shown(column, row) {
                    column += 1;
                }
                if column > begin {
                    let (left, right, low, high) = (columns[begin], columns[column], rows[row], rows[row + 1]);
                    outlines.push(vec![(left, low), (right, low), (right, high), (left, high)]);
                } else {
                    column += 1;
                }
            }
        }
        Self { name: Text::default(), fill, outlines, border: None }
    }

    /// Draws lines over the area, such as the part of the outlines that is not an end of an axis. The sample in the legend has the same border, so that areas
    /// in front of each other are told apart without colours.
    #[must_use]
    pub fn bordered<P: IntoIterator<Item = (f64, f64)>>(self, lines: impl IntoIterator<Item = P>, look: Look) -> Self {
        Self { border: Some(Line::runs(lines, look)), ..self }
    }

    /// Sets the name for the legend.
    #[must_use]
    pub fn named(self, name: impl Into<Text>) -> Self {
        Self { name: name.into(), ..self }
    }
}

/// A grid of values shown as colours, with a colour bar to the right of the panel. The colours are cividis: their lightness rises evenly, and they look
/// alike with and without colour blindness (Nuñez, Anderton & Renslow 2018).
#[derive(Clone, PartialEq, Debug)]
pub struct HeatMap {
    /// Edges of the columns and of the rows, one more than columns and rows.
    pub(crate) columns: Vec<f64>,
    pub(crate) rows: Vec<f64>,
    /// Values, indexed by row, then by column.
    pub(crate) values: Vec<Vec<f64>>,
    pub(crate) axis: crate::Axis,
}

impl HeatMap {
    /// Creates a map of values, indexed by row (y), then by column (x), at ascending centres. Values that are not finite have no colour. `axis` is the axis
    /// of the colour bar.
    ///
    /// # Panics
    ///
    /// If the numbers of rows and columns of values differ from the numbers of centres.
    #[must_use]
    pub fn new(xs: &[f64], ys: &[f64], values: Vec<Vec<f64>>, axis: crate::Axis) -> Self {
        assert!(values.len() == ys.len() && values.iter().all(|row| row.len() == xs.len()), "a value for each cell");
        Self { columns: edges(xs), rows: edges(ys), values, axis }
    }

    /// Creates a map of values, indexed by row (y), then by column (x), of cells between ascending edges, one more than cells.
    ///
    /// # Panics
    ///
    /// If the numbers of rows and columns of values do not fit the numbers of edges.
    #[must_use]
    pub fn between(columns: Vec<f64>, rows: Vec<f64>, values: Vec<Vec<f64>>, axis: crate::Axis) -> Self {
        assert!(values.len() + 1 == rows.len() && values.iter().all(|row| row.len() + 1 == columns.len()), "a value for each cell");
        Self { columns, rows, values, axis }
    }

    /// Returns the range of the colours, from the lowest to the highest value.
    pub(crate) fn extent(&self) -> Extent {
        let logarithmic = self.axis.scale == Scale::Logarithmic;
        let finite = self.values.iter().flatten().copied().filter(|value| value.is_finite() && (!logarithmic || *value > 0.0));
        // The colour bar ends at the values: a margin would give colours to absent values.
        self.axis.clone().tight().shown(span(finite))
    }
}

/// Short marks at the foot of the panel, such as instants of losses.
#[derive(Clone, PartialEq, Debug)]
pub struct Rug {
    pub(crate) name: Text,
    pub(crate) look: Look,
    pub(crate) xs: Vec<f64>,
}

impl Rug {
    /// Creates a mark at each x. Ignores values that are not finite.
    #[must_use]
    pub fn new(xs: impl IntoIterator<Item = f64>, look: Look) -> Self {
        Self { name: Text::default(), look, xs: xs.into_iter().filter(|x| x.is_finite()).collect() }
    }

    /// Sets the name for the legend.
    #[must_use]
    pub fn named(self, name: impl Into<Text>) -> Self {
        Self { name: name.into(), ..self }
    }
}

/// Content of a panel, of any kind.
#[derive(Clone, PartialEq, Debug)]
pub enum Content {
    /// A line, marks, or both.
    Line(Line),
    /// An area between two curves.
    Band(Band),
    /// An area inside outlines.
    Region(Region),
    /// A grid of colours.
    HeatMap(HeatMap),
    /// Marks at the foot.
    Rug(Rug),
}

macro_rules! content_from {
    ($($kind:ident),*) => {$(
        impl From<$kind> for Content {
            fn from(content: $kind) -> Self {
                Self::$kind(content)
            }
        }
    )*};
}
content_from!(Line, Band, Region, HeatMap, Rug);

/// Ranges of x and of y, each from lowest to highest; `None` without a value.
pub(crate) type Reach = (Option<(f64, f64)>, Option<(f64, f64)>);

impl Content {
    /// Returns the ranges of x and y of the content. Ignores reference lines, which have no end, and values without a place on axes of the given scales.
    pub(crate) fn extents(&self, x: Scale, y: Scale) -> Reach {
        // Reference lines reach to ±f64::MAX and must not widen the axes.
        let placed = |scale: Scale| move |value: &f64| value.abs() < f64::MAX && (scale == Scale::Linear || *value > 0.0);
        let of = |points: &mut dyn Iterator<Item = (f64, f64)>| {
            let points: Vec<(f64, f64)> = points.collect();
            (span(points.iter().map(|(x, _)| *x).filter(placed(x))), span(points.iter().map(|(_, y)| *y).filter(placed(y))))
        };
        match self {
            Self::Line(line) => of(&mut line.runs.iter().flatten().copied()),
            Self::Band(band) => of(&mut band.runs.iter().flatten().flat_map(|(x, low, high)| [(*x, *low), (*x, *high)])),
            Self::Region(region) => of(&mut region.outlines.iter().flatten().copied()),
            Self::HeatMap(map) => (span(map.columns.iter().copied().filter(placed(x))), span(map.rows.iter().copied().filter(placed(y)))),
            Self::Rug(rug) => (span(rug.xs.iter().copied().filter(placed(x))), None),
        }
    }
}

/// Returns the ranges that cover two contents.
pub(crate) fn together((one_x, one_y): Reach, (other_x, other_y): Reach) -> Reach {
    let join = |one: Option<(f64, f64)>, other: Option<(f64, f64)>| match (one, other) {
        (Some((a, b)), Some((c, d))) => Some((a.min(c), b.max(d))),
        (one, other) => one.or(other),
    };
    (join(one_x, other_x), join(one_y, other_y))
}

fn span(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.fold(None, |found, value| Some(found.map_or((value, value), |(low, high): (f64, f64)| (low.min(value), high.max(value)))))
}

/// Returns the edges of cells with given centres: halfway between centres, and the centre itself at both ends. A single centre gets half a unit on each side.
pub(crate) fn edges(values: &[f64]) -> Vec<f64> {
    let (Some(first), Some(last)) = (values.first(), values.last()) else { return vec![0.0] };
    if values.len() == 1 {
        return vec![first - 0.5, last + 0.5];
    }
    let between = values.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
    std::iter::once(*first).chain(between).chain([*last]).collect()
}

/// Returns the edges of cells with given ascending centres, for [`HeatMap::between`] and [`Region::between`]: halfway between centres on a linear or
/// logarithmic axis, and the centre itself at both ends, so that no axis reaches beyond the values.
#[must_use]
pub fn cell_edges(values: &[f64], logarithmic: bool) -> Vec<f64> {
    match values {
        [first, .., last] if logarithmic => {
            // The middle on a logarithmic axis is the geometric mean. Two roots, because the product of two values could overflow.
            let between = values.windows(2).map(|pair| libm::sqrt(pair[0]) * libm::sqrt(pair[1]));
            std::iter::once(*first).chain(between).chain([*last]).collect()
        }
        // Without a neighbour there is no border to share: a factor of two on each side makes the cell visible.
        [only] if logarithmic => vec![only / 2.0, only * 2.0],
        _ => edges(values),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_distribution_rises_by_the_share_of_each_value() {
        let line = Line::distribution([3.0, 1.0, f64::NAN, 1.0, 2.0], Look::of(0));
        let expected = [(1.0, 0.0), (1.0, 0.0), (1.0, 0.25), (1.0, 0.25), (1.0, 0.5), (2.0, 0.5), (2.0, 0.75), (3.0, 0.75), (3.0, 1.0)];
        assert_eq!(line.runs, [expected.to_vec()]);
    }

    #[test]
    fn what_is_not_finite_parts_a_line() {
        let line = Line::new([(0.0, 1.0), (1.0, f64::NAN), (2.0, 3.0), (f64::INFINITY, 1.0)], Look::of(0));
        assert_eq!(line.runs, [vec![(0.0, 1.0)], vec![(2.0, 3.0)]]);
    }

    #[test]
    fn cells_end_in_the_middle_of_their_axis() {
        assert_eq!(cell_edges(&[0.0, 2.0, 6.0], false), [0.0, 1.0, 4.0, 6.0]);
        assert_eq!(cell_edges(&[1.0, 4.0, 16.0], true), [1.0, 2.0, 8.0, 16.0]);
        assert_eq!((cell_edges(&[8.0], true), cell_edges(&[8.0], false)), (vec![4.0, 16.0], vec![7.5, 8.5]));
    }

    #[test]
    fn cells_reach_half_way_to_their_neighbours() {
        let region = Region::cells(&[0.0, 2.0, 4.0], &[0.0, 1.0], Fill::Hatch, |column, row| row == 1 && column > 0);
        assert_eq!(region.outlines, [vec![(1.0, 0.5), (4.0, 0.5), (4.0, 1.0), (1.0, 1.0)]]);
    }
}
