//! A small bar without text for a table cell: an allowed range with a measured value.

use crate::legend::draw_marker;
use crate::look::{Look, Marker};
use crate::xml::{Xml, coordinate};

/// A measured value with its limits, on an axis common to all gauges: the lower limit is at 0 and the upper limit at 1.
///
/// With a single limit, the unit of the axis is the size of the limit, so the other end of the allowed range is at zero or at twice the limit. A value
/// beyond the axis is drawn at the end of the axis, as a triangle pointing outwards. A value that passed is a disc, and a value that failed is a cross.
///
/// A gauge has no style sheet of its own, and is shown on a [`page::Page`](crate::page::Page).
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Gauge {
    /// Least allowed value; `None` for no lower limit.
    pub low: Option<f64>,
    /// Greatest allowed value; `None` for no upper limit.
    pub high: Option<f64>,
    /// Measured value; `None` for no measurement.
    pub measured: Option<f64>,
    /// `true` if the measured value is within the limits.
    pub passed: bool,
}

const WIDTH: f64 = 160.0;
const HEIGHT: f64 = 16.0;
/// Length of the axis before 0 and after 1.
const BEYOND: f64 = 0.5;

impl Gauge {
    /// Returns the position of a value on the common axis; `None` for NaN.
    #[must_use]
    pub(crate) fn place(&self, value: f64) -> Option<f64> {
        // A limit of zero has no size to divide by. The distance is then its own unit: every value but zero lies one unit away from the limit.
        let size = |limit: f64| if limit == 0.0 { (value - limit).abs() } else { limit.abs() };
        let share = |distance: f64, unit: f64| if distance == 0.0 { 0.0 } else { distance / unit };
        let place = match (self.low, self.high) {
            (Some(low), Some(high)) if high > low => (value - low) / (high - low),
            // Equal limits are drawn in the middle of the axis.
            (Some(low), Some(_)) => 0.5 + share(value - low, size(low)),
            (Some(low), None) => share(value - low, size(low)),
            (None, Some(high)) => 1.0 + share(value - high, size(high)),
            (None, None) => 0.5,
        };
        (!place.is_nan() && !value.is_nan()).then_some(place)
    }

    /// Returns the bar as a part of an HTML page with the style sheet.
    pub(crate) fn svg(&self) -> String {
        let mut xml = Xml::default();
        let x = |place: f64| (0.05 + 0.9 * (place + BEYOND) / (1.0 + 2.0 * BEYOND)) * WIDTH;
        let middle = 0.5 * HEIGHT;
        let said = match (self.measured.is_some(), self.passed) {
            (false, _) => "nothing was measured",
            (true, true) => "the measured value lies within the limits",
            (true, false) => "the measured value lies beyond the limits",
        };
        xml.text.push_str(&format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"cohaptic-picture gauge\" role=\"img\" width=\"{WIDTH}\" height=\"{HEIGHT}\" viewBox=\"0 0 {WIDTH} {HEIGHT}\"><title>{said}</title>\n"
        ));
        // Equal limits leave no range to fill, and are drawn as a single line.
        let single = matches!((self.low, self.high), (Some(low), Some(high)) if high <= low);
        let (from, to) = match (self.low, self.high) {
            (None, None) => (-BEYOND, 1.0 + BEYOND),
            _ if single => (0.5, 0.5),
            (low, high) => (if low.is_some() { 0.0 } else { -BEYOND }, if high.is_some() { 1.0 } else { 1.0 + BEYOND }),
        };
        let (left, right) = (coordinate(x(from)), coordinate(x(to) - x(from)));
        if !single {
            xml.element("rect", &[("class", "tint fr"), ("x", &left), ("y", "3"), ("width", &right), ("height", &coordinate(HEIGHT - 6.0))]);
        }
        let mut path = format!("M{},{middle}H{}", coordinate(x(-BEYOND)), coordinate(x(1.0 + BEYOND)));
        let limits = [(from, self.low.is_some()), (to, self.high.is_some() && !single)];
        for (place, _) in limits.iter().filter(|(_, given)| *given) {
            path.push_str(&format!("M{},1V{}", coordinate(x(*place)), coordinate(HEIGHT - 1.0)));
        }
        xml.element("path", &[("class", "frame"), ("stroke-width", "1.2"), ("d", &path)]);
        if let Some(place) = self.measured.and_then(|value| self.place(value)) {
            // Green and vermilion of the lines 2 and 1. The markers tell the outcome without colours.
            let look = Look::of(if self.passed { 2 } else { 1 });
            let shown = place.clamp(-BEYOND, 1.0 + BEYOND);
            if (place - shown).abs() > 0.0 {
                // The triangle has its base on the end of the axis and its tip outside.
                let (end, out) = (x(shown), if place > shown { 6.0 } else { -6.0 });
                let data = format!(
                    "M{0},{1}L{0},{2}L{3},{4}Z",
                    coordinate(end),
                    coordinate(middle - 5.0),
                    coordinate(middle + 5.0),
                    coordinate(end + out),
                    coordinate(middle)
                );
                xml.element("path", &[("class", &look.fill_class()), ("d", &data)]);
            } else {
                draw_marker(&mut xml, if self.passed { Marker::Disc } else { Marker::Cross }, look, x(shown), middle);
            }
        }
        xml.text.push_str("</svg>");
        xml.text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gauge(low: Option<f64>, high: Option<f64>) -> Gauge {
        Gauge { low, high, measured: None, passed: true }
    }

    #[test]
    fn limits_lie_at_0_and_1_of_one_axis() {
        let between = gauge(Some(2.0), Some(6.0));
        assert_eq!([2.0, 6.0, 5.0, 0.0].map(|value| between.place(value)), [0.0, 1.0, 0.75, -0.5].map(Some));
        let below = gauge(None, Some(4.0));
        assert_eq!([0.0, 4.0, 6.0].map(|value| below.place(value)), [0.0, 1.0, 1.5].map(Some));
        let above = gauge(Some(-4.0), None);
        assert_eq!([-4.0, 0.0, -8.0].map(|value| above.place(value)), [0.0, 1.0, -1.0].map(Some));
        let exactly = gauge(Some(0.0), Some(0.0));
        assert_eq!([0.0, 3.0, -1e-9].map(|value| exactly.place(value)), [0.5, 1.5, -0.5].map(Some));
        assert_eq!(between.place(f64::NAN), None);
        assert_eq!(gauge(None, Some(0.0)).place(f64::INFINITY), None);
    }

    #[test]
    fn what_passed_and_what_failed_differ_in_shape() {
        let svg = |measured: f64, passed: bool| Gauge { measured: Some(measured), passed, ..gauge(Some(0.0), Some(1.0)) }.svg();
        assert!(svg(0.5, true).contains("<circle class=\"f2\" cx=\"80\""), "{}", svg(0.5, true));
        assert!(svg(1.25, false).contains("class=\"line s1\"") && !svg(1.25, false).contains("<circle"));
        // A value far beyond the axis is a triangle at the end, at 95 % of the width.
        assert!(svg(99.0, false).contains("M152,3L152,13L158,8Z") && svg(-99.0, false).contains("M8,3L8,13L2,8Z"), "{}", svg(99.0, false));
        for value in [0.5, 99.0, f64::NAN, f64::INFINITY] {
            assert_eq!(crate::testing::faults(&svg(value, false)), [""; 0]);
        }
    }
}
