//! Certificates: the numbers by which a reader can check, without this program, that a scene is stable however its contacts open and close.
//!
//! A reader with the scene can write down the frame, and verify with V and the multipliers that the quadratic form of [`super`] is below zero.
//! `crates/stability/tests/reference/check_certificate.py` does so.

use cohaptic_peer::Gains;
use cohaptic_stability::frames::{Node, Sampling, Structure};

use super::asked::Asked;
use crate::boxes::digits;
use crate::boxes::{FrameState, PartCertificate};
use crate::inequality::Solution;

/// The numbers by which a reader can check the proof of a motion along an axis.
#[derive(Clone, PartialEq, Debug)]
pub struct SwitchingCertificate {
    /// Number of the axis, counted from 0.
    pub axis: usize,
    /// Factor by which the norm that V defines shrinks in each frame at least, below 1.
    pub factor: f64,
    /// Factor of velocities in the states \[s\].
    pub time: f64,
    /// Gains K and B by which a sample is the single number (K·x + B·v)/(K + B/time). `None`: a sample is a position and a velocity.
    pub heard: Option<Gains>,
    /// Certificates of the averages of classes, and of the differences within each class with contacts.
    pub parts: Vec<PushCertificate>,
    /// Certificates of the differences within classes without contacts.
    pub rest: Vec<PartCertificate>,
    /// Multipliers, in digits as in [`PushCertificate::shape`]. Each tick of each group of equal contacts has seven: of f·(f − p − τ·δ'), p·(f − p − τ·δ'),
    /// f·Δb, p·Δb, −p⁺·Δb, p·(δ − p) and f·(δ − p), with p⁺ the p of the next tick. The multipliers of pairs of classes at walls follow.
    pub multipliers: String,
}

/// The certificate of a part of a motion with contacts.
#[derive(Clone, PartialEq, Debug)]
pub struct PushCertificate {
    /// Members of each class, as indices of peers of the scene.
    pub members: Vec<Vec<usize>>,
    /// `true` if the part is about the differences between members of a class. Otherwise the part is about the averages of classes.
    pub is_difference: bool,
    /// States that V measures. The depth p of each contact before the frame follows these states in V. Positions are measured from the first copy if nothing
    /// ties the scene to ground.
    pub states: Vec<FrameState>,
    /// Matrix of V, row by row, each entry as the sixteen hexadecimal digits of its IEEE 754 representation.
    pub shape: String,
}

impl Asked {
    /// Returns the certificate of a checked solution with the rate that the check found.
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
            // Halfway between the rate and 1, so that a check with wider bounds of rounding errors succeeds as well.
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
