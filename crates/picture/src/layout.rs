//! Computes the positions of all parts of a picture. Texts have fixed sizes and come first; plots get the remaining room.
//!
//! The size of the plots depends on ticks, wrapped titles and labels, whose sizes depend on the size of the plots. So the layout assumes a height of the
//! plots and measures everything. If a given height of the picture is exceeded, the layout is repeated with less.

use crate::content::{Content, HeatMap};
use crate::ends::EndLabel;
use crate::extent::{Extent, count, whole};
use crate::legend::{Legend, LegendPlace, Sample, entry};
use crate::panel::{Extents, Panel};
use crate::path::Frame;
use crate::picture::Picture;
use crate::text::{LEADING, Text};
use crate::ticks::Ticks;

/// Size of the letters of the title \[font sizes\].
pub(crate) const TITLE: f64 = 1.15;
/// Length of a tick \[font sizes\].
pub(crate) const TICK: f64 = 0.35;
/// Distance from a tick to its label \[font sizes\].
pub(crate) const AFTER_TICK: f64 = 0.25;
/// Margin around the picture and between panels \[font sizes\].
const MARGIN: f64 = 0.8;
/// Width of a colour bar \[font sizes\].
pub(crate) const BAR: f64 = 0.9;
/// Least width of a plot, whatever the size of the picture \[font sizes\].
const LEAST_WIDTH: f64 = 7.0;
/// Least height of a plot, whatever the size of the picture \[font sizes\].
const LEAST_HEIGHT: f64 = 5.0;

/// Positions of a picture's parts \[px\].
#[derive(Debug)]
pub(crate) struct Layout {
    pub(crate) width: f64,
    pub(crate) height: f64,
    pub(crate) margin: f64,
    pub(crate) title: Vec<Text>,
    pub(crate) notes: Vec<Text>,
    pub(crate) panels: Vec<PanelLayout>,
    pub(crate) legend: Legend,
    pub(crate) legend_at: (f64, f64),
}

/// Positions of a panel's parts \[px\].
#[derive(Debug)]
pub(crate) struct PanelLayout {
    pub(crate) frame: Frame,
    pub(crate) extents: Extents,
    pub(crate) title: Vec<Text>,
    pub(crate) x: AxisLayout,
    pub(crate) y: AxisLayout,
    /// Distance from the frame's left edge to the rotated title of the y axis: to its middle, minus half a line.
    pub(crate) y_title_at: f64,
    pub(crate) ends: Vec<EndLabel>,
    pub(crate) bar: Option<AxisLayout>,
}

/// An axis with ticks, title and labels. Labels are missing if another panel shows them.
#[derive(Debug, Default)]
pub(crate) struct AxisLayout {
    pub(crate) ticks: Option<Ticks>,
    pub(crate) title: Vec<Text>,
    pub(crate) labelled: bool,
}

impl AxisLayout {
    /// Removes ticks outside the range.
    fn leave_out_beyond(&mut self, extent: Extent) {
        if let Some(ticks) = &mut self.ticks {
            ticks.marks.retain(|(value, _)| (0.0..=1.0).contains(&extent.place(*value)));
        }
    }

    /// Returns the width of the widest tick label \[px\].
    pub(crate) fn widest(&self, font: f64) -> f64 {
        let labels = self.ticks.iter().flat_map(|ticks| &ticks.marks).filter(|_| self.labelled);
        labels.map(|(_, label)| label.width(font)).fold(0.0, f64::max)
    }
}

/// Room left and right of a frame, for labels and colour bars \[px\].
#[derive(Clone, Copy, Debug)]
struct Room {
    left: f64,
    right: f64,
}

impl Layout {
    pub(crate) fn of(picture: &Picture) -> Self {
        let font = picture.size.font;
        let columns = picture.columns_shown();
        let assumed = picture.aspect * 0.8 * (picture.size.width / count(columns));
        let least = LEAST_HEIGHT * font;
        let mut height = assumed.clamp(least, 60.0 * font);
        if let Some(whole) = picture.size.height {
            height = (whole / count(picture.rows())).max(least);
        }
        let extents = picture.extents();
        let mut attempt = Attempt::new(picture, height, &extents);
        // Each round removes the excess height. The number of rounds is bounded, because ticks and wrapped titles change with the height and can bring new
        // excess.
        if let Some(whole) = picture.size.height {
            for _ in 0..12 {
                let over = attempt.layout.height - whole;
                if over <= 0.01 || height <= least {
                    break;
                }
                height = (height - over / count(picture.rows())).max(least);
                attempt = Attempt::new(picture, height, &extents);
            }
            attempt.layout.height = attempt.layout.height.max(whole);
        }
        if picture.equal_units {
            let whole = attempt.layout.height;
            // New ranges have other ticks with labels of other widths, which change the width of the plots. Three rounds settle this.
            for _ in 0..3 {
                attempt = Attempt::new(picture, height, &equal_units(&attempt.layout.panels, &extents));
            }
            attempt.layout.height = attempt.layout.height.max(whole);
            // The frames are final now. A last adjustment makes the units exactly equal, and ticks pushed off an axis are dropped.
            let settled = equal_units(&attempt.layout.panels, &extents);
            for (panel, extents) in attempt.layout.panels.iter_mut().zip(settled) {
                panel.extents = extents;
                panel.x.leave_out_beyond(extents.x);
                panel.y.leave_out_beyond(extents.y);
            }
        }
        attempt.layout
    }
}

/// Widens the axes of all panels to a common length of the unit, the largest for which all content fits.
fn equal_units(panels: &[PanelLayout], shown: &[Extents]) -> Vec<Extents> {
    let sides = |panel: &PanelLayout, shown: &Extents| [(panel.frame.width(), shown.x), (panel.frame.height(), shown.y)];
    let scales = panels.iter().zip(shown).flat_map(|(panel, shown)| sides(panel, shown)).filter_map(|(length, extent)| Some(length / extent.span()?));
    let scale = scales.fold(f64::INFINITY, f64::min);
    let widened = |(panel, shown): (&PanelLayout, &Extents)| {
        let [x, y] = sides(panel, shown).map(|(length, extent)| extent.spanning(length / scale));
        Extents { x, y }
    };
    panels.iter().zip(shown).map(widened).collect()
}

/// A layout for an assumed height of the plots.
struct Attempt {
    layout: Layout,
}

impl Attempt {
    fn new(picture: &Picture, plot_height: f64, extents: &[Extents]) -> Self {
        let (font, width, columns, rows) = (picture.size.font, picture.size.width, picture.columns_shown(), picture.rows());
        let margin = MARGIN * font;
        let title = picture.title.wrapped(TITLE * font, width - 2.0 * margin, 8);
        let notes: Vec<Text> = picture.notes.iter().flat_map(|note| note.wrapped(font, width - 2.0 * margin, 8)).collect();
        let header = margin
            + LEADING * font * (TITLE * count(title.len()) + count(notes.len()))
            + if title.is_empty() && notes.is_empty() { 0.0 } else { 0.3 * font };

        // Decided per panel before the legend, because names that do not fit at the ends go to the legend.
        let at_ends: Vec<bool> = picture.panels.iter().map(|panel| panel.labels_at_ends && EndLabel::fit(panel, font, plot_height)).collect();
        let entries = entries(&picture.panels, &at_ends);
        let narrow = picture.legend == LegendPlace::Right;
        // A legend at the right must leave most of the width to the plots.
        let legend_width = if narrow { 0.35 * width } else { width - 2.0 * margin };
        let legend = if picture.legend == LegendPlace::Nowhere { Legend::default() } else { Legend::new(&entries, font, legend_width, narrow) };
        let beside = if narrow && legend.width > 0.0 { legend.width + margin } else { 0.0 };
        let for_panels = width - 2.0 * margin - beside;

        // Vertical sizes are known now, so y ticks, labels at ends and colour bars can be laid out.
        let cell = for_panels / count(columns);
        let mut panels: Vec<PanelLayout> = Vec::new();
        let mut rooms: Vec<Room> = Vec::new();
        for (place, panel) in picture.panels.iter().enumerate() {
            // With a shared y only the first column has labels.
            let y_labelled = !(picture.shared_y && place % columns != 0);
            let y = upright(&panel.y, extents[place].y, font, plot_height, y_labelled);
            let ends = if at_ends[place] { EndLabel::of(panel, extents[place], font, 0.32 * cell, plot_height) } else { Vec::new() };
            let bar = panel.heat_map().map(|map| upright(&map.axis, map.extent(), font, plot_height, true));
            let labels = y.widest(font);
            let y_title_at = TICK * font + AFTER_TICK * font + labels + 0.35 * font;
            let left = if y_labelled { y_title_at + LEADING * font * count(y.title.len()) } else { 0.9 * font };
            let after = ends.iter().map(EndLabel::width).fold(0.0, f64::max);
            let right = match &bar {
                Some(bar) => (0.8 + BAR + TICK + AFTER_TICK + 0.35) * font + bar.widest(font) + LEADING * font * count(bar.title.len()),
                None if after > 0.0 => after + 1.6 * font,
                None => 0.0,
            };
            rooms.push(Room { left, right });
            let frame = Frame { left: 0.0, top: 0.0, right: 0.0, bottom: 0.0 };
            panels.push(PanelLayout { frame, extents: extents[place], title: Vec::new(), x: AxisLayout::default(), y, y_title_at, ends, bar });
        }

        // Ticks on x need the width of the plots, and their labels reach beyond both ends of the axis. The layout begins with the largest possible width
        // and repeats with the room of the labels.
        let along = |plot_width: f64| -> Vec<AxisLayout> {
            let axis = |(place, panel): (usize, &Panel)| {
                let labelled = !(picture.shared_x && place + columns < picture.panels.len());
                level(&panel.x, extents[place].x, font, plot_width, labelled)
            };
            picture.panels.iter().enumerate().map(axis).collect()
        };
        let least = LEAST_WIDTH * font;
        let column_rooms = |rooms: &[Room], column: usize| {
            let of = |side: fn(&Room) -> f64| rooms.iter().skip(column).step_by(columns).map(side).fold(0.0, f64::max);
            (of(|room| room.left), of(|room| room.right))
        };
        let plot_width_of = |rooms: &[Room]| {
            let used: f64 = (0..columns).map(|column| column_rooms(rooms, column)).map(|(left, right)| left + right).sum();
            ((for_panels - used - 0.9 * font * count(columns - 1)) / count(columns)).max(least)
        };
        let mut axes = along(plot_width_of(&rooms));
        for _ in 0..2 {
            for (room, axis) in rooms.iter_mut().zip(&axes) {
                // Half of the widest label can reach beyond either end of the axis.
                let half = 0.5 * axis.widest(font) + 0.1 * font;
                *room = Room { left: room.left.max(half), right: room.right.max(half) };
            }
            axes = along(plot_width_of(&rooms));
        }
        let plot_width = plot_width_of(&rooms);

        // Panels of a row share their top and their bottom, so that frames are aligned.
        let mut tops = vec![0.0_f64; rows];
        let mut bottoms = vec![0.0_f64; rows];
        for (place, (panel, axis)) in panels.iter_mut().zip(axes).enumerate() {
            let (_, right) = column_rooms(&rooms, place % columns);
            panel.title = picture.panels[place].title.wrapped(font, plot_width + right, 4);
            tops[place / columns] = tops[place / columns].max(LEADING * font * count(panel.title.len()) + 0.75 * font);
            panel.x = axis;
            let labels = if panel.x.labelled { (0.6 + LEADING) * font } else { 0.75 * font };
            let below = labels + LEADING * font * count(panel.x.title.len());
            bottoms[place / columns] = bottoms[place / columns].max(below);
        }
        let mut y = header;
        let mut body_width = 0.0_f64;
        for row in 0..rows {
            y += tops[row];
            let mut x = margin;
            for column in 0..columns {
                let (left, right) = column_rooms(&rooms, column);
                x += left;
                if let Some(panel) = panels.get_mut(row * columns + column) {
                    panel.frame = Frame { left: x, top: y, right: x + plot_width, bottom: y + plot_height };
                }
                x += plot_width + right + 0.9 * font;
            }
            body_width = body_width.max(x - 0.9 * font - margin);
            y += plot_height + bottoms[row] + if row + 1 < rows { 0.3 * font } else { 0.0 };
        }
        let legend_at = if narrow { (margin + body_width + margin, header + 0.75 * font) } else { (margin, y + 0.5 * font) };
        let mut height = y;
        if legend.height > 0.0 {
            height = if narrow { height.max(legend_at.1 + legend.height) } else { legend_at.1 + legend.height };
        }
        let width = width.max(margin + body_width + beside + margin);
        Self { layout: Layout { width, height: height + 0.5 * margin, margin, title, notes, panels, legend, legend_at } }
    }
}

/// Returns sample and name of all named contents, each once. Lines named at their ends are left out.
fn entries(panels: &[Panel], at_ends: &[bool]) -> Vec<(Sample, Text)> {
    let mut entries: Vec<(Sample, Text)> = Vec::new();
    for (panel, at_ends) in panels.iter().zip(at_ends) {
        for content in &panel.contents {
            let Some((sample, name)) = entry(content) else { continue };
            let labelled = *at_ends && EndLabel::is_labelled(content);
            if !labelled && !entries.iter().any(|(known, text)| *known == sample && text == name) {
                entries.push((sample, name.clone()));
            }
        }
    }
    entries
}

/// Lays out a vertical axis, with as many ticks as possible without overlapping labels.
fn upright(axis: &crate::Axis, extent: Extent, font: f64, height: f64, labelled: bool) -> AxisLayout {
    let ticks = thinned(axis, extent, whole(height / (2.0 * font)).clamp(2, 7), |ticks| {
        let places: Vec<f64> = ticks.marks.iter().map(|(value, _)| height * extent.place(*value)).collect();
        places.windows(2).any(|pair| (pair[1] - pair[0]).abs() < LEADING * font)
    });
    // The title may be slightly longer than the plot, within the margins.
    let title = if labelled { axis.title(ticks.exponent).wrapped(font, height + 0.7 * font, 3) } else { Vec::new() };
    AxisLayout { ticks: Some(ticks), title, labelled }
}

/// Lays out a horizontal axis, with as many ticks as possible without overlapping labels.
fn level(axis: &crate::Axis, extent: Extent, font: f64, width: f64, labelled: bool) -> AxisLayout {
    let ticks = thinned(axis, extent, whole(width / (3.0 * font)).clamp(2, 9), |ticks| {
        let spans: Vec<(f64, f64)> = ticks.marks.iter().map(|(value, label)| (width * extent.place(*value), 0.5 * label.width(font))).collect();
        spans.windows(2).any(|pair| pair[1].0 - pair[1].1 < pair[0].0 + pair[0].1 + 0.6 * font)
    });
    let title = if labelled { axis.title(ticks.exponent).wrapped(font, width, 3) } else { Vec::new() };
    AxisLayout { ticks: Some(ticks), title, labelled }
}

/// Returns at most `most` ticks without overlapping labels, and a single tick if even two labels overlap.
fn thinned(axis: &crate::Axis, extent: Extent, mut most: usize, crowded: impl Fn(&Ticks) -> bool) -> Ticks {
    let mut ticks = axis.ticks(extent, most);
    while most > 1 && crowded(&ticks) {
        most -= 1;
        ticks = axis.ticks(extent, most);
    }
    if crowded(&ticks) {
        ticks.marks.truncate(1);
    }
    ticks
}

impl Panel {
    /// Returns the first heat map, the one with the colour bar.
    pub(crate) fn heat_map(&self) -> Option<&HeatMap> {
        self.contents.iter().find_map(|content| if let Content::HeatMap(map) = content { Some(map) } else { None })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Axis, Line, Look, Size};

    #[test]
    fn equal_units_are_equal_in_all_panels_of_any_size() {
        let panel =
            |x: f64, y: f64| Panel::new(Axis::new("x").unit("cm"), Axis::new("y").unit("cm")).with(Line::new([(-x, 0.0), (x, y)], Look::of(0)));
        let sizes = [Size::PAGE, Size::ONE_COLUMN, Size::pixels(900.0, 300.0).unwrap(), Size::pixels(400.0, 2000.0).unwrap()];
        for size in sizes {
            let picture =
                Picture::new("three").size(size).columns(3).equal_units().panels([panel(20.0, 30.0), panel(20.0, 0.01), panel(1234.5, 1e-3)]);
            let layout = Layout::of(&picture);
            let unit = |length: f64, extent: Extent| length / (extent.high - extent.low);
            let units =
                layout.panels.iter().flat_map(|panel| [unit(panel.frame.width(), panel.extents.x), unit(panel.frame.height(), panel.extents.y)]);
            let units: Vec<f64> = units.collect();
            assert!(units.iter().all(|one| (one / units[0] - 1.0).abs() < 1e-9), "{units:?}");
            for (panel, shown) in layout.panels.iter().zip(picture.extents()) {
                let holds = |wide: Extent, shown: Extent| wide.low <= shown.low + 1e-9 && wide.high >= shown.high - 1e-9;
                assert!(holds(panel.extents.x, shown.x) && holds(panel.extents.y, shown.y), "all that is shown is within");
                assert!(panel.x.ticks.as_ref().is_some_and(|ticks| !ticks.marks.is_empty()));
            }
        }
    }
}
