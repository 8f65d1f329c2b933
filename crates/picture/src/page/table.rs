//! Tables of pages.

use super::Html;

/// A table: rows below named columns. The first cell of a row is the row's heading.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Table {
    /// Title of the table; empty for a table without a title.
    pub(super) title: String,
    /// Names of groups of neighbouring columns, each with its number of columns.
    pub(super) groups: Vec<(String, usize)>,
    /// Names of the columns, and whether a column has numbers.
    pub(super) columns: Vec<(String, bool)>,
    pub(super) rows: Vec<Vec<Html>>,
}

impl Table {
    /// Creates a table without columns.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Sets a title above the table.
    #[must_use]
    pub fn titled(mut self, title: impl Into<String>) -> Self {
        self.title = title.into();
        self
    }

    /// Appends a column of text.
    #[must_use]
    pub fn column(mut self, name: impl Into<String>) -> Self {
        self.columns.push((name.into(), false));
        self
    }

    /// Appends a column of numbers.
    #[must_use]
    pub fn number(mut self, name: impl Into<String>) -> Self {
        self.columns.push((name.into(), true));
        self
    }

    /// Names the next `columns` columns as a group, in a row above the names of the columns. An empty name leaves the columns without one.
    #[must_use]
    pub fn group(mut self, name: impl Into<String>, columns: usize) -> Self {
        self.groups.push((name.into(), columns));
        self
    }

    /// Appends a row.
    #[must_use]
    pub fn row(mut self, cells: impl IntoIterator<Item = Html>) -> Self {
        self.rows.push(cells.into_iter().collect());
        self
    }

    /// Returns whether the table has no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }
}
