//! Markdown as blocks of text: paragraphs, headings and cells. Code is left out.

/// What a block is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Kind {
    /// A paragraph or an entry of a list.
    Prose,
    Heading,
    Cell,
    /// The text of a message.
    Message,
}

/// A block of text, with the lines of its file.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    pub(crate) kind: Kind,
    /// Each line of the block, with its number in the file, counted from one.
    pub(crate) lines: Vec<(usize, String)>,
}

impl Block {
    /// The text with a space for each end of a line.
    pub(crate) fn text(&self) -> String {
        self.lines.iter().map(|(_, line)| line.as_str()).collect::<Vec<_>>().join(" ")
    }

    /// The line of the file at a place in [`Block::text`].
    pub(crate) fn line_at(&self, place: usize) -> usize {
        let mut left = place;
        for (number, line) in &self.lines {
            if left <= line.len() {
                return *number;
            }
            left -= line.len() + 1;
        }
        self.lines.last().map_or(0, |(number, _)| *number)
    }
}

/// The blocks of a page.
pub(crate) fn blocks(text: &str) -> Vec<Block> {
    blocks_of(text.lines().enumerate().map(|(index, line)| (index + 1, line)))
}

/// The blocks of numbered lines.
pub(crate) fn blocks_of<'a>(lines: impl Iterator<Item = (usize, &'a str)>) -> Vec<Block> {
    let mut reader = Reader::default();
    for (number, line) in lines {
        reader.line(number, line);
    }
    reader.end_block();
    reader.found.into_iter().map(without_marks).filter(|block| !block.text().trim().is_empty()).collect()
}

#[derive(Default)]
struct Reader {
    found: Vec<Block>,
    open: Vec<(usize, String)>,
    in_fence: bool,
    in_comment: bool,
    in_list: bool,
    after_blank: bool,
}

impl Reader {
    fn end_block(&mut self) {
        if !self.open.is_empty() {
            self.found.push(Block { kind: Kind::Prose, lines: std::mem::take(&mut self.open) });
        }
    }

    fn line(&mut self, number: usize, line: &str) {
        let inner = line.trim_start();
        let indent = line.len() - inner.len();
        let after_blank = std::mem::replace(&mut self.after_blank, inner.is_empty());
        if self.in_comment || (inner.starts_with("<!--") && !self.in_fence) {
            self.in_comment = !inner.contains("-->");
            return self.end_block();
        }
        if inner.starts_with("```") || inner.starts_with("~~~") {
            self.in_fence = !self.in_fence;
            return self.end_block();
        }
        if self.in_fence {
            return;
        }
        let is_code = self.open.is_empty() && after_blank && indent >= if self.in_list { 6 } else { 4 };
        if inner.is_empty() || is_code || inner.starts_with('<') || is_definition(inner) {
            self.after_blank = inner.is_empty() || is_code;
            return self.end_block();
        }
        if inner.starts_with('#') {
            self.end_block();
            self.in_list = false;
            self.found.push(Block { kind: Kind::Heading, lines: vec![(number, inner.trim_start_matches('#').trim().to_owned())] });
        } else if inner.starts_with('|') {
            self.end_block();
            for cell in inner.replace("\\|", "/").split('|').map(str::trim).filter(|cell| cell.contains(char::is_alphabetic)) {
                self.found.push(Block { kind: Kind::Cell, lines: vec![(number, cell.to_owned())] });
            }
        } else if let Some(entry) = entry(inner) {
            self.end_block();
            self.in_list = true;
            self.open.push((number, entry.to_owned()));
        } else {
            if self.open.is_empty() && indent == 0 {
                self.in_list = false;
            }
            self.open.push((number, inner.trim_start_matches("> ").trim_end().to_owned()));
        }
    }
}

/// The text of an entry of a list.
fn entry(line: &str) -> Option<&str> {
    let rest = line.trim_start_matches(|letter: char| letter.is_ascii_digit());
    if rest.len() < line.len() { rest.strip_prefix(". ") } else { line.strip_prefix("- ").or_else(|| line.strip_prefix("* ")) }
}

/// `[name]: address`
fn is_definition(line: &str) -> bool {
    line.starts_with('[') && line.split_once("]: ").is_some_and(|(name, address)| !name.contains(']') && !address.contains(' '))
}

/// Code becomes `CODE`, and a link its text. The number of lines stays.
fn without_marks(mut block: Block) -> Block {
    let mut in_code = false;
    let mut in_address = false;
    for (_, line) in &mut block.lines {
        let mut plain = String::new();
        let mut letters = line.chars().peekable();
        while let Some(letter) = letters.next() {
            match letter {
                '`' => {
                    while letters.next_if_eq(&'`').is_some() {}
                    if !in_code {
                        plain.push_str("CODE");
                    }
                    in_code = !in_code;
                }
                _ if in_code => {}
                ']' if letters.next_if_eq(&'(').is_some() => in_address = true,
                ')' if in_address => in_address = false,
                _ if in_address => {}
                '[' | ']' | '*' | '\\' => {}
                '!' if letters.peek() == Some(&'[') => {}
                letter => plain.push(letter),
            }
        }
        *line = plain;
    }
    block
}

#[test]
fn code_is_left_out_and_lines_are_kept() {
    let page = "# A title\n\nOne `x\ny` two [three](a.md)\nfour.\n\n    code what is\n\n- an entry\n  goes on\n- another\n\n```sh\nso many\n```\n| a cell | `b` c |\n|---|---|\n<!-- not\nread -->\nEnd";
    let found: Vec<(Kind, usize, String)> = blocks(page).iter().map(|block| (block.kind, block.lines[0].0, block.text())).collect();
    let expected = [
        (Kind::Heading, 1, "A title"),
        (Kind::Prose, 3, "One CODE  two three four."),
        (Kind::Prose, 9, "an entry goes on"),
        (Kind::Prose, 11, "another"),
        (Kind::Cell, 16, "a cell"),
        (Kind::Cell, 16, "CODE c"),
        (Kind::Prose, 20, "End"),
    ];
    assert_eq!(found, expected.map(|(kind, line, text)| (kind, line, text.to_owned())));
    let paragraph = &blocks(page)[1];
    assert_eq!([0, 8, 12, paragraph.text().find("four").unwrap()].map(|place| paragraph.line_at(place)), [3, 3, 4, 5]);
}
