//! Groups of rows. A group is a table and a plot.

use crate::{Row, Subject};

/// Rows of one plot: the same work, the same kind of error, the same kind of cost.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Group<'a> {
    pub(crate) subject: Subject,
    pub(crate) case: &'a str,
    pub(crate) error_unit: &'static str,
    pub(crate) cost_unit: &'static str,
    pub(crate) rows: Vec<&'a Row>,
}

/// Groups rows by subject, case, and the units of error and cost. The groups stand in the order of their first rows.
pub(crate) fn groups(rows: &[Row]) -> Vec<Group<'_>> {
    let mut groups: Vec<Group<'_>> = Vec::new();
    for row in rows {
        let Row { subject, case, error_unit, cost_unit, .. } = row;
        // There are few groups, so a linear search is enough and keeps the order of the rows.
        let found = groups
            .iter_mut()
            .find(|group| group.subject == *subject && group.case == *case && group.error_unit == *error_unit && group.cost_unit == *cost_unit);
        match found {
            Some(group) => group.rows.push(row),
            None => groups.push(Group { subject: *subject, case, error_unit, cost_unit, rows: vec![row] }),
        }
    }
    groups
}

impl<'a> Group<'a> {
    /// Returns the methods, in the order of their first rows.
    pub(crate) fn methods(&self) -> Vec<&'a str> {
        let mut methods: Vec<&str> = Vec::new();
        for row in &self.rows {
            if !methods.contains(&row.method.as_str()) {
                methods.push(&row.method);
            }
        }
        methods
    }

    /// Returns the references, in the order of their first rows; nearly always a single reference.
    pub(crate) fn references(&self) -> Vec<&'static str> {
        let mut references = Vec::new();
        for row in &self.rows {
            if !references.contains(&row.reference) {
                references.push(row.reference);
            }
        }
        references
    }

    /// Returns the title of the group.
    pub(crate) fn title(&self) -> String {
        format!("{}, {}: {} against {}", self.subject.name(), self.case, self.error_unit, self.cost_unit)
    }
}
