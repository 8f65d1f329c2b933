//! Parts of a page outside of code: links, pictures and anchors.

/// Link or picture of a page.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Link {
    /// Target as written, without a title.
    pub(crate) target: String,
    pub(crate) is_picture: bool,
}

/// Returns the lines of a page without fenced blocks and comments.
fn lines_of_text(text: &str) -> Vec<&str> {
    let (mut fence, mut in_comment, mut kept) = (None::<&str>, false, Vec::new());
    for line in text.lines() {
        let trimmed = line.trim_start();
        if let Some(closing) = fence {
            fence = (!trimmed.starts_with(closing)).then_some(closing);
        } else if in_comment || trimmed.starts_with("<!--") {
            in_comment = !line.contains("-->");
        } else if let Some(opening) = ["````", "```", "~~~"].into_iter().find(|opening| trimmed.starts_with(opening)) {
            fence = Some(opening);
        } else {
            kept.push(line);
        }
    }
    kept
}

/// Without what stands between backticks. A run of backticks ends where as many follow again, in the same paragraph.
fn without_code(paragraph: &str) -> String {
    let (mut rest, mut kept) = (paragraph, String::new());
    while let Some(begin) = rest.find('`') {
        let (before, code) = rest.split_at(begin);
        kept.push_str(before);
        let run = code.len() - code.trim_start_matches('`').len();
        let inside = &code[run..];
        let end = inside.match_indices(&code[..run]).map(|(at, _)| at).find(|&at| {
            let is_longer = inside[..at].ends_with('`') || inside[at + run..].starts_with('`');
            !is_longer
        });
        rest = end.map_or(inside, |at| &inside[at + run..]);
    }
    kept + rest
}

/// All links and pictures, also those of definitions (`[name]: target`), in the order of the page.
pub(crate) fn links(text: &str) -> Vec<Link> {
    let lines = lines_of_text(text);
    let mut found = Vec::new();
    for paragraph in lines.split(|line| line.trim().is_empty()) {
        let prose = without_code(&paragraph.join("\n"));
        for (at, _) in prose.match_indices("](") {
            let Some((target, _)) = prose[at + 2..].split_once(')') else { continue };
            // The bracket that opens the text of this link, past those of a picture within it.
            let mut depth = 0;
            let opening = prose[..at].char_indices().rev().find(|&(_, letter)| match letter {
                ']' => {
                    depth += 1;
                    false
                }
                '[' if depth > 0 => {
                    depth -= 1;
                    false
                }
                letter => letter == '[',
            });
            let is_picture = opening.is_some_and(|(begin, _)| prose[..begin].ends_with('!'));
            found.push(Link { target: first_word(target), is_picture });
        }
    }
    for line in lines {
        if let Some((_, target)) = line.strip_prefix('[').and_then(|rest| rest.split_once("]: ")) {
            found.push(Link { target: first_word(target), is_picture: false });
        }
    }
    found
}

fn first_word(target: &str) -> String {
    target.split_whitespace().next().unwrap_or_default().trim_matches(['<', '>']).to_owned()
}

/// Returns the anchors of a page: its headings, as forges and mdbook name them, and `<a id="…">`.
pub(crate) fn anchors(text: &str) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    for line in lines_of_text(text) {
        let level = line.len() - line.trim_start_matches('#').len();
        if (1..=6).contains(&level) && line[level..].starts_with(' ') {
            let name = slug(&line[level..]);
            let before = found.iter().filter(|other| **other == name || is_numbered(other, &name)).count();
            found.push(if before == 0 { name } else { format!("{name}-{before}") });
        }
        for rest in line.split("<a id=\"").skip(1) {
            found.extend(rest.split_once('"').map(|(name, _)| name.to_owned()));
        }
    }
    found
}

/// Returns whether an anchor is that of a later heading of this name: `name-1`.
fn is_numbered(other: &str, name: &str) -> bool {
    other.strip_prefix(name).and_then(|end| end.strip_prefix('-')).is_some_and(|end| end.parse::<u32>().is_ok())
}

/// Letters, digits, `-` and `_` of a heading in small letters, and `-` for each space. Of a link its text counts.
fn slug(heading: &str) -> String {
    let mut text = String::new();
    let mut rest = heading.trim();
    while let Some((before, after)) = rest.split_once("](") {
        text.push_str(before);
        rest = after.split_once(')').map_or("", |(_, rest)| rest);
    }
    text.push_str(rest);
    let kept = text.chars().filter(|letter| letter.is_alphanumeric() || [' ', '-', '_'].contains(letter));
    kept.flat_map(char::to_lowercase).map(|letter| if letter == ' ' { '-' } else { letter }).collect()
}

#[test]
fn links_are_those_outside_of_code_and_comments() {
    let page = "[a](b.md#c) and `[no](x)` and [`d`](e/f.rs \"title\"),\n![g](h.svg) [![i](j.svg)](k.md) ``[no](`x`)``\n\n\
                ```text\n[no](y)\n```\n<!-- [no](z) -->\n<!-- run\n[no](z)\n-->\n[`l`]: ../m.rs\n";
    let found: Vec<(String, bool)> = links(page).into_iter().map(|link| (link.target, link.is_picture)).collect();
    let wanted = [("b.md#c", false), ("e/f.rs", false), ("h.svg", true), ("j.svg", true), ("k.md", false), ("../m.rs", false)];
    assert_eq!(found, wanted.map(|(target, is_picture)| (target.to_owned(), is_picture)));
}

#[test]
fn anchors_are_those_of_forges() {
    let page = "# The book\n\n## Files of --out\n\n```sh\n# no heading\n```\n### `[link]` and [λ](x.md), B_T\n## Again\n## Again\n| <a id=\"k-t\"></a>**K_T** |\n";
    assert_eq!(anchors(page), ["the-book", "files-of---out", "link-and-λ-b_t", "again", "again-1", "k-t"]);
}
