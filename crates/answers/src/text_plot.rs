//! Curves over time as text, in braille patterns of Unicode: each character has two columns and four rows of dots.

use cohaptic_harness::record::{Bands, SANE_POSITION};

const WIDTH: usize = 72;
const HEIGHT: usize = 12;

/// Draws curves of positions into one frame with labelled ends of the axes, and notes if far values were cut off. `scale` converts metres to `unit`.
pub(crate) fn text_plot(bands: &Bands, scale: f64, unit: &str) -> String {
    let (range, cut) = bands.range(SANE_POSITION);
    let mut dots = [[0_u8; WIDTH]; HEIGHT];
    for curve in 0..bands.curves() {
        let mut last: Option<usize> = None;
        for (t, low, high) in bands.curve(curve) {
            // A value beyond the frame interrupts the curve.
            if !range.contains(&low) || !range.contains(&high) {
                last = None;
                continue;
            }
            let column = place(t / bands.seconds(), 2 * WIDTH);
            let row = |value: f64| 4 * HEIGHT - 1 - place((value - range.start) / (range.end - range.start), 4 * HEIGHT);
            // A column is filled from the last row of the curve, so that steep parts stay connected.
            let (mut top, mut bottom) = (row(high), row(low));
            if let Some(last) = last {
                top = top.min(last);
                bottom = bottom.max(last);
            }
            for row in top..=bottom {
                dots[row / 4][column / 2] |= BRAILLE[row % 4][column % 2];
            }
            last = Some(row((low + high) / 2.0));
        }
    }
    let mut text = String::new();
    for (row, line) in dots.iter().enumerate() {
        let label = match row {
            0 => label(range.end * scale),
            _ if row == HEIGHT - 1 => label(range.start * scale),
            _ if row == HEIGHT / 2 => format!("{unit:>9}"),
            _ => " ".repeat(9),
        };
        let line: String = line.iter().filter_map(|dots| char::from_u32(0x2800 + u32::from(*dots))).collect();
        text.push_str(&format!("{label} |{}\n", line.trim_end_matches('\u{2800}')));
    }
    let end = format!("{} s", bands.seconds());
    text.push_str(&format!("{:9} 0{end:>width$}\n", "", width = WIDTH));
    if cut {
        text.push_str("          what goes far beyond is cut off\n");
    }
    text
}

/// Returns a label of an axis, nine characters wide.
fn label(value: f64) -> String {
    if value.abs() < 1e4 { format!("{value:9.3}") } else { format!("{value:9.2e}") }
}

/// Bits of the dots in a braille pattern, indexed by row and column.
pub(crate) const BRAILLE: [[u8; 2]; 4] = [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_precision_loss, reason = "a share of a small number of dots")]
fn place(share: f64, dots: usize) -> usize {
    ((share * dots as f64).max(0.0) as usize).min(dots - 1)
}
