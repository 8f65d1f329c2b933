//! The picture of maps: the outline of each variant's stable region, and the region of the first variant shaded.

use cohaptic_picture::{Axis as Shown, Fill, Line, Look, Panel, Region};
use cohaptic_stability::{Criterion, KeyRange, Kinds, Map, Polyline, nominal_head};

use super::axis::axis_of;

/// A map with its name in the legend.
#[derive(Clone, Copy, Debug)]
pub struct NamedMap<'a> {
    /// Name in the legend.
    pub name: &'a str,
    /// The map.
    pub map: &'a Map,
    /// Radius by which the map is judged.
    pub criterion: Criterion,
    /// Random parts of the links left out by nominal cells, in words.
    pub left_out: &'a [&'a str],
}

/// Draws maps over the same two keys; `None` for an empty list.
#[must_use]
pub fn map_picture(title: &str, [x, y]: [&KeyRange; 2], maps: &[NamedMap<'_>]) -> Option<cohaptic_picture::Picture> {
    let first = maps.first()?;
    let kinds = Kinds::of(first.criterion, first.map.nominal.iter().flatten().copied());
    let title = format!("{title}: {} 1", kinds.radius_name());
    let hatched = nominal_head(first.left_out);
    let picture = Picture {
        title: &title,
        stable: &kinds.says("stable"),
        x: Axis { shown: axis_of(x), values: &first.map.x },
        y: Axis { shown: axis_of(y), values: &first.map.y },
        outlines: maps.iter().map(|NamedMap { name, map, .. }| Outline { name: (*name).to_owned(), lines: map.contour() }).collect(),
        regions: first.map.regions(),
        nominal: &first.map.nominal,
        hatched: &hatched,
    };
    Some(picture.drawn())
}

/// Content of the picture.
struct Picture<'a> {
    title: &'a str,
    /// Meaning of the shaded region: stable, with the criterion.
    stable: &'a str,
    x: Axis<'a>,
    y: Axis<'a>,
    outlines: Vec<Outline>,
    /// Outlines of the stable region of the first variant: anticlockwise around stable cells, clockwise around unstable cells.
    regions: Vec<Polyline>,
    /// Nominal cells of the first variant, indexed by row and column.
    nominal: &'a [Vec<bool>],
    /// Name of the nominal cells in the legend.
    hatched: &'a str,
}

/// An axis with the values of the cells, in rising order.
struct Axis<'a> {
    shown: Shown,
    values: &'a [f64],
}

/// Outline of the stable region of a variant.
struct Outline {
    name: String,
    /// Lines along which the radius is 1.
    lines: Vec<Polyline>,
}

impl Picture<'_> {
    /// Draws the picture, without a size.
    fn drawn(&self) -> cohaptic_picture::Picture {
        let first = self.outlines.first().map_or("", |outline| &outline.name);
        let regions = self.regions.iter().map(|region| region.points.clone());
        let lines = self
            .outlines
            .iter()
            .enumerate()
            .map(|(number, outline)| Line::runs(outline.lines.iter().map(closed), Look::of(number)).named(outline.name.as_str()));
        let panel = Panel::new(self.x.between_values(), self.y.between_values())
            .with(Region::new(regions, Fill::Tint(0)).named(format!("{}: {first}", self.stable)))
            .with_all(lines);
        let is_nominal = |column: usize, row: usize| self.nominal.get(row).and_then(|row| row.get(column)).copied().unwrap_or(false);
        let panel = if self.nominal.iter().flatten().any(|nominal| *nominal) {
            panel.with(Region::cells(self.x.values, self.y.values, Fill::Hatch, is_nominal).named(self.hatched))
        } else {
            panel
        };
        cohaptic_picture::Picture::new(self.title).panel(panel)
    }
}

impl Axis<'_> {
    /// Returns the axis from the first to the last value.
    fn between_values(&self) -> Shown {
        let (first, last) = (self.values.first().copied().unwrap_or_default(), self.values.last().copied().unwrap_or_default());
        self.shown.clone().range(first, last)
    }
}

/// Returns the points of a line; a closed line ends with its first point again.
fn closed(line: &Polyline) -> Vec<(f64, f64)> {
    let again = line.points.first().filter(|_| line.closed);
    line.points.iter().chain(again).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hole_and_an_island_in_it_are_outlines_of_one_area_that_is_filled_where_their_number_is_odd() {
        let square = |half: f64| Polyline { points: vec![(-half, -half), (half, -half), (half, half), (-half, half)], closed: true };
        let values = [-4.0, 4.0];
        let axis = || Axis { shown: Shown::new("x"), values: &values };
        let svg = Picture {
            title: "",
            stable: "stable",
            x: axis(),
            y: axis(),
            outlines: Vec::new(),
            regions: [1.0, 3.0, 2.0].map(square).into(),
            nominal: &[],
            hatched: "",
        }
        .drawn()
        .svg();
        let area = svg.lines().find(|line| line.starts_with("<path class=\"tint")).unwrap();
        assert!(area.contains("fill-rule=\"evenodd\"") && area.matches('M').count() == 3, "{area}");
    }

    #[test]
    fn what_a_title_says_does_not_break_the_document() {
        let values = [0.0, 1.0];
        let axis = || Axis { shown: Shown::new("<a> & \"b\""), values: &values };
        let outlines = (0..12)
            .map(|n| Outline { name: format!("</svg>{n}\u{1}"), lines: vec![Polyline { points: vec![(0.0, 0.0), (1.0, 1.0)], closed: false }] })
            .collect();
        let svg = Picture {
            title: "<script>",
            stable: "stable",
            x: axis(),
            y: axis(),
            outlines,
            regions: Vec::new(),
            nominal: &[vec![true, false], vec![true, true]],
            hatched: "nominal (jitter left out)",
        }
        .drawn()
        .svg();
        assert!(svg.contains("nominal (jitter left out)"));
        assert_eq!(svg.matches("</svg>").count(), 1);
        assert!(!svg.contains("<script>") && svg.contains("&lt;script&gt;") && !svg.contains('\u{1}'));
        assert_eq!(cohaptic_picture::testing::faults(&svg), [""; 0]);
    }
}
