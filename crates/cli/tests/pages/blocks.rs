//! The parts of a page that concern commands: scripts, sessions, files, and mentions within sentences.

use std::ops::Range;

use crate::pages::notes::Notes;

/// A part of a page.
#[derive(Debug)]
pub(crate) struct Block {
    /// Lines of the content on the page, counted from 0, without fences.
    pub(crate) lines: Range<usize>,
    pub(crate) kind: Kind,
    pub(crate) notes: Notes,
}

/// Kind of a part of a page.
#[derive(Debug)]
pub(crate) enum Kind {
    /// Lines for `sh`.
    Script(String),
    /// Commands with their outputs.
    Session(Vec<Shown>),
    /// A file with this content.
    File(String),
    /// `cohaptic …` within a sentence, or as a line of usage.
    Mention(String),
    /// `--option …` alone within a sentence or a table, an option of any command.
    Option(String),
    /// Sentences, or a table, whose figures the commands before have printed.
    Figures(String),
}

/// A command of a session.
#[derive(Debug)]
pub(crate) struct Shown {
    pub(crate) command: String,
    /// Lines of the page that show the output.
    pub(crate) output: Range<usize>,
}

/// Beginnings of indented blocks that are scripts. Other indented blocks are formulas.
const PROGRAMS: [&str; 4] = ["cohaptic ", "cargo ", "benches/", "cd "];

impl Block {
    /// Returns all parts of a page, in order.
    ///
    /// # Panics
    ///
    /// If a comment or a fence is not closed, or a comment is none of ours though it begins like one.
    pub(crate) fn all(page: &str, text: &str) -> Vec<Self> {
        let lines: Vec<&str> = text.lines().collect();
        let mut reader = Reader { page, lines: &lines, notes: Notes::default(), blocks: Vec::new() };
        let mut at = 0;
        while at < lines.len() {
            at = reader.part(at);
        }
        reader.blocks
    }

    pub(crate) fn has_commands(&self) -> bool {
        matches!(self.kind, Kind::Script(_) | Kind::Session(_) | Kind::Mention(_))
    }
}

struct Reader<'a> {
    page: &'a str,
    lines: &'a [&'a str],
    /// Of comments since the last block.
    notes: Notes,
    blocks: Vec<Block>,
}

impl Reader<'_> {
    /// Reads what begins at this line, and says where the next part begins.
    fn part(&mut self, at: usize) -> usize {
        let line = self.lines[at];
        if line.starts_with("<!--") {
            return self.comment(at);
        }
        if let Some(language) = line.trim_start().strip_prefix("```") {
            let end = self.until(at + 1, |line| line.trim() == "```");
            self.fenced(language.trim(), at + 1..end);
            return end + 1;
        }
        let after_blank = at == 0 || self.lines[at - 1].trim().is_empty();
        if after_blank && line.strip_prefix("    ").is_some_and(|line| PROGRAMS.iter().any(|program| line.starts_with(program))) {
            let end = (at..self.lines.len()).find(|&next| !self.lines[next].starts_with("    ")).unwrap_or(self.lines.len());
            let script = self.lines[at..end].iter().map(|line| format!("{}\n", &line[4..])).collect();
            self.push(at..end, Kind::Script(script));
            return end;
        }
        if line.trim().is_empty() {
            return at + 1;
        }
        let special = |line: &str| line.trim().is_empty() || line.starts_with("<!--") || line.trim_start().starts_with("```");
        let end = (at + 1..self.lines.len()).find(|&next| special(self.lines[next])).unwrap_or(self.lines.len());
        self.sentences(at..end);
        end
    }

    fn until(&self, from: usize, ends: impl Fn(&str) -> bool) -> usize {
        (from..self.lines.len()).find(|&line| ends(self.lines[line])).unwrap_or_else(|| panic!("{}:{from}: it does not end", self.page))
    }

    fn push(&mut self, lines: Range<usize>, kind: Kind) {
        let notes = std::mem::take(&mut self.notes);
        self.blocks.push(Block { lines, kind, notes });
    }

    fn comment(&mut self, at: usize) -> usize {
        let end = self.until(at, |line| line.trim_end().ends_with("-->"));
        if end == at {
            let inside = self.lines[at].trim_end().trim_start_matches("<!--").trim_end_matches("-->").trim();
            self.notes.read(inside).unwrap_or_else(|error| panic!("{}:{}: {inside}: {error}", self.page, at + 1));
            return at + 1;
        }
        let head = self.lines[at].trim_start_matches("<!--").trim();
        let last = self.lines[end].trim_end().trim_end_matches("-->");
        assert!(last.trim().is_empty(), "{}:{}: `-->` stands on a line of its own", self.page, end + 1);
        if head == "run" {
            self.session(at + 1..end);
        } else if let Some(name) = head.strip_prefix("file:") {
            self.notes.file = Some(name.trim().to_owned());
            self.file(at + 1..end);
        }
        end + 1
    }

    fn fenced(&mut self, language: &str, lines: Range<usize>) {
        if self.notes.file.is_some() {
            self.file(lines);
        } else if self.lines[lines.clone()].iter().any(|line| line.starts_with("$ ")) {
            self.session(lines);
        } else if ["sh", "bash", "console"].contains(&language) {
            let script = self.lines[lines.clone()].iter().map(|line| format!("{line}\n")).collect();
            self.push(lines, Kind::Script(script));
        } else {
            self.notes = Notes::default();
            if language == "text" {
                for at in lines {
                    if self.lines[at].starts_with("cohaptic ") {
                        self.push(at..at + 1, Kind::Mention(self.lines[at].to_owned()));
                    }
                }
            }
        }
    }

    fn file(&mut self, lines: Range<usize>) {
        let content = self.lines[lines.clone()].iter().map(|line| format!("{line}\n")).collect();
        self.push(lines, Kind::File(content));
    }

    fn session(&mut self, lines: Range<usize>) {
        let mut all: Vec<Shown> = Vec::new();
        let mut at = lines.start;
        while at < lines.end {
            let Some(first) = self.lines[at].strip_prefix("$ ") else {
                let shown = all.last_mut().unwrap_or_else(|| panic!("{}:{}: expected a command after `$ `", self.page, at + 1));
                at += 1;
                shown.output.end = at;
                continue;
            };
            let mut command = first.to_owned();
            at += 1;
            while command.ends_with('\\') && at < lines.end {
                command.push('\n');
                command.push_str(self.lines[at]);
                at += 1;
            }
            all.push(Shown { command, output: at..at });
        }
        self.push(lines, Kind::Session(all));
    }

    /// Code within sentences that begins with the program's name or is an option. It may go over the end of a line.
    fn sentences(&mut self, lines: Range<usize>) {
        let text = self.lines[lines.clone()].join(" ");
        let notes = std::mem::take(&mut self.notes);
        if notes.printed {
            self.blocks.push(Block { lines: lines.clone(), kind: Kind::Figures(text.clone()), notes });
        }
        for (number, code) in text.split('`').enumerate() {
            let kind = match code {
                _ if number % 2 == 0 => continue,
                code if code.starts_with("cohaptic ") => Kind::Mention(code.replace("\\|", "|")),
                code if code.starts_with("--") => Kind::Option(code.to_owned()),
                _ => continue,
            };
            self.blocks.push(Block { lines: lines.clone(), kind, notes: Notes::default() });
        }
    }
}

#[test]
fn a_page_is_scripts_sessions_files_and_mentions() {
    let page = "Say `cohaptic\ncheck x` so:\n\n<!-- file: a.toml -->\n```toml\nx = 1\n```\n\n    cohaptic run a.toml\n\n    N = 3\n\n\
                <!-- exit status: 1 -->\n\n```text\n$ cohaptic check \\\n    a.toml\nno\n$ cohaptic run a.toml\n```\n\n<!-- run\n$ cohaptic link\nyes\n-->\n";
    let blocks = Block::all("a page", page);
    let [mention, file, script, session, hidden] = &blocks[..] else { panic!("{blocks:#?}") };
    assert!(matches!(&mention.kind, Kind::Mention(text) if text == "cohaptic check x"));
    assert!(matches!(&file.kind, Kind::File(text) if text == "x = 1\n") && file.notes.file.as_deref() == Some("a.toml"));
    assert!(matches!(&script.kind, Kind::Script(text) if text == "cohaptic run a.toml\n"));
    let Kind::Session(shown) = &session.kind else { panic!("{session:?}") };
    assert_eq!((shown[0].command.as_str(), shown[0].output.len(), shown[1].output.len()), ("cohaptic check \\\n    a.toml", 1, 0));
    assert_eq!(session.notes.statuses, Some(vec![1]));
    assert!(matches!(&hidden.kind, Kind::Session(shown) if shown[0].output == (23..24)), "{hidden:?}");
}
