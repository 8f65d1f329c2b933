//! `cohaptic stability map --prove`: divides the plane of two keys into boxes, and proves a verdict for all scenes of a box at once.

use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant as Clock;

use cohaptic_answers::axis_of;
use cohaptic_picture::{Fill, Panel, Picture, Region};
use cohaptic_proofs::{Guarantee, ProofError, ProvenBox, ProvenRegion, SharedProof, TopologyCertificate};
use cohaptic_units::print::{Counted, csv_field};
use serde::Serialize;

use super::{Order, files, filling};
use crate::arguments::MapArguments;
use crate::document_schema::{DocumentSchema, document};
use crate::failure::Failure;
use crate::file::write_into;
use crate::output::{self, figure};
use crate::shard::{self, Sharing};
use crate::stability::certificate::{self, Given};
use crate::stability::guarantee::{self, PieceWatch};
use crate::stability::proof_blocks::{self, Pieces, Proofs, on_threads};
use crate::stability::rows_file::Kept;

/// A variant with its proof.
pub(super) struct Proof {
    pub(super) name: String,
    overrides: Vec<String>,
    pub(super) region: ProvenRegion,
    file: Option<String>,
    /// Number of boxes with a verdict but without a proof in the certificate; `None` without a certificate.
    uncertified: Option<usize>,
}

/// Verdicts, in the order of the shares of an answer.
pub(super) const GUARANTEES: [Guarantee; 3] = [Guarantee::Stable, Guarantee::Unstable, Guarantee::Undecided];

/// Name of the files of rows with the decided pieces of shards.
const ROWS: &str = "proof.rows";

/// Proves the region of each variant and writes the answer, or does the part of a shard.
pub(super) fn prove(order: &Order, arguments: &MapArguments, halvings: u32, sharing: Sharing<'_>) -> Result<ExitCode, Failure> {
    let start = Clock::now();
    let shared = SharedProof::of_region(&order.families[0], halvings, arguments.every_number).map_err(|error| failure(order, arguments, 0, error))?;
    // A variant without a certificate is refused before the proof, which may take long.
    if arguments.certificate {
        for (variant, family) in order.families.iter().enumerate() {
            TopologyCertificate::of(family).map_err(|error| failure(order, arguments, variant, error))?;
        }
    }
    let threads = usize::from(arguments.threads.unwrap_or(0));
    let numbers =
        arguments.every_number.map(|(from, to)| format!(", for every number from {from}{}", to.map_or_else(String::new, |to| format!(" to {to}"))));
    let size = format!("halved {halvings} times{}", numbers.unwrap_or_default());
    let header = filling::header(order, arguments, ["stability map --prove: pieces looked at", &size, proof_blocks::ROW])?;
    let proofs = sharing.folder().map(|folder| Proofs {
        families: &order.families,
        shared: &shared,
        kept: Kept { folder, name: ROWS, header: &header },
        threads,
    });
    match (sharing, proofs) {
        (Sharing::Shard(shard, _), Some(proofs)) => {
            let done = proofs.shard(shard, |variant, error| failure(order, arguments, variant, error))?;
            return shard::answer(arguments.scene.json, &done);
        }
        (Sharing::Status(folder), Some(proofs)) => {
            let pieces = proofs.pieces()?;
            let is_merged = files::has_result(folder, &pieces, "proof.html", order, arguments);
            return shard::show(arguments.scene.json, folder, proof_blocks::NAMES, &pieces, is_merged);
        }
        (Sharing::Merge(_) | Sharing::Whole(_), _) | (_, None) => {}
    }
    let (_own, rows) = proofs.map_or(Ok((None, Vec::new())), |proofs| proofs.rows(sharing))?;
    let watch = PieceWatch::new();
    let prove = |(number, family)| ProvenRegion::prove_with(family, halvings, arguments.every_number, &Pieces::of(number, &rows, None), &watch);
    let regions = on_threads(threads, || order.families.iter().enumerate().map(prove).collect::<Vec<_>>());
    drop(watch);
    let mut proofs = Vec::new();
    for (variant, region) in order.variants.iter().zip(regions) {
        let region = region.map_err(|error| failure(order, arguments, proofs.len(), error))?;
        proofs.push(Proof { name: variant.name.clone(), overrides: variant.overrides.clone(), region, file: None, uncertified: None });
    }
    let mut files = Vec::new();
    if let Some(folder) = sharing.folder() {
        for (number, proof) in proofs.iter_mut().enumerate() {
            let name = if number == 0 { "proof.csv".to_owned() } else { format!("proof-{}.csv", number + 1) };
            let path = write_into(folder, &name, table(order, &proof.region))?;
            proof.file = Some(path.clone());
            files.push(path);
        }
        let pictures = pictures(order, &proofs, arguments);
        for (name, svg) in &pictures {
            files.push(write_into(folder, name, svg)?);
        }
        if arguments.certificate && proofs.iter().all(|proof| proof.region.is_whole) {
            files.extend(certificates(order, arguments, &mut proofs, folder)?);
        }
        // The page comes after the certificates, because the page says how many boxes the certificates leave open.
        files.push(write_into(folder, "proof.html", files::proof_page(order, arguments, &proofs, &pictures))?);
        if proofs.iter().all(|proof| proof.region.is_whole) {
            proof_blocks::remove(folder, ROWS)?;
        }
    }
    let wall_s = start.elapsed().as_secs_f64();
    output::answer(
        arguments.scene.json,
        DocumentSchema::STABILITY_REGION,
        &answer(order, arguments, &proofs, wall_s, &files),
        || describe(order, arguments, &proofs, wall_s),
        &files,
    )?;
    if proofs.iter().all(|proof| proof.region.is_whole) { Ok(ExitCode::SUCCESS) } else { Err(guarantee::ended()) }
}

/// Writes a certificate for each variant, and returns the paths of the files.
fn certificates(order: &Order, arguments: &MapArguments, proofs: &mut [Proof], folder: &Path) -> Result<Vec<String>, Failure> {
    let mut files = Vec::new();
    let watch = PieceWatch::new();
    for (number, (proof, family)) in proofs.iter_mut().zip(&order.families).enumerate() {
        let boxes = proof.region.certify(family, &watch).map_err(|error| failure(order, arguments, number, error))?;
        proof.uncertified = Some(proof.region.uncertified(&boxes));
        let overrides = order.variants[number].on_top_of(&arguments.scene.overrides.set);
        let topology = TopologyCertificate::of(family).map_err(|error| failure(order, arguments, number, error))?;
        let given = Given { title: &order.title, text: &order.text, overrides: &overrides };
        let name = if number == 0 { "certificate.json".to_owned() } else { format!("certificate-{}.json", number + 1) };
        let keys = [order.x(), order.y()];
        files.push(write_into(folder, &name, certificate::of_boxes(&given, &keys, arguments.every_number, topology.as_ref(), &boxes)?)?);
    }
    Ok(files)
}

fn failure(order: &Order, arguments: &MapArguments, variant: usize, error: ProofError) -> Failure {
    guarantee::failure(error, "--prove", &arguments.scene.scene, |error| order.failure(variant, arguments, error.into()))
}

/// Returns the answer of `cohaptic stability map --prove --json`.
fn answer(order: &Order, arguments: &MapArguments, proofs: &[Proof], wall_s: f64, files: &[String]) -> impl Serialize {
    let (x, y) = (order.x(), order.y());
    let regions = proofs.iter().map(|proof| {
        let [stable, unstable, undecided] = GUARANTEES.map(|guarantee| proof.region.share(guarantee));
        document! {
            name: proof.name.as_str(),
            overrides: proof.overrides.as_slice(),
            // Shares of the area of the plane, from 0 to 1.
            stable: stable,
            unstable: unstable,
            undecided: undecided,
            // Numbers of boxes at a single delay. These boxes have no area, so that the shares leave them out.
            lines: document! {
                stable: proof.region.lines(Guarantee::Stable),
                unstable: proof.region.lines(Guarantee::Unstable),
                undecided: proof.region.lines(Guarantee::Undecided),
            },
            boxes: proof.region.boxes.len(),
            certificates: proof.region.attempts,
            // Whether the proof was interrupted before all boxes were checked.
            interrupted: !proof.region.is_whole,
            // Share of the area that is proven stable for this variant and unstable for the first, and the share with the verdicts exchanged.
            stable_alone: both(&proof.region, Guarantee::Stable, &proofs[0].region, Guarantee::Unstable),
            unstable_alone: both(&proof.region, Guarantee::Unstable, &proofs[0].region, Guarantee::Stable),
            #[serde(flatten)]
            file: proof.file.as_ref().map(|file| document! { file: file.as_str() }),
            // Number of boxes with a verdict but without a proof in the certificate; absent without a certificate.
            #[serde(flatten)]
            certificate: proof.uncertified.map(|uncertified| document! { uncertified: uncertified }),
        }
    });
    document! {
        title: order.title.as_str(),
        x_key: x.key.as_str(),
        x_unit: x.unit.as_str(),
        x_range: [x.low, x.high],
        y_key: y.key.as_str(),
        y_unit: y.unit.as_str(),
        y_range: [y.low, y.high],
        // Largest number of halvings of each range.
        halvings: arguments.prove,
        // Numbers of equal peers for which the verdicts hold, with `null` for no end. Absent if the verdicts hold for the scene's number.
        #[serde(flatten)]
        every: arguments.every_number.map(|(from, to)| document! { every_number: document! { from: from, to: to } }),
        regions: regions.collect::<Vec<_>>(),
        wall_s: wall_s,
        files: files,
    }
}

fn describe(order: &Order, arguments: &MapArguments, proofs: &[Proof], wall_s: f64) -> String {
    let lines: String = lines(arguments, proofs).iter().map(|line| format!("  {line}\n")).collect();
    format!("{}\n\n{lines}  {wall_s:.1} s\n", order.title)
}

/// Returns the lines about the proofs. Further lines about the same proof are indented.
pub(super) fn lines(arguments: &MapArguments, proofs: &[Proof]) -> Vec<String> {
    let percent = |share: f64| format!("{} %", figure(100.0 * share, 4));
    let mut lines = Vec::new();
    if let Some((from, to)) = arguments.every_number {
        let end = to.map_or_else(|| " on".to_owned(), |to| format!(" to {to}"));
        lines.push(format!("for every number of equal peers from {from}{end}:"));
    }
    for (number, proof) in proofs.iter().enumerate() {
        let [stable, unstable, undecided] = GUARANTEES.map(|guarantee| percent(proof.region.share(guarantee)));
        let name = if proofs.len() > 1 { format!("{}: ", proof.name) } else { String::new() };
        let pieces = Counted(proof.region.boxes.len(), "piece");
        lines.push(format!("{name}proven stable {stable} of the area, proven unstable {unstable}, undecided {undecided} ({pieces})"));
        let [stable, unstable, undecided] = GUARANTEES.map(|guarantee| proof.region.lines(guarantee));
        if stable + unstable + undecided > 0 {
            lines.push(format!(
                "  and without an area, lines at a single delay: {stable} proven stable, {unstable} proven unstable, {undecided} undecided"
            ));
        }
        // The first proof is the one to compare with. Proven areas alone are counted, hence "at least".
        if number > 0 {
            let first = &proofs[0];
            let here = percent(both(&proof.region, Guarantee::Stable, &first.region, Guarantee::Unstable));
            let there = percent(both(&proof.region, Guarantee::Unstable, &first.region, Guarantee::Stable));
            lines.push(format!("  stable where {} is unstable: {here} at least; unstable where it is stable: {there} at least", first.name));
        }
        lines.extend(proof.uncertified.and_then(guarantee::left_open).map(|note| format!("  note: {note}")));
    }
    lines
}

/// Returns the share of the area, from 0 to 1, with the verdict `of_one` in region `one` and the verdict `of_other` in region `other`.
fn both(one: &ProvenRegion, of_one: Guarantee, other: &ProvenRegion, of_other: Guarantee) -> f64 {
    let chosen = |region: &ProvenRegion, guarantee| region.boxes.iter().filter(|one| one.guarantee == guarantee).copied().collect::<Vec<ProvenBox>>();
    let (ones, others) = (chosen(one, of_one), chosen(other, of_other));
    // Length of the overlap of two intervals; 0 if the intervals are apart.
    let side = |one: [f64; 2], other: [f64; 2]| (one[1].min(other[1]) - one[0].max(other[0])).max(0.0);
    let common = ones.iter().flat_map(|one| others.iter().map(move |other| side(one.x, other.x) * side(one.y, other.y))).sum::<f64>();
    let all: f64 = one.boxes.iter().map(|one| (one.x[1] - one.x[0]) * (one.y[1] - one.y[0])).sum();
    // The sum over no boxes may be -0.0. Adding 0.0 removes the sign.
    common / all + 0.0
}

/// Returns the CSV table of the boxes, one row per box.
fn table(order: &Order, region: &ProvenRegion) -> String {
    let [x, y] = [order.x(), order.y()].map(|range| csv_field(&range.key));
    let mut text = format!("{x} from,{x} to,{y} from,{y} to,verdict\n");
    for ProvenBox { x, y, guarantee } in &region.boxes {
        let _ = writeln!(text, "{:?},{:?},{:?},{:?},{}", x[0], x[1], y[0], y[1], guarantee.word());
    }
    text
}

/// Draws one picture per variant, `proof.svg`, `proof-2.svg` and so on. Returns the pictures with the names of their files.
fn pictures(order: &Order, proofs: &[Proof], arguments: &MapArguments) -> Vec<(String, String)> {
    let mut pictures = Vec::new();
    for (number, proof) in proofs.iter().enumerate() {
        let boxes = |guarantee| {
            let of = proof.region.boxes.iter().filter(move |one| one.guarantee == guarantee);
            of.map(|one| vec![(one.x[0], one.y[0]), (one.x[1], one.y[0]), (one.x[1], one.y[1]), (one.x[0], one.y[1])]).collect::<Vec<_>>()
        };
        let axes = [order.x(), order.y()].map(|range| axis_of(range).range(range.low, range.high));
        let [x, y] = axes;
        let panel = Panel::new(x, y)
            .with(Region::new(boxes(Guarantee::Stable), Fill::Tint(0)).named(format!("proven stable: {}", order.legend(number))))
            .with(Region::new(boxes(Guarantee::Unstable), Fill::Tint(1)).named("proven unstable"))
            .with(Region::new(boxes(Guarantee::Undecided), Fill::Grey).named("undecided"));
        let name = if number == 0 { "proof.svg".to_owned() } else { format!("proof-{}.svg", number + 1) };
        let svg = Picture::new(order.title.as_str()).panel(panel).size(arguments.pictures.size()).svg();
        pictures.push((name, svg));
    }
    pictures
}
