//! The proof of a verdict for every number of equal peers, for `--every-number`.

use std::fmt::Write as _;
use std::path::Path;

use cohaptic_proofs::{EveryNumber, Guarantee, MOST_FOLLOWED, Nearness, NumberProof, NumberSpan, Openness, ProofError};
use cohaptic_scene::Scene;
use serde::Serialize;

use crate::arguments::PointArguments;
use crate::document_schema::document;
use crate::failure::Failure;
use crate::file::write_file;
use crate::output::figure;
use crate::stability::certificate::{self, Given};
use crate::stability::guarantee::{self, PieceWatch};
use crate::{input, output};

/// Result of the proof, with its certificate if a certificate was written.
pub(super) struct Proof {
    pub(super) every: EveryNumber,
    pub(super) certificate: Option<Certificate>,
}

/// Path of a certificate, and the ranges of numbers with a verdict but without a proof in the certificate.
pub(super) struct Certificate {
    pub(super) file: String,
    uncertified: Vec<(u64, Option<u64>)>,
}

/// Prepares the proof, or returns `None` if no option asks for the proof. A scene outside the reach of the proof is a failure.
pub(super) fn asked(scene: &Scene, arguments: &PointArguments, path: &Path) -> Result<Option<NumberProof>, Failure> {
    let Some((from, to)) = arguments.every_number else { return Ok(None) };
    NumberProof::new(scene, from, to).map(Some).map_err(|error| failure(error, path))
}

fn failure(error: ProofError, path: &Path) -> Failure {
    let option = format!("{}: --every-number", output::path(input::named(path)));
    guarantee::failure(error, &option, path, |error| Failure::Input(format!("{option}: {error}")))
}

/// Runs the prepared proof, and writes the certificate if the proof is complete.
pub(super) fn of(asked: Option<&NumberProof>, scene: &Scene, arguments: &PointArguments, path: &Path) -> Result<Option<Proof>, Failure> {
    let Some(asked) = asked else { return Ok(None) };
    let failure = |error| failure(error, path);
    let every = asked.prove(&PieceWatch::new()).map_err(failure)?;
    let Some(file) = arguments.certificate.as_ref().filter(|_| every.is_whole) else {
        return Ok(Some(Proof { every, certificate: None }));
    };
    let spans = every.certify(scene, &PieceWatch::new()).map_err(failure)?;
    let given = Given { title: &scene.title, text: &input::text(path)?, overrides: &arguments.scene.overrides.set };
    write_file(file, certificate::of_numbers(&given, every.growing, &spans)?)?;
    let certificate = Some(Certificate { file: output::path(file), uncertified: every.uncertified(&spans) });
    Ok(Some(Proof { every, certificate }))
}

/// Returns the proof's part of the JSON document.
pub(super) fn document(scene: &Scene, Proof { every, certificate }: &Proof) -> impl Serialize + use<> {
    let spans = with_reasons(every).map(|(span, reason)| {
        document! {
            from: span.from,
            to: span.to,
            verdict: span.guarantee.word(),
            // Reason for an undecided span; absent for decided spans.
            #[serde(flatten)]
            reason: reason.map(|reason| document! { reason: reason }),
        }
    });
    document! {
        // First of the equal peers whose number grows.
        peer: scene.peers[every.growing].name.clone(),
        // `to` is `null` for a span without an end.
        spans: spans.collect::<Vec<_>>(),
        // Whether the verdict is in the mean square, as for links that lose packets.
        mean_square: every.is_mean_square,
        // The quantity without a limit as N grows; `null` if every quantity has a limit, or if the numbers end.
        without_limit: every.without_limit.clone(),
        certificates: every.attempts,
        // Whether the proof was interrupted before all numbers were checked.
        interrupted: !every.is_whole,
        // Path of the certificate, and the numbers with a verdict but without a proof in the certificate; absent without `--certificate`.
        #[serde(flatten)]
        certificate: certificate.as_ref().map(|Certificate { file, uncertified }| {
            let uncertified = uncertified.iter().map(|(from, to)| document! { from: *from, to: *to });
            document! { file: file.clone(), uncertified: uncertified.collect::<Vec<_>>() }
        }),
    }
}

/// Returns each span of numbers of peers, with the reason if the span is undecided.
fn with_reasons(every: &EveryNumber) -> impl Iterator<Item = (NumberSpan, Option<String>)> {
    // `open` has a reason per undecided span, in the order of the spans.
    let mut open = every.open.iter();
    every
        .spans
        .iter()
        .map(move |span| (*span, (span.guarantee == Guarantee::Undecided).then(|| open.next().map(|why| reason(span.from, *why))).flatten()))
}

/// Returns the reason why the numbers from `from` on are undecided.
fn reason(from: u64, why: Openness) -> String {
    match why {
        Openness::Ended => "the proof was stopped".to_owned(),
        Openness::Exhausted => "too many pieces were looked at".to_owned(),
        // The span begins after the followed numbers, or after the first number of the range if that is larger.
        Openness::Beyond => format!("no proof was found beyond N = {}", from - 1),
        Openness::Moment => format!("no second moment was found that decides N = {from}"),
        Openness::Near(near) => format!("at N = {from} {}", too_near(near)),
        Openness::Limit(near) => format!("as N grows, {}", too_near(near)),
    }
}

/// Returns the words for an eigenvalue of a frame that the bounds cannot separate from the unit circle or from other eigenvalues.
fn too_near(Nearness { radius, bound }: Nearness) -> String {
    if !bound.is_finite() {
        return "the bounds of a frame are no finite numbers".to_owned();
    }
    let off = (radius - 1.0).abs();
    let (size, from) = match radius {
        _ if off < 1e-15 => ("1".to_owned(), "the unit circle"),
        _ if off < 0.01 => (format!("1 {} {off:.1e}", if radius < 1.0 { '-' } else { '+' }), "the unit circle"),
        _ => (figure(radius, 4), "others"),
    };
    format!("the largest eigenvalue of a frame, of the size {size}, is too near to {from} for bounds of {bound:.1e}")
}

/// Returns the words for the numbers N from `from` to `to`; `None` means without end.
fn numbers(from: u64, to: Option<u64>) -> String {
    match to {
        None => format!("N >= {from}"),
        Some(to) if to == from => format!("N = {from}"),
        Some(to) => format!("{from} <= N <= {to}"),
    }
}

/// Returns the lines after the verdict: one line per span, then the notes.
pub(super) fn words(scene: &Scene, Proof { every, certificate }: &Proof) -> String {
    let mean_square = if every.is_mean_square { " in the mean square" } else { "" };
    let mut text =
        format!("\n  every number N of peers, of which more and more are equal to {}, proven{mean_square}:\n", scene.peers[every.growing].name);
    // Writing to a string does not fail.
    for (NumberSpan { from, to, guarantee }, reason) in with_reasons(every) {
        let reason = reason.map_or_else(String::new, |reason| format!(": {reason}"));
        let _ = writeln!(text, "    {:<10}for {}{reason}", guarantee.word(), numbers(from, to));
    }
    if let Some(what) = &every.without_limit {
        let beyond = if every.is_mean_square { "nothing can be proven" } else { "only instability can be proven" };
        // A range that begins above the followed numbers is followed at its first number only.
        let followed = every.spans.first().map_or(MOST_FOLLOWED, |first| first.from.max(MOST_FOLLOWED));
        let _ = writeln!(text, "  note: as N grows, {what}: beyond N = {followed} {beyond}");
    }
    let uncertified = certificate.iter().flat_map(|certificate| &certificate.uncertified);
    let uncertified: Vec<String> = uncertified.map(|(from, to)| numbers(*from, *to)).collect();
    if !uncertified.is_empty() {
        let _ = writeln!(text, "  note: the certificate leaves open numbers that are decided here: {}", uncertified.join("; "));
    }
    text
}
