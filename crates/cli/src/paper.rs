//! `cohaptic paper`.

use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant as Clock;

use cohaptic_paper::{Options, PaperError, Reproduction, Watch, page, reproduce, steps};
use serde::Serialize;

use crate::arguments::PaperArguments;
use crate::document_schema::DocumentSchema;
use crate::failure::Failure;
use crate::file::write_file;
use crate::progress::Progress;
use crate::{interrupt, output};

#[derive(Serialize)]
struct PaperDocument<'a> {
    claims: Vec<Claim<'a>>,
    figures: Vec<Figure<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    wall_s: Option<f64>,
}

#[derive(Serialize)]
struct Claim<'a> {
    id: &'a str,
    claim: &'a str,
    paper: &'a str,
    ours: &'a str,
    verdict: String,
    scene: Option<&'a str>,
    how: Option<&'a str>,
}

#[derive(Serialize)]
struct Figure<'a> {
    id: &'a str,
    /// In the folder of `--out`; `null` without one.
    file: Option<String>,
    title: &'a str,
}

struct Bar(Progress);

impl Watch for Bar {
    fn one_more(&self) {
        self.0.one_more();
    }

    fn stops(&self) -> bool {
        interrupt::requested()
    }
}

/// Computes the paper again.
pub(crate) fn paper(arguments: &PaperArguments) -> Result<ExitCode, Failure> {
    let options = Options { quick: arguments.quick, size: arguments.pictures.size() };
    if let Some(folder) = &arguments.out {
        // A folder that cannot be had is found out before the work, not after it.
        std::fs::create_dir_all(folder).map_err(|error| Failure::File { verb: "create", path: folder.clone(), error })?;
    }
    let bar = Bar(Progress::through_steps(steps(options)));
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
    let document = document(&reproduction, arguments.out.is_some());
    output::answer(
        arguments.json,
        DocumentSchema::PAPER,
        &PaperDocument { wall_s: Some(wall_s), ..document },
        || describe(&reproduction),
        arguments.out.as_ref().map(|folder| folder.join("index.html")),
    )?;
    Ok(ExitCode::SUCCESS)
}

fn document(reproduction: &Reproduction, has_files: bool) -> PaperDocument<'_> {
    let claims = reproduction.claims.iter().map(|claim| Claim {
        id: claim.id,
        claim: claim.claim,
        paper: claim.paper,
        ours: &claim.ours,
        verdict: claim.verdict.to_string(),
        scene: claim.scene.as_deref(),
        how: claim.how.as_deref(),
    });
    let figures = reproduction.figures.iter().map(|figure| Figure {
        id: &figure.id,
        file: has_files.then(|| format!("{}.svg", figure.id)),
        title: &figure.title,
    });
    PaperDocument { claims: claims.collect(), figures: figures.collect(), wall_s: None }
}

fn write_files(folder: &Path, reproduction: &Reproduction) -> Result<(), Failure> {
    for figure in &reproduction.figures {
        write_file(&folder.join(format!("{}.svg", figure.id)), figure.svg.as_bytes())?;
        write_file(&folder.join(format!("{}.csv", figure.id)), figure.csv.as_bytes())?;
    }
    for claim in &reproduction.claims {
        if let Some(scene) = &claim.scene {
            write_file(&folder.join(format!("{}.toml", claim.id)), scene.as_bytes())?;
        }
    }
    // Without the time that it took: the same bytes every time.
    let mut claims = serde_json::to_vec_pretty(&DocumentSchema::PAPER.of(&document(reproduction, true))).unwrap_or_default();
    claims.push(b'\n');
    write_file(&folder.join("claims.json"), &claims)?;
    write_file(&folder.join("index.html"), page::html(reproduction).as_bytes())
}

/// How wide the text is.
const WIDTH: usize = 100;

fn describe(reproduction: &Reproduction) -> String {
    let mut text = String::new();
    for claim in &reproduction.claims {
        let _ = writeln!(text, "{}", claim.id);
        for (name, value) in [("claim", claim.claim), ("paper", claim.paper), ("ours", &claim.ours), ("verdict", &claim.verdict.to_string())] {
            wrap(&mut text, name, value);
        }
        text.push('\n');
    }
    text
}

/// A cell of the table, broken between words, beside its name.
fn wrap(text: &mut String, name: &str, value: &str) {
    let indent = 12;
    let _ = write!(text, "  {name:<width$}", width = indent - 2);
    let mut column = indent;
    for word in value.split_whitespace() {
        let length = word.chars().count();
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
