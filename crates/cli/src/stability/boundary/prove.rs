//! `cohaptic stability boundary --prove`: divides the range into stretches with a proven verdict and undecided stretches. Every crossing lies in an undecided
//! stretch.

use std::fmt::Write as _;
use std::process::ExitCode;

use cohaptic_answers::page::{AnswerPage, MOST_ROWS, more_rows, range};
use cohaptic_picture::page::{Html, Table};
use cohaptic_proofs::{Guarantee, ProofError, ProvenLine, ProvenStretch, SharedProof, TopologyCertificate};
use cohaptic_stability::BoundaryError;
use cohaptic_units::print::{Counted, SixDigits, csv_field};
use serde::Serialize;

use super::{Order, files};
use crate::arguments::BoundaryArguments;
use crate::document_schema::{DocumentSchema, document};
use crate::failure::Failure;
use crate::file::write_into;
use crate::output::{self, figure};
use crate::shard::{self, Sharing};
use crate::stability::certificate::{self, Given};
use crate::stability::guarantee::{self, PieceWatch};
use crate::stability::proof_blocks::{self, Pieces, Proofs};
use crate::stability::rows_file::Kept;

/// Name of the files of rows with the decided pieces of shards.
const ROWS: &str = "proof.rows";

/// Proves the line and writes the answer, or does the part of a shard.
pub(super) fn prove(order: &Order, arguments: &BoundaryArguments, sharing: Sharing<'_>) -> Result<ExitCode, Failure> {
    let (families, tolerance) = (std::slice::from_ref(&order.family), order.options.tolerance);
    let shared = SharedProof::of_line(&order.family, tolerance).map_err(|error| failure(order, arguments, error))?;
    // A scene without a certificate is refused before the proof, which may take long.
    if arguments.certificate {
        TopologyCertificate::of(&order.family).map_err(|error| failure(order, arguments, error))?;
    }
    // The rows of a proof are pieces, not values: the first and the last line of a search's header are replaced. The tolerance is added, because the pieces
    // depend on the tolerance.
    let mut header = order.header.clone();
    header[0] = format!("cohaptic {} stability boundary --prove: pieces looked at; the same command goes on from here", env!("CARGO_PKG_VERSION"));
    header.pop();
    header.extend([format!("to {tolerance:?}"), proof_blocks::ROW.to_owned()]);
    let proofs = sharing.folder().map(|folder| Proofs { families, shared: &shared, kept: Kept { folder, name: ROWS, header: &header }, threads: 0 });
    match (sharing, proofs) {
        (Sharing::Shard(shard, _), Some(proofs)) => {
            return shard::answer(arguments.scene.json, &proofs.shard(shard, |_, error| failure(order, arguments, error))?);
        }
        (Sharing::Status(folder), Some(proofs)) => {
            let pieces = proofs.pieces()?;
            let is_merged = files::with_origin(order, arguments, &[], |origin| shard::has_result(folder, &pieces, "proof.html", origin));
            return shard::show(arguments.scene.json, folder, proof_blocks::NAMES, &pieces, is_merged);
        }
        (Sharing::Merge(_) | Sharing::Whole(_), _) | (_, None) => {}
    }
    let (_own, rows) = proofs.map_or(Ok((None, Vec::new())), |proofs| proofs.rows(sharing))?;
    let known = Pieces::of(0, &rows, None);
    let line = ProvenLine::prove_with(&order.family, tolerance, &known, &PieceWatch::new()).map_err(|error| failure(order, arguments, error))?;
    let (mut files, mut uncertified) = (Vec::new(), None);
    if let Some(folder) = sharing.folder() {
        files.push(write_into(folder, "proof.csv", table(order, &line))?);
        if arguments.certificate && line.is_whole {
            let pieces = line.certify(&order.family, &PieceWatch::new()).map_err(|error| failure(order, arguments, error))?;
            uncertified = Some(line.uncertified(&pieces));
            let topology = TopologyCertificate::of(&order.family).map_err(|error| failure(order, arguments, error))?;
            let given = Given { title: &order.title, text: &order.text, overrides: &arguments.scene.overrides.set };
            files.push(write_into(folder, "certificate.json", certificate::of_boxes(&given, &[&order.range], None, topology.as_ref(), &pieces)?)?);
        }
        files.push(write_into(folder, "proof.html", page(order, arguments, &line, uncertified))?);
        if line.is_whole {
            proof_blocks::remove(folder, ROWS)?;
        }
    }
    output::answer(
        arguments.scene.json,
        DocumentSchema::STABILITY_LINE,
        &answer(order, &line, uncertified, &files),
        || describe(order, &line, uncertified),
        &files,
    )?;
    if line.is_whole { Ok(ExitCode::SUCCESS) } else { Err(guarantee::ended()) }
}

fn failure(order: &Order, arguments: &BoundaryArguments, error: ProofError) -> Failure {
    let of_family = |error| super::failure(arguments, &order.range, BoundaryError::Radius(error));
    guarantee::failure(error, "--prove", &arguments.scene.scene, of_family)
}

/// Returns the answer of `cohaptic stability boundary --prove --json`. `uncertified`: number of stretches with a verdict but without a certificate.
fn answer(order: &Order, line: &ProvenLine, uncertified: Option<usize>, files: &[String]) -> impl Serialize {
    let stretches = line.stretches.iter().map(|stretch| document! { low: stretch.low, high: stretch.high, verdict: stretch.guarantee.word() });
    document! {
        title: order.title.as_str(),
        key: order.range.key.as_str(),
        unit: order.range.unit.as_str(),
        low: order.range.low,
        high: order.range.high,
        // Every crossing lies in an undecided stretch.
        stretches: stretches.collect::<Vec<_>>(),
        tolerance: order.options.tolerance,
        certificates: line.attempts,
        // Whether the proof was interrupted before all stretches were checked.
        interrupted: !line.is_whole,
        // Number of pieces with a verdict for which the certificate has no proof; absent without a certificate.
        #[serde(flatten)]
        certificate: uncertified.map(|uncertified| document! { uncertified: uncertified }),
        files: files,
    }
}

fn describe(order: &Order, line: &ProvenLine, uncertified: Option<usize>) -> String {
    let range = &order.range;
    let mut text = format!("{}\n\n", order.title);
    for (words, ProvenStretch { low, high, .. }) in named(line) {
        // Writing to a string does not fail.
        let _ = writeln!(text, "  {:<10} from {} to {}", words, range.text(*low), range.text(*high));
    }
    let _ = writeln!(text, "  {}", looked_at(line));
    if let Some(note) = uncertified.and_then(guarantee::left_open) {
        let _ = writeln!(text, "    note: {note}");
    }
    text
}

/// Returns the number of pieces that the proof looked at, in words.
fn looked_at(line: &ProvenLine) -> String {
    format!("{} looked at; nothing crosses anywhere else", Counted(line.attempts, "piece"))
}

/// Words before an undecided stretch between different verdicts.
const CROSSING: &str = "crossing:";

/// Returns each stretch of a proven line after its verdict in words.
fn named(line: &ProvenLine) -> impl Iterator<Item = (&'static str, &ProvenStretch)> {
    line.stretches.iter().enumerate().map(|(place, stretch)| {
        let beside = |other: Option<usize>| other.and_then(|other| line.stretches.get(other)).map(|stretch| stretch.guarantee);
        let between = [beside(place.checked_sub(1)), beside(Some(place + 1))];
        // An undecided stretch between different verdicts holds at least one crossing.
        let words = match (stretch.guarantee, between) {
            (Guarantee::Undecided, [Some(before), Some(after)]) if before != after => CROSSING,
            (Guarantee::Undecided, _) => "undecided:",
            (Guarantee::Stable | Guarantee::Unstable, _) => stretch.guarantee.word(),
        };
        (words, stretch)
    })
}

/// Returns the page of the proof.
fn page(order: &Order, arguments: &BoundaryArguments, line: &ProvenLine, uncertified: Option<usize>) -> String {
    let head = Table::new().column("verdict").column("from").column("to");
    let stretches = named(line).take(MOST_ROWS).fold(head, |table, (words, ProvenStretch { low, high, .. })| {
        let verdict = words.trim_end_matches(':').to_owned();
        table.row([verdict, order.range.text(*low), order.range.text(*high)].map(Html::from))
    });
    let of = |guarantee: Guarantee| line.stretches.iter().filter(move |stretch| stretch.guarantee == guarantee);
    let share = |guarantee: Guarantee| {
        let length: f64 = of(guarantee).map(|stretch| stretch.high - stretch.low).sum();
        format!("{} %", figure(100.0 * length / (order.range.high - order.range.low), 4))
    };
    let [stable, unstable, undecided] = [Guarantee::Stable, Guarantee::Unstable, Guarantee::Undecided].map(share);
    let crossings = named(line).filter(|(words, _)| *words == CROSSING).count();
    let page = AnswerPage {
        title: format!("{}: proven stability along {}", order.title, order.range.key),
        warnings: if line.is_whole { Vec::new() } else { vec![guarantee::UNFINISHED.to_owned()] },
        sentences: vec![
            format!(
                "proven stable {stable} of the range, proven unstable {unstable}, undecided {undecided}; {} enclosed",
                Counted(crossings, "crossing")
            ),
            looked_at(line),
        ],
        asked: vec![
            ("Along", range(&order.range)),
            ("Tolerance of a crossing", format!("{}{}", SixDigits(order.options.tolerance), order.range.unit).into()),
        ],
        tables: Html::heading(2, "Stretches").and(Html::table(&stretches)).and(more_rows(line.stretches.len() as u64, "stretches", "proof.csv")),
        notes: uncertified.and_then(guarantee::left_open).into_iter().collect(),
    };
    files::with_origin(order, arguments, &[], |origin| page.html(origin))
}

/// Returns the CSV table of the stretches, one row per stretch.
fn table(order: &Order, line: &ProvenLine) -> String {
    let key = csv_field(&order.range.key);
    let mut text = format!("{key} from,{key} to,verdict\n");
    for ProvenStretch { low, high, guarantee } in &line.stretches {
        let _ = writeln!(text, "{low:?},{high:?},{}", guarantee.word());
    }
    text
}
