//! Files of certificates: all by which verdicts on sets of scenes can be checked without this program.

use cohaptic_proofs::{
    BoxCertificate, FrameState, FreeCircle, Guarantee, MomentCertificate, NumberCertificate, PartCertificate, Switching, SwitchingCertificate,
    TopologyCertificate,
};
use cohaptic_stability::KeyRange;
use serde::Serialize;

use crate::document_schema::{DocumentSchema, document};
use crate::failure::Failure;

/// A scene as it was given: its title, its text, and what was put into it.
pub(super) struct Given<'a> {
    pub(super) title: &'a str,
    pub(super) text: &'a str,
    pub(super) overrides: &'a [String],
}

/// The text of a certificate of boxes that cover the ranges of keys.
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
            // For which numbers N of equal peers; a box then ends with the range of 1/(N - 1). `null`: for those of the scene.
            every_number: every.map(|(from, to)| document! { from: from, to: to }),
            #[serde(flatten)]
            topology: topology.map(|topology| document! { topology: of_topology(topology) }),
            boxes: boxes.iter().map(of_box).collect::<Vec<_>>(),
        },
    )
}

/// The text of a certificate of numbers of peers, of which more and more are equal to one.
pub(super) fn of_numbers(given: &Given<'_>, growing: usize, spans: &[NumberCertificate]) -> Result<String, Failure> {
    let spans = spans.iter().map(|span| {
        document! {
            from: span.from,
            // `null`: without end.
            to: span.to,
            verdict: span.guarantee.word(),
            parts: span.parts.iter().map(of_part).collect::<Vec<_>>(),
            // In the mean square.
            moments: span.moments.iter().map(of_moment).collect::<Vec<_>>(),
        }
    });
    written(
        DocumentSchema::STABILITY_NUMBER_CERTIFICATE,
        &document! {
            title: given.title,
            scene: given.text,
            overrides: given.overrides,
            // The place of the first of the equal peers, counted from 0.
            growing: growing,
            spans: spans.collect::<Vec<_>>(),
        },
    )
}

/// The text of a certificate of contacts that open and close.
pub(super) fn of_switching(given: &Given<'_>, found: &Switching) -> Result<String, Failure> {
    let motions = found.motions.iter().map(|motion| {
        document! {
            motion: motion.name.as_str(),
            // Of a motion that is not proven stable nothing can be checked.
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
        // By which the form shrinks in a frame at least.
        factor: of.factor,
        time: of.time,
        heard: of.heard.map(|gains| [gains.stiffness, gains.damping]),
        parts: parts.collect::<Vec<_>>(),
        // How the members of classes without contacts differ.
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
        // Of the file that the scene names; null: the scene says them.
        weights: topology.weights.as_deref(),
        // Of the averaging matrix, nearly, but for that of the eigenvalue 1.
        eigenvectors: topology.eigenvectors.as_str(),
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
        // Of the averaging matrix of a topology, but for 1: between which ends those are that the part stands for.
        #[serde(flatten)]
        eigenvalues: part.eigenvalues.map(|ends| document! { eigenvalues: ends }),
        states: part.states.iter().map(of_state).collect::<Vec<_>>(),
        // The gains K and B by which a sample is the number (K·x + B·v)/(K + B/time); null: its position and its velocity.
        heard: part.heard.map(|gains| [gains.stiffness, gains.damping]),
        // What velocities are multiplied by, in seconds.
        time: part.time,
        // With a server or waves, by what forces are multiplied, in m/N.
        #[serde(flatten)]
        compliance: part.compliance.map(|compliance| document! { compliance: compliance }),
        coordinates: part.coordinates.as_str(),
        weights: part.weights.as_str(),
        circle: circle,
    }
}

fn of_moment(moment: &MomentCertificate) -> impl Serialize {
    document! {
        // The moment grows by less than this in a frame if it is stable, and by this at least if it is not.
        factor: moment.factor,
        time: moment.time,
        heard: moment.heard.map(|gains| [gains.stiffness, gains.damping]),
        // How many samples of frames before take part.
        depth: moment.depth,
        // Of the mean of all peers, of differences from it, and of the rest of the samples held.
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
