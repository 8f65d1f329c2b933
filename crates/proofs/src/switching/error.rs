//! Reasons why nothing can be said of contacts that switch.

use cohaptic_stability::AnalysisError;

/// Why nothing can be said of contacts that switch.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum SwitchingError {
    /// The scene cannot be analysed.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// Nothing opens or closes.
    #[error(
        "no contact of this scene opens or closes: expected contact = {{ push = … }} or an enclosure; the verdict without this option is all there is to say"
    )]
    NoContact,
    /// Something is left to chance.
    #[error(
        "links leave something to chance, and a guarantee is about one sequence of events: expected links without jitter and loss, such as --set link.loss=0 --set link.jitter=0s"
    )]
    Chance,
    /// A spring of a contact is none.
    #[error("the contact of {what} has no stiffness: expected one above 0")]
    NoSpring {
        /// Whose.
        what: String,
    },
    /// The inequality is too large.
    #[error(
        "a frame of {ticks} ticks of contacts and {states} states makes an inequality of {rows} rows: expected at most {most}; take a shorter update, slower clocks or more peers that are equal"
    )]
    TooLarge {
        /// The ticks of all contacts in a frame.
        ticks: usize,
        /// The states of a frame.
        states: usize,
        /// The rows.
        rows: usize,
        /// The most.
        most: usize,
    },
}
