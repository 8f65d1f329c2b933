//! Texts of a study on a page: headings, paragraphs and lists of Markdown. All other marks stand on the page as written, so that no text can add markup.

use serde::Serialize;

/// A block of a text.
#[derive(Clone, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub(super) enum Block {
    Heading {
        /// 1 for the largest, 6 for the smallest.
        level: usize,
        text: String,
    },
    Paragraph {
        text: String,
    },
    List {
        ordered: bool,
        items: Vec<String>,
    },
}

/// Reads the blocks of a text. Lines up to an empty line are one paragraph, `#` begins a heading, and `-`, `*` or a number with a point begins an item.
pub(super) fn blocks(text: &str) -> Vec<Block> {
    let mut blocks = Vec::new();
    // `true` if the next line without a mark goes on with the last block.
    let mut goes_on = false;
    for line in text.lines().map(str::trim) {
        if line.is_empty() {
            goes_on = false;
        } else if let Some((level, heading)) = heading(line) {
            blocks.push(Block::Heading { level, text: heading.to_owned() });
            goes_on = false;
        } else if let Some((is_ordered, item)) = item(line) {
            match blocks.last_mut() {
                Some(Block::List { ordered, items }) if *ordered == is_ordered => items.push(item.to_owned()),
                _ => blocks.push(Block::List { ordered: is_ordered, items: vec![item.to_owned()] }),
            }
            goes_on = true;
        } else {
            match blocks.last_mut().filter(|_| goes_on) {
                Some(Block::Paragraph { text }) => add(text, line),
                Some(Block::List { items, .. }) => items.last_mut().into_iter().for_each(|item| add(item, line)),
                Some(Block::Heading { .. }) | None => blocks.push(Block::Paragraph { text: line.to_owned() }),
            }
            goes_on = true;
        }
    }
    blocks
}

fn add(text: &mut String, line: &str) {
    text.push(' ');
    text.push_str(line);
}

/// Returns level and text of a heading.
fn heading(line: &str) -> Option<(usize, &str)> {
    let text = line.trim_start_matches('#');
    let level = line.len() - text.len();
    ((1..=6).contains(&level) && text.starts_with(' ')).then(|| (level, text.trim()))
}

/// Returns the text of an item, and whether the item has a number.
fn item(line: &str) -> Option<(bool, &str)> {
    if let Some(text) = line.strip_prefix("- ").or_else(|| line.strip_prefix("* ")) {
        return Some((false, text.trim()));
    }
    let text = line.trim_start_matches(|c: char| c.is_ascii_digit());
    (text.len() < line.len()).then(|| text.strip_prefix(". ")).flatten().map(|text| (true, text.trim()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_paragraphs_and_lists_are_read_and_nothing_else_has_a_meaning() {
        let text = "# What you do\n\nYou hold\nan *object* <b>together</b>.\n\n- first\n  goes on\n* second\n1. one\n2. two\n\nThe end\n## Then\nmore\n#hash\n-minus";
        let paragraph = |text: &str| Block::Paragraph { text: text.to_owned() };
        let heading = |level, text: &str| Block::Heading { level, text: text.to_owned() };
        let list = |ordered, items: [&str; 2]| Block::List { ordered, items: items.map(str::to_owned).to_vec() };
        let expected = [
            heading(1, "What you do"),
            paragraph("You hold an *object* <b>together</b>."),
            list(false, ["first goes on", "second"]),
            list(true, ["one", "two"]),
            paragraph("The end"),
            heading(2, "Then"),
            paragraph("more #hash -minus"),
        ];
        assert_eq!(blocks(text), expected);
        assert!(blocks(" \n\n").is_empty());
        assert_eq!(serde_json::to_string(&blocks("x")).unwrap(), r#"[{"kind":"paragraph","text":"x"}]"#);
    }
}
