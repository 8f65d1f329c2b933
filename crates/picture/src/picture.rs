//! Whole pictures: title, panels in a grid, legend.

use crate::content::{Reach, together};
use crate::extent::{Scale, whole};
use crate::legend::LegendPlace;
use crate::panel::{Extents, Panel};
use crate::size::Size;
use crate::text::Text;

/// A picture that becomes a single SVG document. Equal pictures become equal bytes.
///
/// See the [crate] for examples.
#[derive(Clone, PartialEq, Debug)]
pub struct Picture {
    pub(crate) title: Text,
    pub(crate) notes: Vec<Text>,
    pub(crate) description: String,
    pub(crate) size: Size,
    pub(crate) panels: Vec<Panel>,
    columns: usize,
    pub(crate) shared_x: bool,
    pub(crate) shared_y: bool,
    pub(crate) legend: LegendPlace,
    pub(crate) aspect: f64,
    pub(crate) equal_units: bool,
}

impl Picture {
    /// Creates a picture without panels. The title is wrapped and ends in an ellipsis after eight lines; text that must not be lost belongs into a
    /// [`note`](Self::note).
    #[must_use]
    pub fn new(title: impl Into<Text>) -> Self {
        Self {
            title: title.into(),
            notes: Vec::new(),
            description: String::new(),
            size: Size::default(),
            panels: Vec::new(),
            columns: 1,
            shared_x: false,
            shared_y: false,
            legend: LegendPlace::default(),
            aspect: 0.6,
            equal_units: false,
        }
    }

    /// Appends a paragraph below the title: a subtitle or a warning.
    #[must_use]
    pub fn note(mut self, note: impl Into<Text>) -> Self {
        self.notes.push(note.into());
        self
    }

    /// Returns whether the picture has this note.
    #[must_use]
    pub fn has_note(&self, note: &str) -> bool {
        self.notes.iter().any(|known| known.plain() == note)
    }

    /// Sets a description for screen readers, added to the titles.
    #[must_use]
    pub fn description(self, description: impl Into<String>) -> Self {
        Self { description: description.into(), ..self }
    }

    /// Sets the size. The picture grows beyond the size if texts leave no room for plots.
    #[must_use]
    pub fn size(self, size: Size) -> Self {
        Self { size, ..self }
    }

    /// Appends a panel, to the right of the last panel or in a new row.
    #[must_use]
    pub fn panel(mut self, panel: Panel) -> Self {
        self.panels.push(panel);
        self
    }

    /// Appends several panels.
    #[must_use]
    pub fn panels(mut self, panels: impl IntoIterator<Item = Panel>) -> Self {
        self.panels.extend(panels);
        self
    }

    /// Sets the number of panels per row, reduced if the picture is too narrow. The default is 1.
    #[must_use]
    pub fn columns(self, columns: usize) -> Self {
        Self { columns: columns.max(1), ..self }
    }

    /// Gives all panels the same range of x, with labels in the last row only.
    #[must_use]
    pub fn shared_x(self) -> Self {
        Self { shared_x: true, ..self }
    }

    /// Gives all panels the same range of y, with labels in the first column only.
    #[must_use]
    pub fn shared_y(self) -> Self {
        Self { shared_y: true, ..self }
    }

    /// Sets the place of the legend.
    #[must_use]
    pub fn legend(self, legend: LegendPlace) -> Self {
        Self { legend, ..self }
    }

    /// Sets the ratio of height to width of plots, for sizes without a given height. The default is 0.6; the ratio is limited to 0.1 to 3.
    #[must_use]
    pub fn aspect(self, aspect: f64) -> Self {
        // `clamp` would keep NaN, and the height of the plots would become NaN.
        Self { aspect: if aspect.is_finite() { aspect.clamp(0.1, 3.0) } else { self.aspect }, ..self }
    }

    /// Gives all linear axes of all panels the same length of a unit. Axes are widened at both ends as needed.
    #[must_use]
    pub fn equal_units(self) -> Self {
        Self { equal_units: true, ..self }
    }

    /// Returns the number of columns, limited by the room for a plot with its labels.
    pub(crate) fn columns_shown(&self) -> usize {
        const LEAST: f64 = 13.0;
        self.columns.min(whole(self.size.width / (LEAST * self.size.font))).clamp(1, self.panels.len().max(1))
    }

    pub(crate) fn rows(&self) -> usize {
        self.panels.len().div_ceil(self.columns_shown()).max(1)
    }

    /// Returns the ranges of each panel's axes, as shown.
    pub(crate) fn extents(&self) -> Vec<Extents> {
        let own: Vec<_> = self.panels.iter().map(Panel::content_extents).collect();
        let all = own.iter().copied().fold((None, None), together);
        // A shared axis is the first panel's, over the content of all panels.
        let first = self.panels.first();
        let of = |(panel, (x, y)): (&Panel, &Reach)| Extents {
            x: if self.shared_x { first.unwrap_or(panel).x.shown(all.0) } else { panel.x.shown(*x) },
            y: if self.shared_y { first.unwrap_or(panel).y.shown(all.1) } else { panel.y.shown(*y) },
        };
        self.panels.iter().zip(&own).map(of).collect()
    }

    /// Returns the text for screen readers: notes, description, and titles and axes of the panels.
    pub(crate) fn spoken(&self) -> String {
        let mut sentences: Vec<String> = self.notes.iter().map(Text::plain).collect();
        sentences.extend((!self.description.is_empty()).then(|| self.description.clone()));
        for panel in &self.panels {
            let scale = |axis: &crate::Axis| if axis.scale == Scale::Logarithmic { " (logarithmic)" } else { "" };
            // Without an exponent, because the power of ten belongs to the tick labels, and the labels are not read out.
            let (x, y) = (panel.x.title(0).plain(), panel.y.title(0).plain());
            let before = if panel.title.is_empty() { String::new() } else { format!("{}: ", panel.title.plain()) };
            sentences.push(format!("{before}{y}{} over {x}{}.", scale(&panel.y), scale(&panel.x)));
        }
        sentences.join(" ")
    }
}
