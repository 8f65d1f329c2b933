//! A map as text, in braille patterns of Unicode: a dot marks a stable point.

use crate::text_plot::BRAILLE;

const WIDTH: usize = 60;
const HEIGHT: usize = 15;

/// A character in which every dot is set, for the legend.
pub(super) const FULL: char = '\u{28ff}';

/// An axis: its label, and its values from left to right or from bottom to top.
pub(super) struct Axis<'a> {
    pub(super) label: &'a str,
    pub(super) values: &'a [f64],
}

/// Draws the stable region in characters of Braille, two by four dots each. A dot is set if the cell at the place of the dot is stable. `stable` takes the
/// indices of the values along `x` and along `y`.
pub(super) fn draw(x: &Axis<'_>, y: &Axis<'_>, stable: impl Fn(usize, usize) -> bool) -> String {
    let (columns, rows) = (2 * WIDTH, 4 * HEIGHT);
    let mut text = format!("  {}\n", y.label);
    let ends = |axis: &Axis<'_>| (axis.values.first().copied().unwrap_or_default(), axis.values.last().copied().unwrap_or_default());
    let ((left, right), (bottom, top)) = (ends(x), ends(y));
    for line in 0..HEIGHT {
        let label = match line {
            0 => number(top),
            _ if line == HEIGHT - 1 => number(bottom),
            _ => String::new(),
        };
        let character = |column: usize| {
            let mut dots = 0;
            for (row, pair) in BRAILLE.iter().enumerate() {
                for (half, bit) in pair.iter().enumerate() {
                    // Dots count from the top, cells from the bottom.
                    let from_top = 4 * line + row;
                    let cell_x = (2 * column + half) * x.values.len() / columns;
                    let cell_y = (rows - 1 - from_top) * y.values.len() / rows;
                    dots |= if stable(cell_x, cell_y) { *bit } else { 0 };
                }
            }
            // Braille patterns begin at 0x2800, and each dot is a bit.
            char::from_u32(0x2800 + u32::from(dots)).unwrap_or(' ')
        };
        let picture: String = (0..WIDTH).map(character).collect();
        text.push_str(&format!("{label:>10} |{}\n", picture.trim_end_matches('\u{2800}')));
    }
    let (left, right) = (number(left), number(right));
    let space = (WIDTH + 1).saturating_sub(left.chars().count());
    text.push_str(&format!("{:10} {left}{right:>space$}\n{:12}{}\n", "", "", x.label));
    text
}

/// Returns the label of an end of an axis, with few digits.
fn number(value: f64) -> String {
    let shown = format!("{value}");
    if shown.len() <= 9 { shown } else { format!("{value:.3e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dot_shows_the_cell_in_which_it_lies() {
        let values = [0.0, 1.0];
        let axis = |label| Axis { label, values: &values };
        // Only the lower left cell is stable.
        let text = draw(&axis("x"), &axis("y"), |x, y| x == 0 && y == 0);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), HEIGHT + 3);
        assert_eq!(lines[1], "         1 |");
        let full: String = "\u{28ff}".repeat(WIDTH / 2);
        assert_eq!(lines[HEIGHT], format!("         0 |{full}"));
        // Below the middle are 30 of 60 rows of dots, so the middle line is half full.
        assert_eq!(lines[1 + HEIGHT / 2], format!("           |{}", "\u{28e4}".repeat(WIDTH / 2)));
    }
}
