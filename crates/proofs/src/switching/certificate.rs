//! Certificates: the numbers by which anybody can check that contacts which open and close do no harm, without the program that found them.
//!
//! A reader with the scene can write down the frame, and see with V and the multipliers that the quadratic form of [`super`] is below zero; `crates/stability/tests/reference/check_certificate.py` does.

use cohaptic_peer::Gains;
use cohaptic_stability::frames::{Node, Sampling, Structure};

use super::asked::Asked;
use crate::boxes::digits;
use crate::boxes::{FrameState, PartCertificate};
use crate::inequality::Solution;

/// The numbers by which a motion along an axis can be checked.
#[derive(Clone, PartialEq, Debug)]
pub struct SwitchingCertificate {
    /// Which axis, counted from 0.
    pub axis: usize,
    /// By this factor a frame or a smaller one V shrinks.
    pub factor: f64,
    /// What velocities are multiplied by \\[s\\].
    pub time: f64,
    /// The gains K and B by which a sample is the one number (K·x + B·v)/(K + B/time); `None`: its position and its velocity.
    pub heard: Option<Gains>,
    /// The averages of classes, and the differences within each that pushes.
    pub parts: Vec<PushCertificate>,
    /// Of classes without contacts, how their members differ.
    pub rest: Vec<PartCertificate>,
    /// Seven for each tick of each class that pushes: of f·(f − p − τ·δ'), p·(f − p − τ·δ'), f·Δb, p·Δb, −p⁺·Δb, p·(δ − p) and f·(δ − p), in digits as those of V. Those of two classes at walls follow.
    pub multipliers: String,
}

/// A part of a motion with contacts.
#[derive(Clone, PartialEq, Debug)]
pub struct PushCertificate {
    /// The members of each class, by their places in the scene.
    pub members: Vec<Vec<usize>>,
    /// Whether it is how the members of a class differ.
    pub is_difference: bool,
    /// What V measures: these states, and then the depth p of each contact before the frame. Positions are counted from the first copy where nothing ties the scene to ground.
    pub states: Vec<FrameState>,
    /// V, row by row, each entry as sixteen hexadecimal digits of its IEEE 754 representation.
    pub shape: String,
}

impl Asked {
    /// The certificate of a solution that was checked.
    pub(super) fn certificate(&self, axis: usize, structure: &Structure, nodes: &[Node], solution: &Solution, rate: f64) -> SwitchingCertificate {
        let channels = self.sampling.channels();
        let parts = self.frames.iter().zip(&self.parts).zip(&solution.shapes).map(|(((frame, ..), (apart, history)), shape)| {
            let classes: Vec<usize> = apart.map_or_else(|| (0..structure.classes.len()).collect(), |class| vec![class]);
            let mut states = Vec::new();
            for (class, node) in classes.iter().map(|class| &nodes[*class]).enumerate() {
                let rows = node.rows(0);
                let is_reference = |row: usize| class == 0 && apart.is_none() && !self.tied && row == rows.object;
                states.extend((0..node.states()).filter(|row| !is_reference(*row)).map(|row| FrameState::of(class, rows, row)));
            }
            for (class, numbers) in history.iter().enumerate() {
                let sample = |number: usize| {
                    let age = number.div_ceil(channels);
                    FrameState::Sample { class, number: -i64::try_from(age).unwrap_or(0), channel: age * channels - number }
                };
                states.extend((1..=*numbers).map(sample));
            }
            let states = states.into_iter().enumerate().filter(|(row, _)| !frame.loose.contains(row)).map(|(_, state)| state).collect();
            PushCertificate {
                members: classes.iter().map(|class| structure.classes[*class].clone()).collect(),
                is_difference: apart.is_some(),
                states,
                shape: digits((0..shape.rows()).flat_map(|row| shape.row(row).to_vec())),
            }
        });
        SwitchingCertificate {
            axis,
            // A reader with wider bounds shall be able to follow.
            factor: 0.5 * (1.0 + rate),
            time: self.time,
            heard: match self.sampling {
                Sampling::Combined(gains) => Some(gains),
                Sampling::Whole => None,
            },
            parts: parts.collect(),
            rest: self.rest.clone(),
            multipliers: digits(solution.multipliers.iter().copied()),
        }
    }
}
