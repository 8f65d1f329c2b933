//! `certificate.json`: all by which the verdicts of `cohaptic stability map --prove` can be checked without this program.

use std::path::Path;

use cohaptic_stability::{BoxCertificate, FrameState, FreeCircle, PartCertificate};
use serde::Serialize;

use super::{Order, Proof, failure};
use crate::arguments::MapArguments;
use crate::document_schema::{DocumentSchema, document};
use crate::failure::Failure;
use crate::file::write_into;
use crate::stability::guarantee::PieceWatch;

/// Writes a certificate for each variant, and gives the names of the files.
pub(super) fn write(order: &Order, arguments: &MapArguments, proofs: &[Proof], folder: &Path) -> Result<Vec<String>, Failure> {
    let mut files = Vec::new();
    let watch = PieceWatch::new();
    for (number, (proof, family)) in proofs.iter().zip(&order.families).enumerate() {
        let boxes = proof.region.certify(family, &watch).map_err(|error| failure(order, arguments, number, error))?;
        let overrides = order.variants[number].on_top_of(&arguments.scene.overrides.set);
        let boxes = boxes.iter().map(of_box).collect::<Vec<_>>();
        let (x, y) = (order.x(), order.y());
        let document = document! {
            title: order.title.as_str(),
            scene: order.text.as_str(),
            overrides: overrides,
            keys: [x.key.as_str(), y.key.as_str()],
            ranges: [[x.low, x.high], [y.low, y.high]],
            boxes: boxes,
        };
        let text = serde_json::to_string(&DocumentSchema::STABILITY_CERTIFICATE.of(&document))
            .map_err(|error| Failure::Input(format!("--certificate: {error}")))?;
        let name = if number == 0 { "certificate.json".to_owned() } else { format!("certificate-{}.json", number + 1) };
        files.push(write_into(folder, &name, text + "\n")?);
    }
    Ok(files)
}

fn of_box(one: &BoxCertificate) -> impl Serialize {
    document! {
        ranges: one.ranges.as_slice(),
        verdict: one.guarantee.word(),
        parts: one.parts.iter().map(of_part).collect::<Vec<_>>(),
    }
}

fn of_part(part: &PartCertificate) -> impl Serialize {
    let circle = match part.circle {
        FreeCircle::AroundZero(radius) => serde_json::json!(["around-zero", radius]),
        FreeCircle::AroundEntry(place, radius) => serde_json::json!(["around-entry", place, radius]),
    };
    document! {
        // The members of its classes of equal peers, counted from 0, and whether it is how the members of one differ.
        members: part.members.as_slice(),
        difference: part.is_difference,
        states: part.states.iter().map(of_state).collect::<Vec<_>>(),
        // The gains K and B by which a sample is the number (K·x + B·v)/(K + B/time); null: its position and its velocity.
        heard: part.heard.map(|gains| [gains.stiffness, gains.damping]),
        // What velocities are multiplied by, in seconds.
        time: part.time,
        coordinates: part.coordinates.as_str(),
        weights: part.weights.as_str(),
        circle: circle,
    }
}

fn of_state(state: &FrameState) -> serde_json::Value {
    let which = |velocity: bool| if velocity { "velocity" } else { "position" };
    match *state {
        FrameState::Device { class, velocity } => serde_json::json!(["device", class, which(velocity)]),
        FrameState::Copy { class, velocity } => serde_json::json!(["copy", class, which(velocity)]),
        FrameState::Sample { class, number, channel } => serde_json::json!(["sample", class, number, channel]),
        FrameState::Other { class, row } => serde_json::json!(["other", class, row]),
    }
}
