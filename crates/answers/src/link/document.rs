//! The figures of a link as a JSON document.

use serde::Serialize;

use super::{MOST_MEASURED, Measured};
use crate::document;

/// The speed of the emulator over a link, and the files that were written.
#[derive(Clone, PartialEq, Debug)]
pub struct Written {
    /// Packets that the emulator took in a second of the wall clock.
    pub packets_per_s: f64,
    /// The paths of the files: the log of fates, the capture.
    pub files: Vec<String>,
}

/// The answer of `cohaptic link --json`. `written`: the speed of the emulator and the files, if they are said.
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
        speed: written.map(|written| document! { packets_per_s: written.packets_per_s }),
        interrupted: measured.is_interrupted(),
        #[serde(flatten)]
        files: written.map(|written| document! { files: written.files.as_slice() }),
    }
}
