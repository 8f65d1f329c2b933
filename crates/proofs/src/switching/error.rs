//! Errors of the proof of contacts that switch.

use cohaptic_stability::AnalysisError;

/// Reasons why [`prove_switching`](super::prove_switching) has no verdict.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SwitchingError {
    /// The scene cannot be analysed.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// No contact of the scene opens or closes.
    #[error(
        "no contact of this scene opens or closes: expected contact = {{ push = … }} or an enclosure; the verdict without this option is all there is to say"
    )]
    NoContact,
    /// A link has jitter or random loss.
    #[error(
        "links leave something to chance, and a guarantee is about one sequence of events: expected links without jitter and loss, such as --set link.loss=0 --set link.jitter=0s"
    )]
    Chance,
    /// The stiffness of a contact is not above zero.
    #[error("the contact of {what} has no stiffness: expected one above 0")]
    NoSpring {
        /// Name of the peer.
        what: String,
    },
    /// The inequality would have too many rows.
    #[error(
        "a frame of {ticks} ticks of contacts and {states} states makes an inequality of {rows} rows: expected at most {most}; take a shorter update, slower clocks or more peers that are equal"
    )]
    TooLarge {
        /// Number of ticks of all contacts in a frame.
        ticks: usize,
        /// Number of states of a frame.
        states: usize,
        /// Number of rows of the inequality.
        rows: usize,
        /// Largest number of rows that is allowed.
        most: usize,
    },
}
