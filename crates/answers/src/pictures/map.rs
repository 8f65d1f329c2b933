//! A map: the outline of the region of each variant, and the region of the first one shaded.

use cohaptic_picture::{Axis as Shown, Fill, Line, Look, Panel, Region};
use cohaptic_stability::{Criterion, KeyRange, Kinds, Map, Polyline, nominal_head};

use super::axis::axis_of;

/// A map with what its legend calls it.
#[derive(Clone, Copy, Debug)]
pub struct NamedMap<'a> {
    /// In the legend.
    pub name: &'a str,
    /// All of it.
    pub map: &'a Map,
    /// By which radius it judges.
    pub criterion: Criterion,
    /// Random parts of the links that its nominal cells leave out, in words.
    pub left_out: &'a [&'a str],
}

/// The picture of maps over the same keys; `None` of no map.
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

/// What a map shows.
struct Picture<'a> {
    title: &'a str,
    /// What the region of the first variant is: stable, by which criterion.
    stable: &'a str,
    x: Axis<'a>,
    y: Axis<'a>,
    outlines: Vec<Outline>,
    /// The stable region of the first variant: anticlockwise around stable cells, clockwise around others.
    regions: Vec<Polyline>,
    /// Which cells of the first variant are nominal, row by row.
    nominal: &'a [Vec<bool>],
    /// The name of these cells in the legend.
    hatched: &'a str,
}

/// One axis: what it says, and the values at which there are cells, rising.
struct Axis<'a> {
    shown: Shown,
    values: &'a [f64],
}

/// Where the region of a variant ends.
struct Outline {
    name: String,
    /// Lines along which the radius is 1.
    lines: Vec<Polyline>,
}

impl Picture<'_> {
    /// The picture, of no size yet.
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
    /// The axis from its first to its last value.
    fn between_values(&self) -> Shown {
        let (first, last) = (self.values.first().copied().unwrap_or_default(), self.values.last().copied().unwrap_or_default());
        self.shown.clone().range(first, last)
    }
}

/// The points of a line; those of a closed one come back to the first.
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
