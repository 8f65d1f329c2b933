//! A map as SVG: the outline of the region of each variant, and the region of the first one shaded.

use cohaptic_harness::record::svg;
use cohaptic_stability::Polyline;
use plotters::prelude::*;

use crate::lines::{Look, Sample, draw_legend, draw_line, legend_height};

/// What a map shows.
pub(super) struct Picture<'a> {
    pub(super) title: &'a str,
    pub(super) x: Axis<'a>,
    pub(super) y: Axis<'a>,
    pub(super) outlines: Vec<Outline>,
    /// The stable region of the first variant: anticlockwise around what is stable, clockwise around what is not.
    pub(super) regions: Vec<Polyline>,
}

/// One axis: its key and unit, and the values at which there are cells, rising.
pub(super) struct Axis<'a> {
    pub(super) label: String,
    pub(super) values: &'a [f64],
}

/// Where the region of a variant ends.
pub(super) struct Outline {
    pub(super) name: String,
    /// Lines along which the spectral radius is 1.
    pub(super) lines: Vec<Polyline>,
}

const SIZE: (u32, u32) = (960, 600);
const SHADE: RGBColor = RGBColor(226, 232, 238);

impl Picture<'_> {
    /// The document.
    pub(super) fn svg(&self) -> String {
        let first = self.outlines.first().map_or("", |outline| &outline.name);
        let shaded = (Sample::Area(SHADE), format!("stable: {first}"));
        let lines = self.outlines.iter().enumerate().map(|(number, outline)| (Sample::Line(Look::of(number)), outline.name.clone()));
        let entries: Vec<(Sample, String)> = lines.chain([shaded]).collect();
        let size = (SIZE.0, SIZE.1 + legend_height(entries.len()));
        svg::document(size, |root| {
            let (area, legend) = root.split_vertically(SIZE.1);
            let mut chart = ChartBuilder::on(&area)
                .caption(self.title, ("sans-serif", 16))
                .margin(12)
                .x_label_area_size(40)
                .y_label_area_size(68)
                .build_cartesian_2d(range(self.x.values), range(self.y.values))?;
            for (region, area) in by_size(&self.regions) {
                let colour = if area > 0.0 { SHADE } else { WHITE };
                chart.draw_series([Polygon::new(region.points.clone(), colour.filled())])?;
            }
            chart.configure_mesh().x_desc(&self.x.label).y_desc(&self.y.label).light_line_style(TRANSPARENT).draw()?;
            for (number, outline) in self.outlines.iter().enumerate() {
                for line in &outline.lines {
                    draw_line(&mut chart, &closed(line), Look::of(number))?;
                }
            }
            draw_legend(&legend, &entries)
        })
    }
}

/// Paints the regions and the holes in them: the larger first, because what lies within another region or hole is smaller.
fn by_size(regions: &[Polyline]) -> Vec<(&Polyline, f64)> {
    let mut sized: Vec<(&Polyline, f64)> = regions.iter().map(|region| (region, area(&region.points))).collect();
    sized.sort_by(|one, other| other.1.abs().total_cmp(&one.1.abs()));
    sized
}

/// The area of a polygon, above zero if its points go round anticlockwise.
fn area(points: &[(f64, f64)]) -> f64 {
    let next = points.iter().cycle().skip(1);
    points.iter().zip(next).map(|((x, y), (next_x, next_y))| 0.5 * (x * next_y - next_x * y)).sum()
}

/// The points of a line; those of a closed one come back to the first.
fn closed(line: &Polyline) -> Vec<(f64, f64)> {
    let again = line.points.first().filter(|_| line.closed);
    line.points.iter().chain(again).copied().collect()
}

fn range(values: &[f64]) -> std::ops::Range<f64> {
    let (first, last) = (values.first().copied().unwrap_or_default(), values.last().copied().unwrap_or_default());
    first..last
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hole_is_painted_after_the_region_around_it_and_before_the_island_in_it() {
        let square = |half: f64, clockwise: bool| {
            let mut points = vec![(-half, -half), (half, -half), (half, half), (-half, half)];
            if clockwise {
                points.reverse();
            }
            Polyline { points, closed: true }
        };
        let regions = [square(1.0, false), square(3.0, false), square(2.0, true)];
        let areas: Vec<f64> = by_size(&regions).iter().map(|(_, area)| *area).collect();
        assert_eq!(areas, [36.0, -16.0, 4.0]);
    }

    #[test]
    fn what_a_title_says_does_not_break_the_document() {
        let values = [0.0, 1.0];
        let axis = || Axis { label: "<a> & \"b\"".to_owned(), values: &values };
        let outlines = (0..12)
            .map(|n| Outline { name: format!("</svg>{n}\u{1}"), lines: vec![Polyline { points: vec![(0.0, 0.0), (1.0, 1.0)], closed: false }] })
            .collect();
        let svg = Picture { title: "<script>", x: axis(), y: axis(), outlines, regions: Vec::new() }.svg();
        assert_eq!(svg.matches("</svg>").count(), 1);
        assert!(!svg.contains("<script>") && svg.contains("&lt;script&gt;") && !svg.contains('\u{1}'));
    }
}
