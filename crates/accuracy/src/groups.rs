//! Rows that belong together: what stands in one table, and what lies in one plot.

use crate::{Row, Subject};

/// The rows of one plot: the same work, the same kind of error, the same kind of cost.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Group<'a> {
    pub(crate) subject: Subject,
    pub(crate) case: &'a str,
    pub(crate) error_unit: &'static str,
    pub(crate) cost_unit: &'static str,
    pub(crate) rows: Vec<&'a Row>,
}

/// All groups, in the order in which their first rows came.
pub(crate) fn groups(rows: &[Row]) -> Vec<Group<'_>> {
    let mut groups: Vec<Group<'_>> = Vec::new();
    for row in rows {
        let Row { subject, case, error_unit, cost_unit, .. } = row;
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
    /// The methods, in the order in which they came.
    pub(crate) fn methods(&self) -> Vec<&'a str> {
        let mut methods: Vec<&str> = Vec::new();
        for row in &self.rows {
            if !methods.contains(&row.method.as_str()) {
                methods.push(&row.method);
            }
        }
        methods
    }

    /// The references, in the order in which they came: nearly always one.
    pub(crate) fn references(&self) -> Vec<&'static str> {
        let mut references = Vec::new();
        for row in &self.rows {
            if !references.contains(&row.reference) {
                references.push(row.reference);
            }
        }
        references
    }

    /// Words that name it.
    pub(crate) fn title(&self) -> String {
        format!("{}, {}: {} against {}", self.subject.name(), self.case, self.error_unit, self.cost_unit)
    }
}
