//! The picture of measured methods: cost on the horizontal axis, error on the vertical axis, both logarithmic.
//!
//! An error of exactly zero has no logarithm. Such a point is drawn below all other errors, as a triangle with the tip down.

use std::ops::RangeFrom;

use cohaptic_picture::{Axis, Line, Look, Marker, Panel, Picture};

use super::{Kind, Measured, MeasuredMethod};

/// Draws a panel per kind with a cost and an error. All further kinds are only in the table.
#[must_use]
pub fn cost_picture(title: &str, measured: &Measured) -> Picture {
    let mut looks = 0..;
    let panels = Kind::ALL.into_iter().filter_map(|kind| panel(kind, &measured.methods, &mut looks));
    Picture::new(title)
        .note("What each method costs on this machine, and its largest difference from the reference. Further left is cheaper, further down more exact; a triangle at the foot is a difference of exactly 0.")
        .aspect(0.35)
        .panels(panels)
}

/// Returns an error in words: three digits with an exponent, `0` for exactly zero, and a dash for `None`.
#[must_use]
pub fn error_in_words(error: Option<f64>) -> String {
    match error {
        None => "–".to_owned(),
        Some(0.0) => "0".to_owned(),
        Some(error) => format!("{error:.2e}"),
    }
}

/// Draws a kind; `None` if the kind has no points. `looks`: numbers of unused looks, shared by all panels, because names without room beside the points go to a
/// common legend.
fn panel(kind: Kind, methods: &[MeasuredMethod], looks: &mut RangeFrom<usize>) -> Option<Panel> {
    let drawn: Vec<(&MeasuredMethod, f64, f64)> = methods
        .iter()
        .filter(|method| method.kind == kind)
        .filter_map(|method| Some((method, method.cost_ms.filter(|cost| *cost > 0.0)?, method.error?)))
        .collect();
    if drawn.is_empty() {
        return None;
    }
    let least = drawn.iter().map(|(_, _, error)| *error).filter(|error| *error > 0.0).fold(f64::INFINITY, f64::min);
    // One decade below the decade of the least error, so that zero is not mistaken for the least error.
    let floor = if least.is_finite() { 10_f64.powf(least.log10().floor() - 1.0) } else { 1e-16 };
    let decades = |name: &str, unit: String| Axis::new(name).unit(unit).logarithmic().tight().ends_at_ticks();
    let along = decades("Cost", kind.cost_unit().to_owned());
    let mut up = decades(&format!("Error of the {}", kind.error_of()), kind.error_unit().to_owned());
    if drawn.iter().any(|(_, _, error)| *error == 0.0) {
        up = up.include(floor);
    }
    let point = |((method, cost, error), number): ((&MeasuredMethod, f64, f64), usize)| {
        // Only zero has the triangle with the tip down.
        let (height, marker) = if error == 0.0 { (floor, Marker::TriangleDown) } else { (error, Marker::of(number % 6)) };
        let name = if method.chosen { format!("{} (chosen)", method.name) } else { method.name.clone() };
        Line::new([(cost, height)], Look::of(number)).marked(marker).named(name)
    };
    Some(Panel::new(along, up).titled(kind.heading()).labels_at_ends().with_all(drawn.into_iter().zip(looks).map(point)))
}
