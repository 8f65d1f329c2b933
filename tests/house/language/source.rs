//! The comments and messages of a source file. Its tests are left out.

use super::markdown::{Block, Kind, blocks_of};

/// The texts of a source file.
pub(crate) struct Parts {
    /// Comments in lines that follow each other, as blocks.
    pub(crate) comments: Vec<Vec<Block>>,
    /// Literals with at least three words.
    pub(crate) messages: Vec<Block>,
}

/// Reads a source file up to its tests. A line `mod tests;` is no test: those stand in another file.
pub(crate) fn parts(text: &str) -> Parts {
    const TESTS: &str = "#[cfg(test)]\nmod ";
    let is_inline = |place: &usize| text[place + TESTS.len()..].lines().next().is_some_and(|line| line.ends_with('{'));
    let end = text.match_indices(TESTS).map(|(place, _)| place).find(is_inline).unwrap_or(text.len());
    Parts { comments: comments(&text[..end]), messages: messages(&text[..end]) }
}

/// The text of a comment that has its line alone, and which kind of comment it is.
fn comment(line: &str) -> Option<(usize, &str)> {
    let line = line.trim_start();
    let kinds = ["///", "//!", "//"];
    kinds.iter().enumerate().find_map(|(kind, mark)| Some((kind, line.strip_prefix(mark)?)))
}

fn comments(text: &str) -> Vec<Vec<Block>> {
    let mut found = Vec::new();
    let mut open: (usize, Vec<(usize, &str)>) = (0, Vec::new());
    for (index, line) in text.lines().chain([""]).enumerate() {
        let here = comment(line);
        if !open.1.is_empty() && here.is_none_or(|(kind, _)| kind != open.0) {
            found.push(blocks_of(std::mem::take(&mut open.1).into_iter()));
        }
        if let Some((kind, text)) = here {
            open.0 = kind;
            open.1.push((index + 1, text.strip_prefix(' ').unwrap_or(text)));
        }
    }
    found
}

fn messages(text: &str) -> Vec<Block> {
    let mut found = Vec::new();
    let mut rest = text;
    let mut line = 1;
    while let Some(letter) = rest.chars().next() {
        let length = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if letter == '"' {
            let end = end_of_literal(rest);
            found.extend(message(line, &rest[1..end - 1].replace("\\\"", "'")));
            end
        } else if let Some(end) = end_of_raw_literal(rest) {
            found.extend(message(line, rest[..end].trim_matches(['r', '#', '"'])));
            end
        } else if letter == '\'' {
            length_of_letter(rest)
        } else if letter.is_alphanumeric() {
            // A whole name, so that no `r` of a name begins a literal.
            rest.find(|letter: char| !letter.is_alphanumeric() && letter != '_').unwrap_or(rest.len())
        } else {
            letter.len_utf8()
        };
        line += rest[..length].matches('\n').count();
        rest = &rest[length..];
    }
    found
}

/// Behind the second quote of a literal that begins with the first.
fn end_of_literal(text: &str) -> usize {
    let mut is_escaped = false;
    for (place, letter) in text.char_indices().skip(1) {
        match letter {
            '"' if !is_escaped => return place + 1,
            '\\' => is_escaped = !is_escaped,
            _ => is_escaped = false,
        }
    }
    text.len()
}

/// Behind `r"…"` or `r#"…"#`, if the text begins with one.
fn end_of_raw_literal(text: &str) -> Option<usize> {
    let inner = text.strip_prefix('r')?;
    let open = inner.trim_start_matches('#');
    let close = format!("\"{}", "#".repeat(inner.len() - open.len()));
    let content = open.strip_prefix('"')?;
    Some(text.len() - content.len() + content.find(&close)? + close.len())
}

/// Of `'x'` or `'\''`; of a lifetime its mark alone.
fn length_of_letter(text: &str) -> usize {
    let inner = &text[1..];
    if inner.starts_with('\\') {
        return inner[2..].find('\'').map_or(1, |end| end + 4);
    }
    inner.chars().next().filter(|letter| inner[letter.len_utf8()..].starts_with('\'')).map_or(1, |letter| letter.len_utf8() + 2)
}

/// Literals with at least three words are texts for people.
fn message(line: usize, text: &str) -> Option<Block> {
    let is_read = text.split_whitespace().filter(|word| word.chars().any(char::is_alphabetic)).count() >= 3;
    let numbered = |(index, text): (usize, &str)| (line + index, text.trim().trim_end_matches('\\').replace("\\n", "  "));
    is_read.then(|| Block { kind: Kind::Message, lines: text.lines().enumerate().map(numbered).collect() })
}

#[test]
fn comments_and_messages_are_found_with_their_lines() {
    let source = "//! One\n//! two.\n#[cfg(test)]\nmod others;\nfn f<'a>(x: &'a str) { // aside\n    let quote = ['\"', '\\'', 'r'];\n    /// Three\n    say(\"a b \\\"c\\\" d\",\n r#\"e f\n g\"#, \"x y\");\n}\n#[cfg(test)]\nmod tests {\n    // not read\n}\n";
    let found = parts(source);
    let comments: Vec<(usize, String)> = found.comments.iter().flatten().map(|block| (block.lines[0].0, block.text())).collect();
    assert_eq!(comments, [(1, "One two.".to_owned()), (7, "Three".to_owned())]);
    let messages: Vec<(usize, String)> = found.messages.iter().map(|block| (block.lines[0].0, block.text())).collect();
    assert_eq!(messages, [(8, "a b 'c' d".to_owned()), (9, "e f g".to_owned())]);
}
