//! Texts of certificates: JSON documents with the scene and all numbers for a check of the verdicts by another program.

use cohaptic_proofs::{
    BoxCertificate, FrameState, FreeCircle, Guarantee, MomentCertificate, NumberCertificate, PartCertificate, Switching, SwitchingCertificate,
    TopologyCertificate,
};
use cohaptic_stability::KeyRange;
use serde::Serialize;

use crate::document_schema::{DocumentSchema, document};
use crate::failure::Failure;

/// A scene as given by the user: title, text of the file, and `KEY=VALUE` overrides.
pub(super) struct Given<'a> {
    pub(super) title: &'a str,
    pub(super) text: &'a str,
    pub(super) overrides: &'a [String],
}

/// Returns the certificate of boxes that cover the ranges of `keys`. `every` is the range of numbers of equal peers; `None` for the scene's number.
pub(super) fn of_boxes(
    given: &Given<'_>,
    keys: &[&KeyRange],
    every: Option<(u64, Option<u64>)>,
    topology: Option<&TopologyCertificate>,
    boxes: &[BoxCertificate],
) -> Result<String, Failure> {
    written(
        DocumentSchema::STABILITY_CERTIFICATE,
        &document! {
            title: given.title,
            scene: given.text,
            overrides: given.overrides,
            keys: keys.iter().map(|range| range.key.as_str()).collect::<Vec<_>>(),
            ranges: keys.iter().map(|range| [range.low, range.high]).collect::<Vec<_>>(),
            units: keys.iter().map(|range| range.unit.as_str()).collect::<Vec<_>>(),
            // Range of the number N of equal peers. The last range of a box is then the range of 1/(N - 1). `null` for the scene's number.
            every_number: every.map(|(from, to)| document! { from: from, to: to }),
            #[serde(flatten)]
            topology: topology.map(|topology| document! { topology: of_topology(topology) }),
            boxes: boxes.iter().map(of_box).collect::<Vec<_>>(),
        },
    )
}

/// Returns the certificate of spans of numbers of peers. The peers equal to the peer with the index `growing` grow in number.
pub(super) fn of_numbers(given: &Given<'_>, growing: usize, spans: &[NumberCertificate]) -> Result<String, Failure> {
    let spans = spans.iter().map(|span| {
        document! {
            from: span.from,
            // `null` for a span without an end.
            to: span.to,
            verdict: span.guarantee.word(),
            parts: span.parts.iter().map(of_part).collect::<Vec<_>>(),
            // Certificates of the verdict in the mean square.
            moments: span.moments.iter().map(of_moment).collect::<Vec<_>>(),
        }
    });
    written(
        DocumentSchema::STABILITY_NUMBER_CERTIFICATE,
        &document! {
            title: given.title,
            scene: given.text,
            overrides: given.overrides,
            // Index of the first of the equal peers, counted from 0.
            growing: growing,
            spans: spans.collect::<Vec<_>>(),
        },
    )
}

/// Returns the certificate of opening and closing contacts.
pub(super) fn of_switching(given: &Given<'_>, found: &Switching) -> Result<String, Failure> {
    let motions = found.motions.iter().map(|motion| {
        document! {
            motion: motion.name.as_str(),
            // Only a motion that is proven stable has numbers to check; every other motion counts as undecided.
            verdict: if motion.certificate.is_some() { motion.guarantee.word() } else { Guarantee::Undecided.word() },
            #[serde(flatten)]
            proof: motion.certificate.as_ref().map(of_contacts),
        }
    });
    written(
        DocumentSchema::STABILITY_SWITCHING_CERTIFICATE,
        &document! {
            title: given.title,
            scene: given.text,
            overrides: given.overrides,
            motions: motions.collect::<Vec<_>>(),
        },
    )
}

fn of_contacts(of: &SwitchingCertificate) -> impl Serialize + use<'_> {
    let parts = of.parts.iter().map(|part| {
        document! {
            members: part.members.as_slice(),
            difference: part.is_difference,
            states: part.states.iter().map(of_state).collect::<Vec<_>>(),
            shape: part.shape.as_str(),
        }
    });
    document! {
        axis: of.axis,
        // Factor by which the form shrinks per frame at least.
        factor: of.factor,
        time: of.time,
        heard: of.heard.map(|gains| [gains.stiffness, gains.damping]),
        parts: parts.collect::<Vec<_>>(),
        // Differences of the members of classes without contacts.
        rest: of.rest.iter().map(of_part).collect::<Vec<_>>(),
        multipliers: of.multipliers.as_str(),
    }
}

fn written(schema: DocumentSchema, document: &impl Serialize) -> Result<String, Failure> {
    let text = serde_json::to_string(&schema.of(document)).map_err(|error| Failure::Input(format!("--certificate: {error}")))?;
    Ok(text + "\n")
}

fn of_box(one: &BoxCertificate) -> impl Serialize {
    document! {
        ranges: one.ranges.as_slice(),
        verdict: one.guarantee.word(),
        parts: one.parts.iter().map(of_part).collect::<Vec<_>>(),
    }
}

fn of_topology(topology: &TopologyCertificate) -> impl Serialize + use<'_> {
    document! {
        // Weights of the file that the scene names; `null` if the scene itself has the weights.
        weights: topology.weights.as_deref(),
        // Approximate eigenvectors of the averaging matrix, without the eigenvector of the eigenvalue 1.
        eigenvectors: topology.eigenvectors.as_str(),
    }
}

fn of_part(part: &PartCertificate) -> impl Serialize {
    let circle = match part.circle {
        FreeCircle::AroundZero(radius) => serde_json::json!(["around-zero", radius]),
        FreeCircle::AroundEntry(place, radius) => serde_json::json!(["around-entry", place, radius]),
    };
    document! {
        // Indices of the peers in the part's classes of equal peers, counted from 0, and whether the part is the difference of the members of one class.
        members: part.members.as_slice(),
        difference: part.is_difference,
        // Ends of the range of eigenvalues of a topology's averaging matrix, without 1, for which the part stands.
        #[serde(flatten)]
        eigenvalues: part.eigenvalues.map(|ends| document! { eigenvalues: ends }),
        states: part.states.iter().map(of_state).collect::<Vec<_>>(),
        // Gains K and B of a sample that is the number (K·x + B·v)/(K + B/time); `null` for a sample of position and velocity.
        heard: part.heard.map(|gains| [gains.stiffness, gains.damping]),
        // Factor on velocities [s].
        time: part.time,
        // Factor on forces [m/N], for scenes with a server or with waves.
        #[serde(flatten)]
        compliance: part.compliance.map(|compliance| document! { compliance: compliance }),
        coordinates: part.coordinates.as_str(),
        weights: part.weights.as_str(),
        circle: circle,
    }
}

fn of_moment(moment: &MomentCertificate) -> impl Serialize {
    document! {
        // Bound on the growth of the moment per frame: above the growth if the verdict is stable, and at most the growth if unstable.
        factor: moment.factor,
        time: moment.time,
        heard: moment.heard.map(|gains| [gains.stiffness, gains.damping]),
        // Number of samples of earlier frames in the state.
        depth: moment.depth,
        // Blocks of the mean of all peers, of the differences from the mean, and of the remaining held samples.
        blocks: moment.blocks.as_slice(),
    }
}

fn of_state(state: &FrameState) -> serde_json::Value {
    let which = |velocity: bool| if velocity { "velocity" } else { "position" };
    match *state {
        FrameState::Device { class, velocity } => serde_json::json!(["device", class, which(velocity)]),
        FrameState::Copy { class, velocity } => serde_json::json!(["copy", class, which(velocity)]),
        FrameState::Sample { class, number, channel } => serde_json::json!(["sample", class, number, channel]),
        FrameState::Returned { class, number } => serde_json::json!(["returned", class, number]),
        FrameState::Waves { class, number, of_others } => serde_json::json!(["waves", class, number, if of_others { "sent" } else { "received" }]),
        FrameState::Other { class, row } => serde_json::json!(["other", class, row]),
    }
}
