//! The answers about the stability of a scene: document and words of a verdict.

mod document;
mod speed;
mod words;

use cohaptic_stability::{Analysis, ContactMode};

pub use document::document;
pub use words::{words, worst_in_words};

/// Returns the mode of contact with the largest radius.
fn worst_mode(analysis: &Analysis) -> Option<&ContactMode> {
    analysis.modes.iter().max_by(|one, other| one.radius.value.total_cmp(&other.radius.value))
}
