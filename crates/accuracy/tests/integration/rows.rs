use cohaptic_accuracy::Row;

/// Asserts the promises of every row of the measured subjects.
pub(crate) fn assert_sound(rows: &[Row]) {
    assert!(!rows.is_empty());
    for row in rows {
        assert!(row.cost.is_some_and(|cost| cost > 0.0 && cost.is_finite()), "{row:?}");
        assert!(row.error.is_some_and(|error| error >= 0.0 && error.is_finite()), "{row:?}");
        assert!(!row.cost_unit.is_empty() && !row.error_unit.is_empty() && !row.reference.is_empty() && !row.note.is_empty(), "{row:?}");
    }
    for (place, row) in rows.iter().enumerate() {
        let same =
            |other: &&Row| (&other.case, &other.method, &other.setting, other.error_unit) == (&row.case, &row.method, &row.setting, row.error_unit);
        assert_eq!(rows[place..].iter().filter(same).count(), 1, "one row for each method at each setting: {row:?}");
    }
}
