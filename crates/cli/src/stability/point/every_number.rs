//! The verdict for every number of equal peers.

use std::fmt::Write as _;
use std::path::Path;

use cohaptic_scene::Scene;
use cohaptic_stability::{EveryNumber, NumberProof, NumberSpan, ProofError};
use serde::Serialize;

use crate::arguments::PointArguments;
use crate::document_schema::document;
use crate::failure::Failure;
use crate::file::write_file;
use crate::stability::certificate::{self, Given};
use crate::stability::guarantee::{self, PieceWatch};
use crate::{input, output};

/// A proof, and the file of its certificate.
pub(super) struct Proof {
    pub(super) every: EveryNumber,
    pub(super) file: Option<String>,
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
    let Some(file) = arguments.certificate.as_ref().filter(|_| every.is_whole) else { return Ok(Some(Proof { every, file: None })) };
    let spans = every.certify(scene, &PieceWatch::new()).map_err(failure)?;
    let given = Given { title: &scene.title, text: &input::text(path)?, overrides: &arguments.scene.overrides.set };
    write_file(file, certificate::of_numbers(&given, every.growing, &spans)?)?;
    Ok(Some(Proof { every, file: Some(output::path(file)) }))
}

/// The part of the JSON document.
pub(super) fn document(scene: &Scene, Proof { every, file }: &Proof) -> impl Serialize + use<> {
    let spans = every.spans.iter().map(|span| document! { from: span.from, to: span.to, verdict: span.guarantee.word() });
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
        // The file of the certificate; absent if none is asked for.
        #[serde(flatten)]
        file: file.as_ref().map(|file| document! { file: file.clone() }),
    }
}

/// The lines below the verdict.
pub(super) fn words(scene: &Scene, Proof { every, .. }: &Proof) -> String {
    let mean_square = if every.is_mean_square { " in the mean square" } else { "" };
    let mut text =
        format!("\n  every number N of peers, of which more and more are equal to {}, proven{mean_square}:\n", scene.peers[every.growing].name);
    for NumberSpan { from, to, guarantee } in &every.spans {
        let numbers = match to {
            None => format!("N >= {from}"),
            Some(to) if to == from => format!("N = {from}"),
            Some(to) => format!("{from} <= N <= {to}"),
        };
        // Writing to a string does not fail.
        let _ = writeln!(text, "    {:<10}for {numbers}", guarantee.word());
    }
    if let Some(what) = &every.without_limit {
        let beyond = if every.is_mean_square { "" } else { ", and beyond as multiples of that" };
        let _ = writeln!(text, "  note: as N grows, {what}: numbers were followed to {}{beyond}", cohaptic_stability::MOST_FOLLOWED);
    }
    text
}
