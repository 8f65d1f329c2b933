//! A panel: two axes and the content between them.

use crate::axis::Axis;
use crate::content::{Content, Reach, together};
use crate::extent::Extent;
use crate::text::Text;

/// A plot of a picture.
///
/// ```
/// use cohaptic_picture::{Axis, Line, Look, Panel};
///
/// let panel = Panel::new(Axis::new("Time").symbol("t").unit("s"), Axis::new("Position").unit("cm"))
///     .titled("along x")
///     .with(Line::new([(0.0, 1.0), (1.0, 2.0)], Look::of(0)).named("left"));
/// ```
#[derive(Clone, PartialEq, Debug)]
pub struct Panel {
    pub(crate) title: Text,
    pub(crate) x: Axis,
    pub(crate) y: Axis,
    pub(crate) contents: Vec<Content>,
    pub(crate) labels_at_ends: bool,
}

impl Panel {
    /// Creates an empty panel.
    #[must_use]
    pub const fn new(x: Axis, y: Axis) -> Self {
        Self { title: Text { spans: Vec::new() }, x, y, contents: Vec::new(), labels_at_ends: false }
    }

    /// Sets the title above the panel.
    #[must_use]
    pub fn titled(self, title: impl Into<Text>) -> Self {
        Self { title: title.into(), ..self }
    }

    /// Appends a content, drawn over earlier contents. All areas are drawn before all lines.
    #[must_use]
    pub fn with(mut self, content: impl Into<Content>) -> Self {
        self.contents.push(content.into());
        self
    }

    /// Appends several contents.
    #[must_use]
    pub fn with_all<C: Into<Content>>(mut self, contents: impl IntoIterator<Item = C>) -> Self {
        self.contents.extend(contents.into_iter().map(Into::into));
        self
    }

    /// Names lines at their right ends instead of in the legend. If the room is not enough, all names go to the legend.
    #[must_use]
    pub fn labels_at_ends(self) -> Self {
        Self { labels_at_ends: true, ..self }
    }

    /// Returns the ranges of x and y of this panel's content.
    pub(crate) fn content_extents(&self) -> Reach {
        self.contents.iter().map(|content| content.extents(self.x.scale, self.y.scale)).fold((None, None), together)
    }
}

/// Ranges of a panel's axes, as shown.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Extents {
    pub(crate) x: Extent,
    pub(crate) y: Extent,
}
