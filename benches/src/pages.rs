//! Pages of Markdown whose figures programs have written: the commands in them, their tables, their parts.
//!
//! A command stands in a line of its own behind four spaces; nothing else on such a page does.

/// The commands, in their order.
#[must_use]
pub fn commands(page: &str) -> Vec<&str> {
    page.lines().filter_map(|line| line.strip_prefix("    ")).collect()
}

/// What stands below a heading (`## This`), down to the next one of any level; `None` if there is no such heading.
#[must_use]
pub fn below<'a>(page: &'a str, heading: &str) -> Option<&'a str> {
    let mut place = 0;
    let mut begin = None;
    for line in page.split_inclusive('\n') {
        if line.starts_with('#') {
            if let Some(begin) = begin {
                return page.get(begin..place);
            }
            if line.trim_end() == heading {
                begin = Some(place + line.len());
            }
        }
        place += line.len();
    }
    page.get(begin?..)
}

/// The first table below a heading: its two first lines, and the rows that are wanted. `None` if there is no such heading, no table, or no such row.
#[must_use]
pub fn table(page: &str, heading: &str, wanted: impl Fn(&str) -> bool) -> Option<String> {
    let mut lines = below(page, heading)?.lines().skip_while(|line| !line.starts_with('|')).take_while(|line| line.starts_with('|'));
    let head = [lines.next()?, lines.next()?];
    let rows: Vec<&str> = lines.filter(|row| wanted(row)).collect();
    if rows.is_empty() {
        return None;
    }
    Some(head.into_iter().chain(rows).flat_map(|line| [line, "\n"]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str = "# A page\n\nThis page is written by\n\n    cargo run\n\n| a | b |\n| --- | --- |\n| 1 | 2 |\n| 3 | 4 |\n\n## Below\n\nWords.\n\n    cohaptic run\n";

    #[test]
    fn a_page_is_taken_apart() {
        assert_eq!(commands(PAGE), ["cargo run", "cohaptic run"]);
        assert_eq!(below(PAGE, "## Below"), Some("\nWords.\n\n    cohaptic run\n"));
        assert!(below(PAGE, "# A page").is_some_and(|text| text.ends_with("| 3 | 4 |\n\n")));
        assert_eq!((below(PAGE, "## Else"), below(PAGE, "# A")), (None, None));
        assert_eq!(table(PAGE, "# A page", |_| true).as_deref(), Some("| a | b |\n| --- | --- |\n| 1 | 2 |\n| 3 | 4 |\n"));
        assert_eq!(table(PAGE, "# A page", |row| row.starts_with("| 3")).as_deref(), Some("| a | b |\n| --- | --- |\n| 3 | 4 |\n"));
        assert_eq!((table(PAGE, "# A page", |_| false), table(PAGE, "## Below", |_| true)), (None, None));
    }
}
