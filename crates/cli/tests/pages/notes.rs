//! Instructions for the tests, in comments before a block of a page.

/// See the table of the [test's own page](crate).
#[derive(Debug, Default, Clone)]
pub(crate) struct Notes {
    pub(crate) file: Option<String>,
    pub(crate) not_run: Option<String>,
    pub(crate) run_with: Option<String>,
    /// Command that is run, and the shown command that it replaces.
    pub(crate) instead: Vec<(String, String)>,
    pub(crate) needs: Option<String>,
    pub(crate) statuses: Option<Vec<i32>>,
    pub(crate) vary: Vary,
    /// `true` if the commands before must have printed every figure with a decimal point.
    pub(crate) printed: bool,
}

/// Parts of an output that are not compared.
#[derive(Debug, Default, Clone)]
pub(crate) struct Vary {
    /// Texts of lines whose figures are not compared. An empty text is in every line.
    pub(crate) figures: Vec<String>,
    /// Texts of lines of which only the text is compared.
    pub(crate) lines: Vec<String>,
    /// `true` if each exit status may be 0 or 1.
    pub(crate) statuses: bool,
}

impl Vary {
    /// Returns whether figures of this line are not compared.
    pub(crate) fn figures_of(&self, line: &str) -> bool {
        self.figures.iter().any(|text| line.contains(text))
    }

    /// Returns whether both lines have the same text of [`Vary::lines`], so that the rest is not compared.
    pub(crate) fn leaves_alone(&self, one: &str, other: &str) -> bool {
        self.lines.iter().any(|text| one.contains(text) && other.contains(text))
    }
}

fn list(texts: &str) -> Vec<String> {
    texts.split(';').map(|text| text.trim().to_owned()).collect()
}

impl Notes {
    /// Takes in the inside of a comment of one line; `false` if it says nothing about a block, as any comment may.
    ///
    /// `Err` for a comment that begins like one of ours and is none.
    pub(crate) fn read(&mut self, comment: &str) -> Result<bool, String> {
        let (key, value) = comment.split_once(':').map_or((comment, None), |(key, value)| (key, Some(value.trim().to_owned())));
        match (key.trim(), value) {
            ("file", Some(name)) => self.file = Some(name),
            ("not run", Some(reason)) if !reason.is_empty() => self.not_run = Some(reason),
            ("run with", Some(options)) => self.run_with = Some(options),
            ("run", Some(change)) => {
                let (run, of) = change.split_once("; for:").ok_or("expected `run: TEXT; for: TEXT`")?;
                self.instead.push((run.trim().to_owned(), of.trim().to_owned()));
            }
            ("needs", Some(program)) => self.needs = Some(program),
            ("exit status", Some(list)) => {
                let read: Result<Vec<i32>, _> = list.split_whitespace().map(str::parse).collect();
                self.statuses = Some(read.map_err(|error| format!("exit status: {error}"))?);
            }
            ("exit status varies", None) => self.vary.statuses = true,
            ("figures printed above", None) => self.printed = true,
            ("figures vary", None) => self.vary.figures = vec![String::new()],
            ("figures vary", Some(texts)) => self.vary.figures = list(&texts),
            ("lines vary", Some(texts)) => self.vary.lines = list(&texts),
            ("not run" | "needs" | "exit status", _) => return Err("a reason, a program or numbers are missing".to_owned()),
            _ => return Ok(false),
        }
        Ok(true)
    }
}

#[test]
fn comments_of_one_line_say_how_a_block_is_run() {
    let mut notes = Notes::default();
    for comment in
        ["not run: needs a Falcon", "exit status: 0 1", "exit status varies", "figures vary: a second; real time", "run: --runs 3; for: --runs 1000"]
    {
        assert_eq!(notes.read(comment), Ok(true), "{comment}");
    }
    assert_eq!((notes.not_run.as_deref(), notes.statuses.as_deref()), (Some("needs a Falcon"), Some(&[0, 1][..])));
    assert!(notes.vary.statuses);
    assert!(notes.vary.figures_of("1493 a second") && !notes.vary.figures_of("radius 0.5"));
    assert_eq!(notes.instead, [("--runs 3".to_owned(), "--runs 1000".to_owned())]);
    notes.read("lines vary: the run is").unwrap();
    assert!(notes.vary.leaves_alone("the run is valid", "the run is not") && !notes.vary.leaves_alone("the run is valid", "granted"));
    assert_eq!(Notes::default().read("a remark"), Ok(false));
    assert!(Notes::default().read("not run:").is_err() && Notes::default().read("run: --quick").is_err());
}
