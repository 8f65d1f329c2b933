//! Run of all commands of a page, in order.

use std::fs;
use std::ops::Range;

use cohaptic_picture::testing::faults;

use crate::pages::blocks::{Block, Kind, Shown};
use crate::pages::compare::same;
use crate::pages::figures;
use crate::pages::folder::{Folder, Outcome};
use crate::pages::notes::{Notes, Vary};
use crate::pages::pictures::{Drawn, drawn};
use crate::pages::script::{commands, without_cargo};
use crate::pages::update::{replaced, shown_anew};
use crate::pages::{root, usage};

/// Names the variable that lets the pages be written.
pub(crate) const UPDATE: &str = "COHAPTIC_UPDATE_PAGES";

struct Page<'a> {
    name: &'a str,
    lines: Vec<&'a str>,
    folder: Folder,
    /// Asked for by [`UPDATE`].
    updates: bool,
    changes: Vec<(Range<usize>, Vec<String>)>,
    problems: Vec<String>,
    /// Output of the last session.
    printed: String,
}

/// Runs the commands of a page, named from the project's folder.
///
/// # Panics
///
/// With all that differs.
pub(crate) fn check(name: &str) {
    let path = root().join(name);
    let text = fs::read_to_string(&path).unwrap();
    let page = run(name, &text, std::env::var_os(UPDATE).is_some());
    if !page.changes.is_empty() {
        fs::write(&path, replaced(&text, &page.changes)).unwrap();
        eprintln!("{name}: {} outputs were written anew", page.changes.len());
    }
    assert!(page.problems.is_empty(), "{} (if the page is to show it: {UPDATE}=1)", page.problems.join("\n"));
}

fn run<'a>(name: &'a str, text: &'a str, updates: bool) -> Page<'a> {
    let lines = text.lines().collect();
    let mut page = Page { name, lines, folder: Folder::new(), updates, changes: Vec::new(), problems: Vec::new(), printed: String::new() };
    let blocks = Block::all(name, text);
    // A file that is shown only behind the commands that take it is there for them; of two with one name that is the first.
    for block in blocks.iter().rev().filter(|block| matches!(block.kind, Kind::File(_))) {
        page.block(block);
    }
    for block in &blocks {
        page.block(block);
    }
    for picture in drawn(name, text) {
        page.picture(&picture);
    }
    page
}

impl Page<'_> {
    fn problem(&mut self, line: usize, what: &str) {
        self.problems.push(format!("{}:{}: {what}", self.name, line + 1));
    }

    fn block(&mut self, block: &Block) {
        let (line, notes) = (block.lines.start, &block.notes);
        match &block.kind {
            Kind::File(content) => self.folder.write(notes.file.as_deref().unwrap_or("unnamed"), content),
            Kind::Figures(text) => {
                let missing = figures::missing(text, &self.printed);
                if !missing.is_empty() {
                    self.problem(line, &format!("the commands above do not print {}", missing.join(", ")));
                }
            }
            Kind::Option(code) => {
                if let Err(what) = usage::of_some_command(code) {
                    self.problem(line, &what);
                }
            }
            Kind::Mention(command) => self.look_up(line, command),
            Kind::Script(script) => {
                let script = without_cargo(script);
                self.look_up(line, &script);
                if self.is_run(line, &script, notes) {
                    let outcome = self.folder.run(&with_less_work(&script, notes), notes.run_with.as_deref().unwrap_or_default());
                    self.statuses(line, &script, &outcome, notes.statuses.as_deref(), &notes.vary);
                }
            }
            Kind::Session(all) => {
                let whole: String = all.iter().map(|shown| format!("{}\n", without_cargo(&shown.command))).collect();
                self.look_up(line, &whole);
                if self.is_run(line, &whole, notes) {
                    self.session(all, notes);
                }
            }
        }
    }

    fn session(&mut self, all: &[Shown], notes: &Notes) {
        let mut statuses = notes.statuses.as_deref();
        self.printed.clear();
        for shown in all {
            let line = shown.output.start - 1;
            let script = with_less_work(&without_cargo(&shown.command), notes);
            let outcome = self.folder.run(&script, notes.run_with.as_deref().unwrap_or_default());
            let own = statuses.map(|statuses| statuses.split_at(outcome.statuses.len().min(statuses.len())));
            self.statuses(line, &script, &outcome, own.map(|(own, _)| own), &notes.vary);
            statuses = own.map(|(_, rest)| rest);
            self.output(shown, &outcome, notes);
            self.printed.push_str(&outcome.printed);
        }
        if statuses.is_some_and(|rest| !rest.is_empty()) {
            self.problem(all[0].output.start, "more exit statuses than commands");
        }
    }

    fn output(&mut self, shown: &Shown, outcome: &Outcome, notes: &Notes) {
        let wanted: Vec<&str> = self.lines[shown.output.clone()].to_vec();
        let printed: Vec<&str> = outcome.printed.lines().collect();
        if same(&wanted, &printed, &notes.vary) {
            return;
        }
        if self.updates {
            self.changes.push((shown.output.clone(), shown_anew(&wanted, &printed, &notes.vary)));
        } else {
            let what = format!("`{}` prints\n{}\nand the page shows\n{}\n", shown.command, outcome.printed, wanted.join("\n"));
            self.problem(shown.output.start - 1, &what);
        }
    }

    /// Compares a picture with what the commands have drawn.
    fn picture(&mut self, picture: &Drawn) {
        let Some(anew) = self.folder.read(&picture.by_commands) else {
            self.problem(picture.line, &format!("the commands do not write {}", picture.by_commands));
            return;
        };
        for fault in faults(&anew) {
            self.problem(picture.line, &fault);
        }
        let shown = root().join(&picture.shown);
        if fs::read_to_string(&shown).unwrap_or_default() == anew {
            return;
        }
        if self.updates {
            fs::write(&shown, anew).unwrap();
            eprintln!("{}: {} was drawn anew", self.name, picture.shown.display());
        } else {
            self.problem(picture.line, &format!("{} is another picture than {}", picture.shown.display(), picture.by_commands));
        }
    }

    /// Each with status 0, unless the page says otherwise.
    fn statuses(&mut self, line: usize, script: &str, outcome: &Outcome, wanted: Option<&[i32]>, vary: &Vary) {
        let zeros = vec![0; outcome.statuses.len()];
        let wanted = wanted.unwrap_or(&zeros);
        let last = wanted.last().copied().unwrap_or(0);
        let is_wanted = if vary.statuses { outcome.statuses.iter().all(|status| [0, 1].contains(status)) } else { outcome.statuses == wanted };
        if !is_wanted || ![Some(0), Some(last)].contains(&outcome.status) {
            let what =
                format!("expected exit status {wanted:?}, got {:?}, of all {:?}:\n{script}\n{}", outcome.statuses, outcome.status, outcome.printed);
            self.problem(line, &what);
        }
    }

    fn is_run(&mut self, line: usize, script: &str, notes: &Notes) -> bool {
        if let Some((_, of)) = notes.instead.iter().find(|(_, of)| !script.contains(of)) {
            self.problem(line, &format!("a comment says what to run for `{of}`, which is not there"));
            return false;
        }
        if notes.not_run.is_some() || commands(script).iter().any(|words| words[0] == "cargo") {
            return false;
        }
        if let Some(program) = notes.needs.as_deref().filter(|program| !self.folder.has(program)) {
            eprintln!("{}:{}: not run here, for want of `{program}`", self.name, line + 1);
            return false;
        }
        true
    }

    fn look_up(&mut self, line: usize, script: &str) {
        for words in commands(script) {
            let found = match words[0].as_str() {
                "cohaptic" => usage::of_cohaptic(&words),
                "cargo" => usage::of_cargo(&words),
                _ => Ok(()),
            };
            if let Err(what) = found {
                self.problem(line, &what);
            }
        }
    }
}

/// The script with what the page says is run in place of something.
fn with_less_work(script: &str, notes: &Notes) -> String {
    notes.instead.iter().fold(script.to_owned(), |script, (run, of)| script.replace(of, run))
}

/// A page with an output, each kind of fault beside a right one.
const PAGE: &str = "<!-- run: scenarios; for: SCENES -->
```text
$ cohaptic check SCENES/network/ideal.toml
ok    scenarios/network/ideal.toml
1 passed, 0 failed
$ cohaptic check scenarios/network/ideal.toml
ok    scenarios/network/real.toml
…
```

```sh
cohaptic check scenarios/network/ideal.toml --set expect.stable=false
```

<!-- not run: a test -->
```sh
cohaptic check scenarios/network/ideal.toml --faster
```

<!-- run
$ echo 0.8309
0.8309
-->
<!-- figures printed above -->
Here 0.83, there 0.84: `cohaptic check --json`.
";

#[test]
fn each_difference_is_a_problem_and_nothing_else_is() {
    let page = run("a page", PAGE, false);
    let begins: Vec<&str> = page.problems.iter().map(|problem| problem.lines().next().unwrap()).collect();
    let wanted = [
        "a page:6: `cohaptic check scenarios/network/ideal.toml` prints",
        "a page:12: expected exit status [0], got [1], of all Some(1):",
        "a page:17: `cohaptic check` has no option `--faster`: cohaptic check scenarios/network/ideal.toml --faster",
        "a page:25: the commands above do not print 0.84",
    ];
    assert_eq!(begins, wanted, "{}", page.problems.join("\n"));
    assert!(page.changes.is_empty());
}

#[test]
fn an_update_writes_what_is_printed_and_nothing_else() {
    let page = run("a page", PAGE, true);
    assert_eq!(page.problems.len(), 3, "{:#?}", page.problems);
    assert_eq!(replaced(PAGE, &page.changes), PAGE.replace("network/real.toml", "network/ideal.toml"));
}
