//! Tables as lines of text.

/// Returns rows as lines with aligned columns, two spaces apart. The first row has the names of the columns.
pub(crate) fn lines<const N: usize>(rows: &[[String; N]]) -> Vec<String> {
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: [usize; N] = core::array::from_fn(width);
    let line = |row: &[String; N]| {
        let cells: Vec<String> = row.iter().zip(widths).map(|(cell, width)| format!("{cell:width$}")).collect();
        cells.join("  ").trim_end().to_owned()
    };
    rows.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_as_wide_as_their_widest_cell() {
        let rows = [["a", "± b", "c"], ["long", "", "d"], ["x", "y", ""]].map(|row| row.map(str::to_owned));
        assert_eq!(lines(&rows), ["a     ± b  c", "long       d", "x     y"]);
        assert!(lines::<2>(&[]).is_empty());
    }
}
