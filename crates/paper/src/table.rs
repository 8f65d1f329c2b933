//! Small tables of text.

/// Sign of a cell in which a claim fails, readable without colours.
pub const FAILS: &str = "✗";

/// A small table of text.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Table {
    /// Title: the subject of the table, with the unit of its numbers.
    pub title: String,
    /// Groups of neighbouring columns: name, and number of columns. Empty for a table without groups; otherwise the numbers sum up to the length of `head`.
    pub groups: Vec<(String, usize)>,
    /// Names of the columns.
    pub head: Vec<String>,
    /// Rows, each as long as `head`. Cells in which the claim fails end with [`FAILS`].
    pub rows: Vec<Vec<String>>,
}

impl Table {
    pub(crate) fn new(title: impl Into<String>, head: &[&str]) -> Self {
        Self { title: title.into(), groups: Vec::new(), head: head.iter().map(|cell| (*cell).to_owned()).collect(), rows: Vec::new() }
    }

    /// Names groups of columns, each with its number of columns.
    pub(crate) fn grouped<'a>(self, groups: impl IntoIterator<Item = (&'a str, usize)>) -> Self {
        Self { groups: groups.into_iter().map(|(name, columns)| (name.to_owned(), columns)).collect(), ..self }
    }

    /// Appends a row.
    pub(crate) fn row(mut self, cells: impl IntoIterator<Item = String>) -> Self {
        self.rows.push(cells.into_iter().collect());
        self
    }

    /// Appends rows.
    pub(crate) fn all<R: IntoIterator<Item = String>>(self, rows: impl IntoIterator<Item = R>) -> Self {
        rows.into_iter().fold(self, Self::row)
    }
}

/// Returns a cell, with [`FAILS`] if the claim fails there.
pub(crate) fn cell(text: impl Into<String>, fails: bool) -> String {
    let text = text.into();
    if fails { format!("{text} {FAILS}") } else { text }
}

/// Writes a share as a percentage.
pub(crate) fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

/// Writes a time \[s\], or words for a missing time.
pub(crate) fn seconds(time: Option<f64>) -> String {
    time.map_or_else(|| "not reached".to_owned(), |time| format!("{time:.3} s"))
}
