//! `cohaptic paper`: reproduces the claims and figures of a paper.

use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant as Clock;

use cohaptic_paper::{Options, PaperError, Reproduction, Table, Watch, page, reproduce, steps};
use serde::Serialize;

use crate::arguments::PaperArguments;
use crate::document_schema::{DocumentSchema, document};
use crate::failure::Failure;
use crate::file::{own_folder, write_file};
use crate::progress::Progress;
use crate::{interrupt, output};

struct Bar(Progress);

impl Watch for Bar {
    fn one_more(&self) {
        self.0.one_more();
    }

    fn stops(&self) -> bool {
        interrupt::requested()
    }
}

/// Computes the claims and figures of the paper and compares them with the printed values.
pub(crate) fn paper(arguments: &PaperArguments) -> Result<ExitCode, Failure> {
    let options = Options { quick: arguments.quick, size: arguments.pictures.size() };
    // The folder is taken before the long computation, so that a refused folder costs no time.
    let _own = arguments.out.as_deref().map(own_folder).transpose()?;
    let bar = Bar(Progress::new(steps(options) as u64, "{bar:30} {percent:>3} %  {elapsed} passed, {eta} left"));
    let start = Clock::now();
    let reproduction = match reproduce(options, &bar) {
        Ok(reproduction) => reproduction,
        Err(PaperError::Stopped) => {
            bar.0.clear();
            return Err(Failure::Interrupted("the paper is not reproduced: figures and claims are computed together, and none are kept".to_owned()));
        }
        Err(error) => return Err(Failure::Input(error.to_string())),
    };
    let wall_s = start.elapsed().as_secs_f64();
    bar.0.clear();
    if let Some(folder) = &arguments.out {
        write_files(folder, &reproduction)?;
    }
    output::answer(
        arguments.json,
        DocumentSchema::PAPER,
        &document(&reproduction, arguments.out.is_some(), Some(wall_s)),
        || describe(&reproduction),
        arguments.out.as_ref().map(|folder| folder.join("index.html")),
    )?;
    Ok(ExitCode::SUCCESS)
}

fn document(reproduction: &Reproduction, has_files: bool, wall_s: Option<f64>) -> impl Serialize {
    let claims = reproduction.claims.iter().map(|claim| {
        document! {
            id: claim.id,
            claim: claim.claim,
            paper: claim.paper,
            says: claim.says,
            ours: claim.ours.as_str(),
            tables: claim.tables.iter().map(table).collect::<Vec<_>>(),
            verdict: claim.verdict.to_string(),
            why: claim.why,
            scene: claim.scene.as_str(),
            how: claim.how.as_str(),
            commands: claim.commands.as_str(),
        }
    });
    let figures = reproduction.figures.iter().map(|figure| {
        // The file lies in the folder of `--out`; `null` without one.
        document! { id: figure.id.as_str(), file: has_files.then(|| format!("{}.svg", figure.id)), title: figure.title.as_str() }
    });
    document! {
        claims: claims.collect::<Vec<_>>(),
        figures: figures.collect::<Vec<_>>(),
        #[serde(flatten)]
        wall: wall_s.map(|wall_s| document! { wall_s: wall_s }),
    }
}

fn table(table: &Table) -> impl Serialize + use<> {
    document! {
        title: table.title.clone(),
        groups: table.groups.iter().map(|(name, columns)| document! { name: name.clone(), columns: *columns }).collect::<Vec<_>>(),
        head: table.head.clone(),
        rows: table.rows.clone(),
    }
}

fn write_files(folder: &Path, reproduction: &Reproduction) -> Result<(), Failure> {
    for figure in &reproduction.figures {
        write_file(&folder.join(format!("{}.svg", figure.id)), figure.svg.as_bytes())?;
        write_file(&folder.join(format!("{}.csv", figure.id)), figure.csv.as_bytes())?;
    }
    for claim in &reproduction.claims {
        write_file(&folder.join(format!("{}.toml", claim.id)), claim.scene.as_bytes())?;
    }
    // The document leaves out the wall time, so that every reproduction writes the same bytes.
    let mut claims = serde_json::to_vec_pretty(&DocumentSchema::PAPER.of(&document(reproduction, true, None))).unwrap_or_default();
    claims.push(b'\n');
    write_file(&folder.join("claims.json"), &claims)?;
    write_file(&folder.join("index.html"), page::html(reproduction).as_bytes())
}

/// Width of the text \[characters\].
const WIDTH: usize = 100;

fn describe(reproduction: &Reproduction) -> String {
    let mut text = String::new();
    for claim in &reproduction.claims {
        let _ = writeln!(text, "{}", claim.id);
        let paper = format!("{} ({})", claim.says, claim.paper);
        for (name, value) in [("claim", claim.claim), ("paper", &paper), ("ours", &claim.ours), ("verdict", &claim.verdict.to_string())] {
            wrap(&mut text, name, value);
        }
        claim.tables.iter().for_each(|table| draw(&mut text, table));
        text.push('\n');
    }
    text
}

/// Appends a table to `text`, with columns as wide as their cells.
fn draw(text: &mut String, table: &Table) {
    // A group spans several columns. The name stands in each of these columns, because the text has no wide cells.
    let groups: Vec<String> = table.groups.iter().flat_map(|(name, columns)| std::iter::repeat_n(name.clone(), *columns)).collect();
    let rows = [&groups, &table.head].into_iter().filter(|row| !row.is_empty()).chain(&table.rows);
    let width = |place: usize| rows.clone().filter_map(|row| row.get(place)).map(|cell| cell.chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..table.head.len()).map(width).collect();
    let _ = writeln!(text, "\n    {}", table.title);
    for row in rows.clone() {
        // Padding counts characters. A last column without text leaves no spaces at the end of the line.
        let line = row.iter().zip(&widths).fold(String::new(), |line, (cell, width)| format!("{line}  {cell:>width$}"));
        let _ = writeln!(text, "    {}", line.trim_end());
    }
}

/// Appends a name and a value to `text`. The value is broken between words at [`WIDTH`] and indented.
fn wrap(text: &mut String, name: &str, value: &str) {
    let indent = 12;
    let _ = write!(text, "  {name:<width$}", width = indent - 2);
    let mut column = indent;
    for word in value.split_whitespace() {
        let length = word.chars().count();
        // No break comes before the first word of a line: a word longer than the line fits no better on the next line.
        if column > indent && column + 1 + length > WIDTH {
            let _ = write!(text, "\n{:indent$}", "");
            column = indent;
        } else if column > indent {
            text.push(' ');
            column += 1;
        }
        text.push_str(word);
        column += length;
    }
    text.push('\n');
}
