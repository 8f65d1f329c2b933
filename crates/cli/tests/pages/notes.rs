//! What comments before a block say about it.

/// See the table of the [test's own page](crate).
#[derive(Debug, Default, Clone)]
pub(crate) struct Notes {
    pub(crate) file: Option<String>,
    pub(crate) not_run: Option<String>,
    pub(crate) run_with: Option<String>,
    /// What is run, and in place of what.
    pub(crate) instead: Vec<(String, String)>,
    pub(crate) needs: Option<String>,
    pub(crate) statuses: Option<Vec<i32>>,
    pub(crate) vary: Vary,
    /// Every figure with a decimal point is one that the commands before have printed.
    pub(crate) printed: bool,
}

/// In which lines figures are not compared.
#[derive(Debug, Default, Clone, PartialEq, Eq)]
pub(crate) enum Vary {
    #[default]
    Nowhere,
    Everywhere,
    /// In lines that have one of these texts.
    Where(Vec<String>),
}

impl Vary {
    pub(crate) fn holds(&self, line: &str) -> bool {
        match self {
            Self::Nowhere => false,
            Self::Everywhere => true,
            Self::Where(texts) => texts.iter().any(|text| line.contains(text)),
        }
    }
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
            ("figures printed above", None) => self.printed = true,
            ("figures vary", None) => self.vary = Vary::Everywhere,
            ("figures vary", Some(texts)) => self.vary = Vary::Where(texts.split(';').map(|text| text.trim().to_owned()).collect()),
            ("not run" | "needs" | "exit status", _) => return Err("a reason, a program or numbers are missing".to_owned()),
            _ => return Ok(false),
        }
        Ok(true)
    }
}

#[test]
fn comments_of_one_line_say_how_a_block_is_run() {
    let mut notes = Notes::default();
    for comment in ["not run: needs a Falcon", "exit status: 0 1", "figures vary: a second; real time", "run: --runs 3; for: --runs 1000"] {
        assert_eq!(notes.read(comment), Ok(true), "{comment}");
    }
    assert_eq!((notes.not_run.as_deref(), notes.statuses), (Some("needs a Falcon"), Some(vec![0, 1])));
    assert!(notes.vary.holds("1493 a second") && !notes.vary.holds("radius 0.5"));
    assert_eq!(notes.instead, [("--runs 3".to_owned(), "--runs 1000".to_owned())]);
    assert_eq!(Notes::default().read("a remark"), Ok(false));
    assert!(Notes::default().read("not run:").is_err() && Notes::default().read("run: --quick").is_err());
}
