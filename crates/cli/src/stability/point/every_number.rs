//! The verdict for every number of equal peers.

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

/// A proof, and its certificate.
pub(super) struct Proof {
    pub(super) every: EveryNumber,
    pub(super) certificate: Option<Certificate>,
}

/// The file of a certificate, and of which numbers it says nothing though they have a verdict.
pub(super) struct Certificate {
    pub(super) file: String,
    uncertified: Vec<(u64, Option<u64>)>,
}

/// The proof that is asked for, if one is; refuses scenes that have none.
pub(super) fn asked(scene: &Scene, arguments: &PointArguments, path: &Path) -> Result<Option<NumberProof>, Failure> {
    let Some((from, to)) = arguments.every_number else { return Ok(None) };
    NumberProof::new(scene, from, to).map(Some).map_err(|error| failure(error, path))
}

fn failure(error: ProofError, path: &Path) -> Failure {
    let option = format!("{}: --every-number", output::path(input::named(path)));
    guarantee::failure(error, &option, path, |error| Failure::Input(format!("{option}: {error}")))
}

/// The proof, if it is asked for.
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

/// The part of the JSON document.
pub(super) fn document(scene: &Scene, Proof { every, certificate }: &Proof) -> impl Serialize + use<> {
    let spans = with_reasons(every).map(|(span, reason)| {
        document! {
            from: span.from,
            to: span.to,
            verdict: span.guarantee.word(),
            // Why, of an undecided one; absent for others.
            #[serde(flatten)]
            reason: reason.map(|reason| document! { reason: reason }),
        }
    });
    document! {
        // The first of the equal peers of which there are more and more.
        peer: scene.peers[every.growing].name.clone(),
        // `to` is `null` where there is no end.
        spans: spans.collect::<Vec<_>>(),
        // Whether it is in the mean square, since links lose.
        mean_square: every.is_mean_square,
        // What has no limit as N grows; `null` if everything has one, or the numbers end.
        without_limit: every.without_limit.clone(),
        certificates: every.attempts,
        // Whether the proof was ended before it had looked at all numbers.
        interrupted: !every.is_whole,
        // The file of the certificate, and the numbers with a verdict of which it says nothing; absent if none is asked for.
        #[serde(flatten)]
        certificate: certificate.as_ref().map(|Certificate { file, uncertified }| {
            let uncertified = uncertified.iter().map(|(from, to)| document! { from: *from, to: *to });
            document! { file: file.clone(), uncertified: uncertified.collect::<Vec<_>>() }
        }),
    }
}

/// The spans, and why each is undecided, if it is.
fn with_reasons(every: &EveryNumber) -> impl Iterator<Item = (NumberSpan, Option<String>)> {
    let mut open = every.open.iter();
    every
        .spans
        .iter()
        .map(move |span| (*span, (span.guarantee == Guarantee::Undecided).then(|| open.next().map(|why| reason(span.from, *why))).flatten()))
}

/// Why numbers from one on are undecided.
fn reason(from: u64, why: Openness) -> String {
    match why {
        Openness::Ended => "the proof was ended".to_owned(),
        Openness::Exhausted => "too many pieces were looked at".to_owned(),
        Openness::Beyond => format!("numbers were followed to {MOST_FOLLOWED}"),
        Openness::Moment => format!("no second moment was found that decides N = {from}"),
        Openness::Near(near) => format!("at N = {from} {}", too_near(near)),
        Openness::Limit(near) => format!("as N grows, {}", too_near(near)),
    }
}

/// What bounds of a frame do not tell apart.
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

/// Numbers from one to another.
fn numbers(from: u64, to: Option<u64>) -> String {
    match to {
        None => format!("N >= {from}"),
        Some(to) if to == from => format!("N = {from}"),
        Some(to) => format!("{from} <= N <= {to}"),
    }
}

/// The lines below the verdict.
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
        let beyond = if every.is_mean_square { "" } else { ", and beyond as multiples of that" };
        let _ = writeln!(text, "  note: as N grows, {what}: numbers were followed to {MOST_FOLLOWED}{beyond}");
    }
    let uncertified = certificate.iter().flat_map(|certificate| &certificate.uncertified);
    let uncertified: Vec<String> = uncertified.map(|(from, to)| numbers(*from, *to)).collect();
    if !uncertified.is_empty() {
        let _ = writeln!(text, "  note: the certificate leaves open numbers that are decided here: {}", uncertified.join("; "));
    }
    text
}
