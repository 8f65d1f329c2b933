//! Work–precision plots: cost on the horizontal axis, error on the vertical axis, both logarithmic, with one line per method.
//!
//! An error of zero has no logarithm. Such a point is drawn at the foot of the plot, below all other errors, as a triangle that points down, and the legend
//! names it. Rows without an error or a cost are not drawn; the caption counts them.

use cohaptic_picture::{Axis, Line, Look, Marker, Panel, Picture, Size};

use crate::Row;
use crate::groups::{Group, groups};

/// A plot of a group of rows.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Plot {
    /// Short name of the plot and of its file, unique among the plots.
    pub id: String,
    /// Title of the plot.
    pub title: String,
    /// Sentences on rows that are not drawn, or drawn at the foot; may be empty.
    pub caption: String,
    /// Drawing as an SVG document with its own background, light or dark by the preference of the reader.
    pub svg: String,
}

/// Returns a plot of this size for each group of rows with at least one drawable row.
#[must_use]
pub fn plots(rows: &[Row], size: Size) -> Vec<Plot> {
    let mut plots: Vec<Plot> = Vec::new();
    for group in groups(rows) {
        let drawn = Drawn::of(&group);
        if drawn.methods.is_empty() {
            continue;
        }
        // The unit of the cost joins the name only if two groups differ in nothing else.
        let wanted = slug(&format!("{}-{}-{}", group.subject.name(), group.case, group.error_unit));
        let taken = |id: &str| plots.iter().any(|plot| plot.id == id);
        let id = if taken(&wanted) { slug(&format!("{wanted}-{}", group.cost_unit)) } else { wanted };
        // Cases with equal slugs get a number: no file may overwrite another file.
        let mut unique = id.clone();
        let mut number = 2;
        while taken(&unique) {
            unique = format!("{id}-{number}");
            number += 1;
        }
        plots.push(Plot { id: unique, title: group.title(), caption: drawn.caption(), svg: draw(&group, &drawn).size(size).svg() });
    }
    plots
}

/// Returns the text in lower-case letters, digits and hyphens.
fn slug(text: &str) -> String {
    let mut slug = String::new();
    for letter in text.chars() {
        if letter.is_ascii_alphanumeric() {
            slug.push(letter.to_ascii_lowercase());
        } else if !slug.ends_with('-') && !slug.is_empty() {
            slug.push('-');
        }
    }
    slug.trim_end_matches('-').to_owned()
}

/// Drawable part of a group.
struct Drawn<'a> {
    /// Methods with at least one drawable row.
    methods: Vec<Method<'a>>,
    /// Number of rows with an error of exactly 0.
    zeros: usize,
    /// Number of rows that cannot be drawn.
    left_out: usize,
}

struct Method<'a> {
    name: &'a str,
    /// Cost and error of each row with an error above 0.
    points: Vec<(f64, f64)>,
    /// Costs of rows with an error of exactly 0.
    exact: Vec<f64>,
}

impl<'a> Drawn<'a> {
    fn of(group: &Group<'a>) -> Self {
        // A logarithmic axis needs a cost above zero; an error of zero is kept for the foot.
        let usable = |row: &Row| match (row.cost, row.error) {
            (Some(cost), Some(error)) if cost.is_finite() && cost > 0.0 && error.is_finite() && error >= 0.0 => Some((cost, error)),
            _ => None,
        };
        let mut drawn = Self { methods: Vec::new(), zeros: 0, left_out: 0 };
        for name in group.methods() {
            let rows: Vec<_> = group.rows.iter().filter(|row| row.method == name).map(|row| usable(row)).collect();
            // Zero and positive errors of a method are separate lines in the same colour.
            let known = || rows.iter().flatten().copied();
            let points: Vec<_> = known().filter(|(_, error)| *error > 0.0).collect();
            let exact: Vec<f64> = known().filter(|(_, error)| *error == 0.0).map(|(cost, _)| cost).collect();
            drawn.zeros += exact.len();
            drawn.left_out += rows.len() - points.len() - exact.len();
            // A method without drawable rows would be an empty entry of the legend.
            if !points.is_empty() || !exact.is_empty() {
                drawn.methods.push(Method { name, points, exact });
            }
        }
        drawn
    }

    /// Returns the height at which an error of zero is drawn: a decade below the decade of the least error, so that the triangle is not taken for an error of
    /// this size.
    fn floor(&self) -> f64 {
        let least = self.methods.iter().flat_map(|method| &method.points).map(|(_, error)| *error).fold(f64::INFINITY, f64::min);
        if least.is_finite() { libm::exp10(libm::log10(least).floor() - 1.0) } else { 1e-16 }
    }

    /// Returns the caption, with a sentence for each kind of row that is not drawn as a point.
    fn caption(&self) -> String {
        let mut sentences = Vec::new();
        let rows = |count: usize| if count == 1 { "One row has".to_owned() } else { format!("{count} rows have") };
        if self.zeros > 0 {
            sentences.push(format!("{} an error of exactly 0: a triangle at the foot, where there is no scale.", rows(self.zeros)));
        }
        if self.left_out > 0 {
            sentences.push(format!("{} no error or no cost and cannot be drawn: see the table.", rows(self.left_out)));
        }
        sentences.join(" ")
    }
}

/// Draws a group.
fn draw(group: &Group<'_>, drawn: &Drawn<'_>) -> Picture {
    let decades = |name: &str| Axis::new(name).logarithmic().tight().ends_at_ticks();
    let (along, mut up) = (decades("Cost").unit(group.cost_unit), decades(&format!("Error: {}", group.error_unit)));
    let floor = drawn.floor();
    // The axis must reach down to the foot, or the triangles would lie outside.
    if drawn.zeros > 0 {
        up = up.include(floor);
    }
    let mut panel = Panel::new(along, up);
    for (place, Method { name, points, exact }) in drawn.methods.iter().enumerate() {
        let look = Look::of(place);
        panel = panel.with(Line::new(points.iter().copied(), look).marked(Marker::of(place)).named(*name));
        if !exact.is_empty() {
            // The line joins errors above zero only, so the triangles are a line of their own, without a stroke.
            panel = panel.with(Line::new(exact.iter().map(|cost| (*cost, floor)), look).marks_only(Marker::TriangleDown));
        }
    }
    if drawn.zeros > 0 {
        panel = panel.with(Line::new([], Look::reference()).marks_only(Marker::TriangleDown).named("error exactly 0, drawn at the foot"));
    }
    Picture::new(group.title()).panel(panel)
}
