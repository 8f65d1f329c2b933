//! What the commands that run in real time say in words.

use std::fmt::Write as _;

use cohaptic_falcon::boot::Progress;
use cohaptic_realtime::{LatenessSummary, Prepared, Wish};

use crate::documents::micros;

/// `p50 31.2 µs, p99 76 µs, p99.9 120 µs, worst 1.2 ms`.
pub(crate) fn late(summary: &LatenessSummary) -> String {
    let LatenessSummary { p50, p99, p999, max, .. } = *summary;
    let [p50, p99, p999, max] = [p50, p99, p999, max].map(|span| {
        let micros = micros(span);
        if micros < 1000.0 { format!("{micros:.1} µs") } else { format!("{:.2} ms", micros / 1e3) }
    });
    format!("p50 {p50}, p99 {p99}, p99.9 {p999}, worst {max}")
}

/// What the system granted, and each thing that it refused with the way out.
pub(crate) fn notes(prepared: &Prepared) -> String {
    let mut text = String::new();
    let granted: Vec<&str> = prepared.granted.iter().copied().map(Wish::name).collect();
    if !granted.is_empty() {
        let _ = writeln!(text, "  granted by the system: {}", granted.join(", "));
    }
    for refused in &prepared.refused {
        let _ = writeln!(text, "  {refused}");
    }
    text
}

/// How far the loading of a Falcon's firmware is; `None` for what comes too often to be said.
pub(crate) fn loading(progress: Progress) -> Option<String> {
    match progress {
        Progress::Attempt(attempt) => Some(format!("loading the firmware, attempt {attempt}")),
        Progress::Greeted(_) => Some("the boot loader answers".to_owned()),
        Progress::Loaded { done, of } => (done == of).then(|| format!("{of} bytes are over")),
        Progress::Failed(error) => Some(error.to_string()),
        Progress::Running => Some("its firmware runs".to_owned()),
    }
}
