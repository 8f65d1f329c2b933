//! Lines that are told apart by colour and, in black and white, by their dashes; and a legend below the picture, where it hides nothing.

use cohaptic_harness::record::svg::{COLOURS, Drawing, DrawingResult};
use plotters::coord::CoordTranslate;
use plotters::element::DashedPathElement;
use plotters::prelude::*;

/// Lengths of dashes and gaps \[pixels\]; the first line has none. They repeat after these, with thicker lines.
const DASHES: [Option<(u32, u32)>; 5] = [None, Some((10, 5)), Some((3, 4)), Some((20, 6)), Some((6, 12))];

/// How one line looks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Look {
    style: ShapeStyle,
    dash: Option<(u32, u32)>,
}

impl Look {
    /// The look of the line of that number.
    pub(crate) fn of(number: usize) -> Self {
        let width = 2 + u32::try_from(number / DASHES.len()).unwrap_or(0).min(6);
        Self { style: COLOURS[number % COLOURS.len()].stroke_width(width), dash: DASHES[number % DASHES.len()] }
    }
}

impl Look {
    /// The first look, without dashes.
    pub(crate) const fn solid() -> Self {
        Self { style: ShapeStyle { color: RGBAColor(COLOURS[0].0, COLOURS[0].1, COLOURS[0].2, 1.0), filled: false, stroke_width: 2 }, dash: None }
    }

    /// A thin line that other lines are compared with.
    pub(crate) const fn grey() -> Self {
        Self { style: ShapeStyle { color: RGBAColor(120, 120, 120, 1.0), filled: false, stroke_width: 1 }, dash: None }
    }

    /// The colour without dashes, for what is no line.
    pub(crate) const fn colour(self) -> RGBAColor {
        self.style.color
    }
}

/// Draws a line.
pub(crate) fn draw_line<'a, 'b, C>(chart: &mut ChartContext<'b, SVGBackend<'a>, C>, points: &[(f64, f64)], look: Look) -> DrawingResult<'a>
where
    C: CoordTranslate<From = (f64, f64)>,
    'a: 'b,
{
    let points = points.to_vec();
    match look.dash {
        None => chart.draw_series(LineSeries::new(points, look.style))?,
        Some((dash, gap)) => chart.draw_series(DashedLineSeries::new(points, dash, gap, look.style))?,
    };
    Ok(())
}

/// What stands beside an entry of the legend.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Sample {
    Line(Look),
}

/// The height of an entry of the legend \[pixels\].
const ENTRY: i32 = 20;

/// How high a legend is \[pixels\].
pub(crate) fn legend_height(entries: usize) -> u32 {
    u32::try_from(entries).unwrap_or(0).saturating_mul(ENTRY.unsigned_abs()) + 12
}

/// Draws the legend, one entry below the other.
pub(crate) fn draw_legend<'a>(area: &Drawing<'a>, entries: &[(Sample, String)]) -> DrawingResult<'a> {
    const LEFT: i32 = 80;
    const RIGHT: i32 = LEFT + 60;
    let mut y = ENTRY / 2;
    for (sample, name) in entries {
        match *sample {
            Sample::Line(Look { style, dash: None }) => area.draw(&PathElement::new([(LEFT, y), (RIGHT, y)], style))?,
            Sample::Line(Look { style, dash: Some((dash, gap)) }) => {
                area.draw(&DashedPathElement::new([(LEFT, y), (RIGHT, y)], dash, gap, style))?;
            }
        }
        area.draw(&Text::new(name.clone(), (RIGHT + 12, y - 7), ("sans-serif", 14)))?;
        y += ENTRY;
    }
    Ok(())
}
