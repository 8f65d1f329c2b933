//! Names of lines at their right ends, moved apart so that no name overlaps another.

use crate::content::{Content, Line};
use crate::extent::count;
use crate::look::Look;
use crate::panel::{Extents, Panel};
use crate::text::{LEADING, Text};

/// Name of a line at the line's end.
#[derive(Debug)]
pub(crate) struct EndLabel {
    pub(crate) look: Look,
    pub(crate) lines: Vec<Text>,
    /// Position of the line's end, as a share of the plot's height from the top.
    pub(crate) end: f64,
    /// Position of the middle of the name, as a share of the plot's height from the top.
    pub(crate) middle: f64,
    font: f64,
}

impl EndLabel {
    /// Returns whether the content is a line with a name that can be written at the end of the line, in place of an entry in the legend.
    pub(crate) fn is_labelled(content: &Content) -> bool {
        matches!(content, Content::Line(line) if line.joined && line.look.colour.is_some() && !line.name.is_empty() && !line.runs.is_empty())
    }

    fn labelled(panel: &Panel) -> Vec<&Line> {
        let labelled = panel.contents.iter().filter(|content| Self::is_labelled(content));
        labelled.filter_map(|content| if let Content::Line(line) = content { Some(line) } else { None }).collect()
    }

    /// Returns whether all names fit above each other, with up to two lines each.
    pub(crate) fn fit(panel: &Panel, font: f64, plot_height: f64) -> bool {
        // A colour bar occupies the same place.
        panel.heat_map().is_none() && count(2 * Self::labelled(panel).len()) * LEADING * font <= plot_height
    }

    /// Places the names beside their lines' ends, without overlaps.
    pub(crate) fn of(panel: &Panel, extents: Extents, font: f64, width: f64, plot_height: f64) -> Vec<Self> {
        let label = |line: &Line| {
            // The last visible point of the line, not the last point.
            let seen = line.runs.iter().flatten().rfind(|(x, _)| (0.0..=1.0).contains(&extents.x.place(*x)));
            let place = seen.map(|(_, y)| extents.y.place(*y)).filter(|place| place.is_finite());
            let end = 1.0 - place.unwrap_or(0.5).clamp(0.0, 1.0);
            Self { look: line.look, lines: line.name.wrapped(font, width.max(3.0 * font), 2), end, middle: end, font }
        };
        let mut labels: Vec<Self> = Self::labelled(panel).into_iter().map(label).collect();
        labels.sort_by(|one, other| one.end.total_cmp(&other.end));
        spread(&mut labels, plot_height);
        labels
    }

    pub(crate) fn width(&self) -> f64 {
        self.lines.iter().map(|line| line.width(self.font)).fold(0.0, f64::max)
    }

    fn height(&self) -> f64 {
        LEADING * self.font * count(self.lines.len())
    }
}

/// Moves overlapping names apart by the least distance: touching names form a block, placed at the mean of the wanted positions.
fn spread(labels: &mut [EndLabel], plot_height: f64) {
    // Blocks of touching names: top \[px\], height \[px\], number of names.
    let mut blocks: Vec<(f64, f64, usize)> = Vec::new();
    for label in labels.iter() {
        let height = label.height();
        let within = |top: f64, height: f64| top.clamp(0.0, (plot_height - height).max(0.0));
        let mut block = (within(label.end * plot_height - 0.5 * height, height), height, 1);
        // A merged block can overlap the block before, so merging repeats.
        while let Some(before) = blocks.last().copied().filter(|before| before.0 + before.1 > block.0) {
            blocks.pop();
            let (many, height) = (before.2 + block.2, before.1 + block.1);
            let middle = (count(before.2) * (before.0 + 0.5 * before.1) + count(block.2) * (block.0 + 0.5 * block.1)) / count(many);
            block = (within(middle - 0.5 * height, height), height, many);
        }
        blocks.push(block);
    }
    let mut labels = labels.iter_mut();
    for (mut top, _, many) in blocks {
        for label in labels.by_ref().take(many) {
            label.middle = (top + 0.5 * label.height()) / plot_height;
            top += label.height();
        }
    }
}
