//! What a panel shows: lines, bands, regions, heat maps, marks.

use crate::extent::{Extent, Scale, count};
use crate::look::{Fill, Look, Marker};
use crate::text::Text;

/// Points joined by a line, marked, or both. A point that is not finite parts the line.
#[derive(Clone, PartialEq, Debug)]
pub struct Line {
    pub(crate) name: Text,
    pub(crate) look: Look,
    pub(crate) runs: Vec<Vec<(f64, f64)>>,
    pub(crate) joined: bool,
    pub(crate) marker: Option<Marker>,
}

impl Line {
    /// A line through these points.
    #[must_use]
    pub fn new(points: impl IntoIterator<Item = (f64, f64)>, look: Look) -> Self {
        Self::runs([points], look)
    }

    /// A line in parts that are not joined.
    #[must_use]
    pub fn runs<P: IntoIterator<Item = (f64, f64)>>(runs: impl IntoIterator<Item = P>, look: Look) -> Self {
        let mut parted: Vec<Vec<(f64, f64)>> = Vec::new();
        for run in runs {
            parted.push(Vec::new());
            for (x, y) in run {
                match parted.last_mut() {
                    Some(last) if x.is_finite() && y.is_finite() => last.push((x, y)),
                    _ => parted.push(Vec::new()),
                }
            }
        }
        parted.retain(|run| !run.is_empty());
        Self { name: Text::default(), look, runs: parted, joined: true, marker: None }
    }

    /// Stairs: each value holds until the next x.
    #[must_use]
    pub fn steps(points: impl IntoIterator<Item = (f64, f64)>, look: Look) -> Self {
        let mut stairs: Vec<(f64, f64)> = Vec::new();
        for (x, y) in points {
            if let Some((_, before)) = stairs.last().copied() {
                stairs.push((x, before));
            }
            stairs.push((x, y));
        }
        Self::new(stairs, look)
    }

    /// The empirical distribution function of these values: the share of them that is no larger. Values that are not finite are left out.
    #[must_use]
    pub fn distribution(values: impl IntoIterator<Item = f64>, look: Look) -> Self {
        let mut values: Vec<f64> = values.into_iter().filter(|value| value.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        let all = count(values.len());
        let first = values.first().map(|value| (*value, 0.0));
        let shares = values.iter().enumerate().map(|(place, value)| (*value, count(place + 1) / all));
        Self::steps(first.into_iter().chain(shares), look)
    }

    /// A level line at this y over the whole panel.
    #[must_use]
    pub fn level(y: f64) -> Self {
        Self::new([(f64::MIN, y), (f64::MAX, y)], Look::reference())
    }

    /// An upright line at this x over the whole panel.
    #[must_use]
    pub fn upright(x: f64) -> Self {
        Self::new([(x, f64::MIN), (x, f64::MAX)], Look::reference())
    }

    /// With a name, for the legend.
    #[must_use]
    pub fn named(self, name: impl Into<Text>) -> Self {
        Self { name: name.into(), ..self }
    }

    /// With another look.
    #[must_use]
    pub fn look(self, look: Look) -> Self {
        Self { look, ..self }
    }

    /// With each point marked. Points that lie on each other are marked once.
    #[must_use]
    pub fn marked(self, marker: Marker) -> Self {
        Self { marker: Some(marker), ..self }
    }

    /// Marks alone, without the line.
    #[must_use]
    pub fn marks_only(self, marker: Marker) -> Self {
        Self { joined: false, ..self.marked(marker) }
    }
}

/// The area between two curves, such as two quantiles, or the lowest and highest value.
#[derive(Clone, PartialEq, Debug)]
pub struct Band {
    pub(crate) name: Text,
    pub(crate) fill: Fill,
    /// (x, low, high)
    pub(crate) runs: Vec<Vec<(f64, f64, f64)>>,
}

impl Band {
    /// Between low and high over x; (x, low, high) that is not finite parts it.
    #[must_use]
    pub fn new(points: impl IntoIterator<Item = (f64, f64, f64)>, fill: Fill) -> Self {
        let mut runs = vec![Vec::new()];
        for (x, low, high) in points {
            match runs.last_mut() {
                Some(run) if x.is_finite() && low.is_finite() && high.is_finite() => run.push((x, low, high)),
                _ => runs.push(Vec::new()),
            }
        }
        runs.retain(|run: &Vec<_>| run.len() > 1);
        Self { name: Text::default(), fill, runs }
    }

    /// With a name, for the legend.
    #[must_use]
    pub fn named(self, name: impl Into<Text>) -> Self {
        Self { name: name.into(), ..self }
    }
}

/// An area within closed outlines. What lies within an even number of them is outside: a hole is one more outline.
#[derive(Clone, PartialEq, Debug)]
pub struct Region {
    pub(crate) name: Text,
    pub(crate) fill: Fill,
    pub(crate) outlines: Vec<Vec<(f64, f64)>>,
}

impl Region {
    /// Within these outlines; an outline ends where it begins without saying so.
    #[must_use]
    pub fn new(outlines: impl IntoIterator<Item = Vec<(f64, f64)>>, fill: Fill) -> Self {
        let finite = |outline: &Vec<(f64, f64)>| outline.len() > 2 && outline.iter().all(|(x, y)| x.is_finite() && y.is_finite());
        Self { name: Text::default(), fill, outlines: outlines.into_iter().filter(finite).collect() }
    }

    /// The cells (column, row) of a grid for which `shown` holds. Values are those at the middles of columns and rows, rising; a cell reaches half way to the
    /// next, and the outermost end at their values.
    #[must_use]
    pub fn cells(xs: &[f64], ys: &[f64], fill: Fill, shown: impl Fn(usize, usize) -> bool) -> Self {
        Self::between(&edges(xs), &edges(ys), fill, shown)
    }

    /// The cells (column, row) of a grid for which `shown` holds, between those edges, rising: one more than there are columns, and rows.
    #[must_use]
    pub fn between(columns: &[f64], rows: &[f64], fill: Fill, shown: impl Fn(usize, usize) -> bool) -> Self {
        let (across, up) = (columns.len().saturating_sub(1), rows.len().saturating_sub(1));
        let mut outlines = Vec::new();
        for row in 0..up {
            let mut column = 0;
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
        Self { name: Text::default(), fill, outlines }
    }

    /// With a name, for the legend.
    #[must_use]
    pub fn named(self, name: impl Into<Text>) -> Self {
        Self { name: name.into(), ..self }
    }
}

/// A value for each cell of a grid as a colour, with a colour bar at the right of the panel. The colours are cividis: their lightness rises evenly, and they are
/// seen alike with and without colour blindness (Nuñez, Anderton & Renslow 2018).
#[derive(Clone, PartialEq, Debug)]
pub struct HeatMap {
    /// Where columns and rows begin and end: one more than there are of them.
    pub(crate) columns: Vec<f64>,
    pub(crate) rows: Vec<f64>,
    /// By row, then column.
    pub(crate) values: Vec<Vec<f64>>,
    pub(crate) axis: crate::Axis,
}

impl HeatMap {
    /// Values by row (y), then column (x), at these places, rising; those that are not finite have no colour. The axis is that of the colours.
    ///
    /// # Panics
    ///
    /// If there are not as many rows and columns of values as places.
    #[must_use]
    pub fn new(xs: &[f64], ys: &[f64], values: Vec<Vec<f64>>, axis: crate::Axis) -> Self {
        assert!(values.len() == ys.len() && values.iter().all(|row| row.len() == xs.len()), "a value for each cell");
        Self { columns: edges(xs), rows: edges(ys), values, axis }
    }

    /// Values by row (y), then column (x), of cells between those edges, rising: one more than there are columns, and rows.
    ///
    /// # Panics
    ///
    /// If there are not as many rows and columns of values as the edges hold.
    #[must_use]
    pub fn between(columns: Vec<f64>, rows: Vec<f64>, values: Vec<Vec<f64>>, axis: crate::Axis) -> Self {
        assert!(values.len() + 1 == rows.len() && values.iter().all(|row| row.len() + 1 == columns.len()), "a value for each cell");
        Self { columns, rows, values, axis }
    }

    /// The lowest and highest value.
    pub(crate) fn extent(&self) -> Extent {
        let logarithmic = self.axis.scale == Scale::Logarithmic;
        let finite = self.values.iter().flatten().copied().filter(|value| value.is_finite() && (!logarithmic || *value > 0.0));
        self.axis.clone().tight().shown(span(finite))
    }
}

/// Short marks at the foot of the panel, such as the instants of losses.
#[derive(Clone, PartialEq, Debug)]
pub struct Rug {
    pub(crate) name: Text,
    pub(crate) look: Look,
    pub(crate) xs: Vec<f64>,
}

impl Rug {
    /// A mark at each x.
    #[must_use]
    pub fn new(xs: impl IntoIterator<Item = f64>, look: Look) -> Self {
        Self { name: Text::default(), look, xs: xs.into_iter().filter(|x| x.is_finite()).collect() }
    }

    /// With a name, for the legend.
    #[must_use]
    pub fn named(self, name: impl Into<Text>) -> Self {
        Self { name: name.into(), ..self }
    }
}

/// Anything that a panel can show.
#[derive(Clone, PartialEq, Debug)]
pub enum Content {
    /// A line or marks.
    Line(Line),
    /// An area between two curves.
    Band(Band),
    /// An area within outlines.
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

/// Lowest and highest x, and y; `None` where there is no value.
pub(crate) type Reach = (Option<(f64, f64)>, Option<(f64, f64)>);

impl Content {
    /// Lowest and highest x, and y, of all content but endless lines and values without a place on axes of these scales.
    pub(crate) fn extents(&self, x: Scale, y: Scale) -> Reach {
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

/// What two contents reach over together.
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

/// Where cells begin and end whose values are those: half way between them; the outermost end at their values if there is more than one.
pub(crate) fn edges(values: &[f64]) -> Vec<f64> {
    let (Some(first), Some(last)) = (values.first(), values.last()) else { return vec![0.0] };
    if values.len() == 1 {
        return vec![first - 0.5, last + 0.5];
    }
    let between = values.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
    std::iter::once(*first).chain(between).chain([*last]).collect()
}

/// The edges of cells whose values, rising, are at their middles, for [`HeatMap::between`] and [`Region::between`]: half way to the next along a linear or a
/// logarithmic axis; the outermost end at their values, so that no axis reaches where no value is.
#[must_use]
pub fn cell_edges(values: &[f64], logarithmic: bool) -> Vec<f64> {
    match values {
        [first, .., last] if logarithmic => {
            let between = values.windows(2).map(|pair| libm::sqrt(pair[0]) * libm::sqrt(pair[1]));
            std::iter::once(*first).chain(between).chain([*last]).collect()
        }
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
