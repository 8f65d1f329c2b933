//! The JSON document of a link's figures.

use serde::Serialize;

use super::{MOST_MEASURED, Measured};
use crate::document;
use crate::parts::cross_counts;

/// Speed of the emulator, and the written files.
#[derive(Clone, PartialEq, Debug)]
pub struct Written {
    /// Packets per second of wall time.
    pub packets_per_s: f64,
    /// Paths of the files: the log of fates, the capture.
    pub files: Vec<String>,
}

/// Returns the answer of `cohaptic link --json`. `written`: speed and files; `None` leaves these keys out.
pub fn document(measured: &Measured, written: Option<&Written>) -> impl Serialize {
    document! {
        asked: document! {
            spec: measured.said.as_str(),
            #[serde(flatten)]
            figures: &measured.asked,
        },
        achieved: &measured.achieved,
        compared: measured.figures.as_slice(),
        measured_packets: measured.sent.min(MOST_MEASURED),
        fates: &measured.achieved.fates,
        #[serde(flatten)]
        cross: cross_counts(measured.cross_traffic),
        #[serde(flatten)]
        speed: written.map(|written| document! { packets_per_s: written.packets_per_s }),
        interrupted: measured.is_interrupted(),
        #[serde(flatten)]
        files: written.map(|written| document! { files: written.files.as_slice() }),
    }
}
