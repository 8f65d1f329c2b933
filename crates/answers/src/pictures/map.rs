//! The picture of maps: the stable region of each variant, filled and named by its law.

use cohaptic_picture::{Axis as Shown, Content, Fill, Line, Look, Panel, Region};
use cohaptic_stability::{Criterion, KeyRange, Kinds, Map, Polyline, nominal_head};

use super::axis::axis_of;

/// A map with a name for the legend.
#[derive(Clone, Copy, Debug)]
pub struct NamedMap<'a> {
    /// Name in the legend, without the verdict: see [`legend_name`](crate::legend_name).
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
    // All maps have the keys of the first map, so that the first map gives the axes.
    let first = maps.first()?;
    // Nominal cells change the meaning of the radius, and so the words of title and legend.
    let kinds = |named: &NamedMap<'_>| Kinds::of(named.criterion, named.map.nominal.iter().flatten().copied());
    let title = format!("{title}: {} below 1", kinds(first).radius_name());
    let hatched = nominal_head(first.left_out);
    let area = |named: &NamedMap<'_>| Area {
        name: format!("{}: {}", kinds(named).says("stable"), named.name),
        regions: named.map.regions(),
        edges: named.map.contour(),
    };
    let picture = Picture {
        title: &title,
        x: Axis { shown: axis_of(x), values: &first.map.x },
        y: Axis { shown: axis_of(y), values: &first.map.y },
        areas: maps.iter().map(area).collect(),
        nominal: &first.map.nominal,
        hatched: &hatched,
    };
    Some(picture.drawn())
}

/// Largest number of maps with filled regions. Colours of more areas on each other cannot be told apart, so that further maps have only edges.
const MOST_FILLED: usize = 6;

/// Content of the picture.
struct Picture<'a> {
    title: &'a str,
    x: Axis<'a>,
    y: Axis<'a>,
    /// Stable regions, a region per map.
    areas: Vec<Area>,
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

/// Stable region of a map.
struct Area {
    /// Name in the legend: the verdict with the map's law and overrides.
    name: String,
    /// Outlines along the edge of the region and along the ends of the axes.
    regions: Vec<Polyline>,
    /// Lines along which the radius is 1.
    edges: Vec<Polyline>,
}

impl Picture<'_> {
    /// Draws the picture, without a size.
    fn drawn(&self) -> cohaptic_picture::Picture {
        let content = |(number, area): (usize, &Area)| -> Content {
            let (edges, look) = (area.edges.iter().map(Polyline::path), Look::of(number));
            if number < MOST_FILLED {
                let outlines = area.regions.iter().map(|region| region.points.clone());
                Region::new(outlines, Fill::Tint(number)).bordered(edges, look).named(area.name.as_str()).into()
            } else {
                Line::runs(edges, look).named(area.name.as_str()).into()
            }
        };
        let panel = Panel::new(self.x.between_values(), self.y.between_values()).with_all(self.areas.iter().enumerate().map(content));
        let is_nominal = |column: usize, row: usize| self.nominal.get(row).and_then(|row| row.get(column)).copied().unwrap_or(false);
        // A hatch over nothing would still have an entry in the legend.
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
        // Values at the edges are the centres of the outermost cells; no value was judged beyond.
        self.shown.clone().range(first, last)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const VALUES: [f64; 2] = [-4.0, 4.0];

    fn svg(areas: Vec<Area>, nominal: &[Vec<bool>]) -> String {
        let axis = || Axis { shown: Shown::new("<a> & \"b\""), values: &VALUES };
        let svg = Picture { title: "<script>", x: axis(), y: axis(), areas, nominal, hatched: "nominal (jitter left out)" }.drawn().svg();
        assert_eq!(cohaptic_picture::testing::faults(&svg), [""; 0]);
        svg
    }

    fn square(half: f64) -> Polyline {
        Polyline { points: vec![(-half, -half), (half, -half), (half, half), (-half, half)], closed: true }
    }

    fn paths<'a>(svg: &'a str, class: &str) -> Vec<&'a str> {
        svg.lines().filter(|line| line.starts_with(&format!("<path class=\"{class}"))).collect()
    }

    #[test]
    fn a_hole_and_an_island_in_it_are_outlines_of_one_area_that_is_filled_where_their_number_is_odd() {
        let area = Area { name: "stable".to_owned(), regions: [1.0, 3.0, 2.0].map(square).into(), edges: Vec::new() };
        let svg = svg(vec![area], &[]);
        let areas = paths(&svg, "tint f0");
        assert!(areas.len() == 1 && areas[0].contains("fill-rule=\"evenodd\"") && areas[0].matches('M').count() == 3, "{areas:?}");
    }

    /// Of seven maps six are filled, each in its own colour. All seven have edges, in the picture and in the legend.
    #[test]
    fn the_region_of_every_law_is_filled_and_named() {
        let names: Vec<String> = (0..7).map(|number| format!("stable: law {number}")).collect();
        let area = |(number, name): (u32, &String)| {
            let edge = square(3.0 - 0.3 * f64::from(number));
            Area { name: name.clone(), regions: vec![edge.clone()], edges: vec![edge] }
        };
        let svg = svg((0..).zip(&names).map(area).collect(), &[]);
        for number in 0..7 {
            let filled = usize::from(number < MOST_FILLED);
            assert_eq!(
                (paths(&svg, &format!("tint f{number}")).len(), paths(&svg, &format!("line s{number}")).len()),
                (filled, 2),
                "{number}: {svg}"
            );
            assert_eq!(svg.matches(&format!("<rect class=\"tint f{number}\"")).count(), filled, "{svg}");
        }
        assert!(names.iter().all(|name| svg.contains(&format!(">{name}</text>"))), "{svg}");
    }

    #[test]
    fn what_a_title_says_does_not_break_the_document() {
        let line = || Polyline { points: vec![(0.0, 0.0), (1.0, 1.0)], closed: false };
        let area = |n: usize| Area { name: format!("</svg>{n}\u{1}"), regions: Vec::new(), edges: vec![line()] };
        let svg = svg((0..12).map(area).collect(), &[vec![true, false], vec![true, true]]);
        assert!(svg.contains("nominal (jitter left out)"));
        assert_eq!(svg.matches("</svg>").count(), 1);
        assert!(!svg.contains("<script>") && svg.contains("&lt;script&gt;") && !svg.contains('\u{1}'));
    }
}
