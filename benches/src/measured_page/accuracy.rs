//! `cohaptic-accuracy`: its rows as tables of Markdown, and the plots that say most.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use cohaptic_accuracy::short;
use cohaptic_benches::effort::Effort;
use serde::Deserialize;

use crate::programs::{Measured, Programs};

/// The program that measures.
const PROGRAM: &str = "cohaptic-accuracy";
/// Folder of all files that the program writes.
const FOLDER: &str = "out/measured/accuracy";
/// Where the plots lie that the page shows, in `docs/`.
const IMAGES: &str = "images/measured";

/// A subject, a plot of it (as the file is called), and what it shows.
const PLOTS: [(&str, &str, &str); 12] = [
    ("motion", "motion-coupled-peers-position-m", "The error of a position against the time of a tick, of two peers who hold the object"),
    ("motion", "motion-one-sided-contact-position-m", "The same for contact that can push and not pull"),
    ("motion", "motion-stiff-coupling-critical-stiffness-n-m", "The error of the predicted stability boundary against the time of a tick"),
    ("time", "time-1-ms-ticks-clocks-0-37-ms-apart-mean-delay-s", "The error of the mean delay against the time of a packet: steps, and events"),
    ("time", "time-1-ms-ticks-clocks-0-37-ms-apart-wrong-verdicts-1", "The share of wrong verdicts on stability against the time of a packet"),
    ("network", "network-delay-normal-kolmogorov-distance-1", "The distance of a sampler from the normal law against the time of a draw"),
    ("network", "network-delay-gamma-99-9-quantile-of-its-distance-from-the-mean", "The error of the tail of a gamma law against the time of a draw"),
    (
        "network",
        "network-loss-gilbert-elliott-1-and-20-mean-run-of-losses-relative",
        "The error of the mean run of losses against the number of packets",
    ),
    (
        "analysis",
        "analysis-radius-just-stable-spectral-radius-1",
        "The error of the spectral radius against the time of a verdict, of a scene that is just stable",
    ),
    ("analysis", "analysis-boundary-of-kt-three-peers-at-24-ms-stiffness-n-m", "The error of a boundary against the time that it takes"),
    (
        "analysis",
        "analysis-probability-of-more-than-12-5-mm-apart-half-of-the-interval-of-95-1",
        "The interval of a probability against the time of the runs",
    ),
    ("real-time", "real-time-release-of-24-packets-under-way-lateness-99-s", "How late packets leave against processor time: sleeping and spinning"),
];

/// The document of `cohaptic-accuracy --json`.
#[derive(Debug, Deserialize)]
struct AccuracyDocument {
    rows: Vec<Row>,
    interrupted: bool,
}

#[derive(Debug, Deserialize)]
struct Row {
    subject: String,
    case: String,
    method: String,
    setting: String,
    cost: Option<f64>,
    cost_unit: String,
    error: Option<f64>,
    error_unit: String,
    reference: String,
    note: String,
}

/// The arguments of the program.
fn arguments(effort: Effort) -> String {
    format!("{}--json --out {FOLDER}", effort.of("", "--quick ", "--quick "))
}

/// The command that a reader can type.
pub(crate) fn command(effort: Effort) -> String {
    format!("cargo run --profile dist -p cohaptic-accuracy -- {}", arguments(effort))
}

pub(crate) fn measure(programs: &Programs) -> Result<Measured, String> {
    let printed = programs.beside(PROGRAM, &arguments(programs.effort))?;
    let document: AccuracyDocument =
        serde_json::from_str(&printed).map_err(|error| format!("what {PROGRAM} printed is no document of accuracy: {error}"))?;
    if document.interrupted {
        return Err(format!("{PROGRAM} was interrupted"));
    }
    let read = |(_, plot, _): &(&str, &str, &str)| {
        let path = Programs::root().join(FOLDER).join(format!("{plot}.svg"));
        let content = fs::read_to_string(&path).map_err(|error| format!("cannot read the plot {}: {error}", path.display()))?;
        Ok((Path::new(IMAGES).join(format!("{plot}.svg")), content))
    };
    let files = PLOTS.iter().map(read).collect::<Result<_, String>>()?;
    Ok(Measured { body: body(&document.rows), files })
}

/// The subjects, each with its plots and a table for each case.
fn body(rows: &[Row]) -> String {
    let mut text = String::new();
    for subject in distinct(rows.iter().map(|row| row.subject.as_str())) {
        let _ = writeln!(text, "### {}\n", capital(subject));
        for (_, plot, says) in PLOTS.iter().filter(|(of, _, _)| *of == subject) {
            let _ = writeln!(text, "![{says}]({IMAGES}/{plot}.svg)\n");
        }
        let rows: Vec<&Row> = rows.iter().filter(|row| row.subject == subject).collect();
        for (case, unit) in distinct(rows.iter().map(|row| (row.case.as_str(), row.cost_unit.as_str()))) {
            let rows: Vec<&Row> = rows.iter().filter(|row| row.case == case && row.cost_unit == unit).copied().collect();
            table(&mut text, case, unit, &rows);
        }
    }
    text
}

/// One case: a line for each method and setting that cost the same, a column for each kind of error.
fn table(text: &mut String, case: &str, cost_unit: &str, rows: &[&Row]) {
    let errors = distinct(rows.iter().map(|row| row.error_unit.as_str()));
    let against: Vec<String> = distinct(rows.iter().map(|row| (row.error_unit.as_str(), row.reference.as_str())))
        .into_iter()
        .map(|(unit, reference)| format!("{} against {}", cell(unit), cell(reference)))
        .collect();
    let titles: String = errors.iter().map(|unit| format!(" {} |", cell(unit))).collect();
    let _ = writeln!(text, "#### {}\n\nErrors: {}.\n", cell(case), against.join("; "));
    let _ = writeln!(text, "| method | setting | {} |{titles} |\n| --- | --- | ---: |{} --- |", cell(cost_unit), " ---: |".repeat(errors.len()));
    for (method, setting, cost) in distinct(rows.iter().map(|row| (&row.method, &row.setting, row.cost.map(f64::to_bits)))) {
        let its: Vec<&&Row> = rows.iter().filter(|row| (&row.method, &row.setting, row.cost.map(f64::to_bits)) == (method, setting, cost)).collect();
        let found = |unit: &&str| its.iter().find(|row| row.error_unit == **unit).map_or_else(String::new, |row| short(row.error));
        let values: String = errors.iter().map(|unit| format!(" {} |", found(unit))).collect();
        let notes: Vec<String> = distinct(its.iter().map(|row| row.note.as_str()).filter(|note| !note.is_empty())).into_iter().map(cell).collect();
        let _ = writeln!(text, "| {} | {} | {} |{values} {} |", cell(method), cell(setting), short(cost.map(f64::from_bits)), notes.join("; "));
    }
    text.push('\n');
}

/// Each once, in the order in which they came.
fn distinct<T: PartialEq>(items: impl Iterator<Item = T>) -> Vec<T> {
    let mut found = Vec::new();
    for item in items {
        if !found.contains(&item) {
            found.push(item);
        }
    }
    found
}

/// Text that means nothing to Markdown.
fn cell(text: &str) -> String {
    let mut cell = String::new();
    for letter in text.chars() {
        if matches!(letter, '|' | '[' | ']' | '*' | '_' | '<' | '`' | '\\') {
            cell.push('\\');
        }
        cell.push(letter);
    }
    cell
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(method: &str, cost: Option<f64>, error: Option<f64>, error_unit: &str, note: &str) -> Row {
        let [subject, case, setting, cost_unit, reference] = ["motion", "a | case", "2", "ns a tick", "a formula"].map(str::to_owned);
        Row {
            subject,
            case,
            method: method.to_owned(),
            setting,
            cost,
            cost_unit,
            error,
            error_unit: error_unit.to_owned(),
            reference,
            note: note.to_owned(),
        }
    }

    #[test]
    fn errors_of_one_measurement_stand_in_one_line() {
        let rows = [
            row("exact", Some(10.04), Some(1e-16), "position [m]", ""),
            row("Euler", Some(5.0), None, "position [m]", "diverged"),
            row("exact", Some(10.04), Some(0.0), "energy [J]", ""),
            row("Euler", Some(6.0), Some(2.5), "energy [J]", "diverged"),
        ];
        let text = body(&rows);
        assert!(text.starts_with("### Motion\n\n![The error of a position"), "{text}");
        assert_eq!(text.matches("![").count(), 3);
        let expected = "#### a \\| case\n\nErrors: position \\[m\\] against a formula; energy \\[J\\] against a formula.\n\n\
            | method | setting | ns a tick | position \\[m\\] | energy \\[J\\] | |\n| --- | --- | ---: | ---: | ---: | --- |\n\
            | exact | 2 | 10.0 | 1.00e-16 | 0 |  |\n| Euler | 2 | 5.00 | – |  | diverged |\n| Euler | 2 | 6.00 |  | 2.50 | diverged |\n\n";
        assert!(text.ends_with(expected), "{text}");
    }

    /// Every line of a table has the same number of cells, whatever is in it.
    #[test]
    fn no_text_breaks_a_table() {
        let text = body(&[row("a|b", None, Some(1.0), "x | y", "see [this] | `that`"), row("c", Some(1.0), Some(1.0), "z", "")]);
        let cells = |line: &str| line.replace("\\|", "").matches('|').count();
        let lines: Vec<&str> = text.lines().filter(|line| line.starts_with('|')).collect();
        assert_eq!(lines.len(), 4);
        assert!(lines.iter().all(|line| cells(line) == cells(lines[0])), "{text}");
    }

    #[test]
    fn a_document_is_read() {
        let text = r#"{"rows": [{"subject": "time", "case": "c", "method": "m", "setting": "", "cost": null, "cost_unit": "ns", "error": 0.5,
            "error_unit": "e", "reference": "r", "note": ""}], "interrupted": false, "wall_s": 1.0}"#;
        let document: AccuracyDocument = serde_json::from_str(text).unwrap();
        assert_eq!((document.rows.len(), document.interrupted, document.rows[0].cost), (1, false, None));
    }
}
