//! Curves over time as text, in braille patterns of Unicode: each character has two columns and four rows of dots. A letter at the end of each curve leads to
//! the name in the legend below, because a terminal without colours has no other way to tell curves apart.

use cohaptic_harness::record::{Bands, SANE_POSITION};

use crate::words::length_unit;

const WIDTH: usize = 60;
const HEIGHT: usize = 12;

/// Number of spans of time of the curves in the text about a run: one for each column of dots.
pub const TEXT_PLOT_SPANS: usize = 2 * WIDTH;

/// Most curves with a letter: as many as peers with a line in the text below the plot.
const MOST_LETTERS: usize = 8;

/// Greatest width of a line of the legend \[characters\].
const LEGEND_WIDTH: usize = 70;

/// Draws curves of positions \[m\] into one frame with labelled ends of the axes, and a legend below. `names` are the names of the curves. Notes in the legend
/// which curves leave the frame, if far values were cut off. The unit is that of the lengths in the text below the plot.
pub(crate) fn text_plot(bands: &Bands, names: &[&str]) -> String {
    let (range, cut) = bands.range(SANE_POSITION);
    let (scale, unit) = length_unit(range.start.abs().max(range.end.abs()));
    let mut dots = [[0_u8; WIDTH]; HEIGHT];
    // Letters of the curves that end in each line.
    let mut letters = [const { String::new() }; HEIGHT];
    let mut entries: Vec<String> = Vec::new();
    for curve in 0..bands.curves() {
        let mut last: Option<usize> = None;
        let mut end: Option<usize> = None;
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
            end = last;
        }
        // Curves without a letter have no entry in the legend, and are counted below.
        if let (Some(name), Some(letter)) = (names.get(curve), ('a'..='z').take(MOST_LETTERS).nth(curve)) {
            if let Some(row) = end {
                letters[row / 4].push(letter);
            }
            entries.push(format!("{letter} {name}{}", if last.is_none() { " (leaves the frame)" } else { "" }));
        }
    }
    if let Some(more @ 1..) = bands.curves().checked_sub(entries.len()) {
        entries.push(format!("and {more} more"));
    }
    let mut text = String::new();
    for (row, (line, letters)) in dots.iter().zip(&letters).enumerate() {
        let label = match row {
            0 => label(range.end * scale),
            _ if row == HEIGHT - 1 => label(range.start * scale),
            _ if row == HEIGHT / 2 => format!("{unit:>9}"),
            _ => " ".repeat(9),
        };
        let line: String = line.iter().filter_map(|dots| char::from_u32(0x2800 + u32::from(*dots))).collect();
        let line = line.trim_end_matches('\u{2800}');
        text.push_str(format!("{label} |{line:WIDTH$} {letters}").trim_end());
        text.push('\n');
    }
    let end = format!("{} s", bands.seconds());
    text.push_str(&format!("{:9} 0{end:>width$}\n", "", width = WIDTH));
    legend(&mut text, &entries);
    if cut {
        text.push_str("          what goes far beyond is cut off\n");
    }
    text
}

/// Appends the entries, in lines of at most [`LEGEND_WIDTH`] characters where an entry is not longer.
fn legend(text: &mut String, entries: &[String]) {
    let mut line = String::new();
    for entry in entries {
        if !line.is_empty() && line.chars().count() + 3 + entry.chars().count() > LEGEND_WIDTH {
            text.push_str(&format!("{:10}{line}\n", ""));
            line.clear();
        }
        line.push_str(if line.is_empty() { "" } else { "   " });
        line.push_str(entry);
    }
    text.push_str(&format!("{:10}{line}\n", ""));
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

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use cohaptic_units::Instant;

    use super::*;

    /// Draws positions over ten seconds, one tick in each span.
    fn plot(names: &[&str], position: impl Fn(usize, f64) -> f64) -> Vec<String> {
        let mut bands = Bands::new(Duration::from_secs(10), TEXT_PLOT_SPANS, names.len());
        for tick in 0..100_u32 {
            let at = Instant::from_nanos(u64::from(tick) * 100_000_000);
            (0..names.len()).for_each(|curve| bands.add(curve, at, position(curve, f64::from(tick) / 10.0)));
        }
        text_plot(&bands, names).lines().map(str::to_owned).collect()
    }

    /// A range from −30 mm to 30 mm, of which the margin is a twentieth.
    #[test]
    fn every_curve_ends_at_its_letter_and_the_legend_has_its_name() {
        let lines = plot(&["left", "right", "third"], |curve, _| [0.03, -0.03, 0.03][curve]);
        assert!(lines[0].starts_with("   33.000 |") && lines[HEIGHT - 1].starts_with("  -33.000 |"), "{lines:#?}");
        assert_eq!(lines[HEIGHT / 2].trim(), "mm |", "the unit of the lengths below the plot");
        let letters = |line: &str| line.chars().skip(11 + WIDTH).collect::<String>();
        let ends: Vec<String> = lines[..HEIGHT].iter().map(|line| letters(line)).filter(|letters| !letters.is_empty()).collect();
        assert_eq!(ends, [" ac", " b"], "{lines:#?}");
        assert_eq!(lines[HEIGHT + 1..], ["          a left   b right   c third"]);
        assert!(lines.iter().all(|line| line.chars().count() <= 80), "{lines:#?}");
    }

    #[test]
    fn a_curve_that_leaves_the_frame_ends_where_it_leaves() {
        let lines = plot(&["calm", "wild"], |curve, t| if curve == 0 { 0.01 } else { 1e-3 * (3.0 * t).exp() });
        assert_eq!(lines[HEIGHT + 1..], ["          a calm   b wild (leaves the frame)", "          what goes far beyond is cut off"]);
    }

    #[test]
    fn a_crowd_has_letters_for_some_and_its_legend_is_wrapped() {
        let names: Vec<String> = (1..=12).map(|peer| format!("participant-{peer}")).collect();
        let lines = plot(&names.iter().map(String::as_str).collect::<Vec<_>>(), |curve, _| if curve < 6 { 0.01 } else { 0.02 });
        let legend = [
            "          a participant-1   b participant-2   c participant-3   d participant-4",
            "          e participant-5   f participant-6   g participant-7   h participant-8",
            "          and 4 more",
        ];
        assert_eq!(lines[HEIGHT + 1..], legend);
    }
}
