//! Reasons why nothing can be proven of a set of scenes.

use cohaptic_stability::{AnalysisError, FamilyError};

/// Reason why nothing can be proven of a set of scenes.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ProofError {
    /// The scene cannot be analysed.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// A scene of the family is refused.
    #[error(transparent)]
    Family(#[from] FamilyError),
    /// The family of a region does not have exactly two keys.
    #[error("expected two open keys for a region")]
    Keys,
    /// The family of a line does not have exactly one key.
    #[error("expected one open key for a line")]
    OneKey,
    /// A key sets more than gains, masses, dampings or the delay of links.
    #[error(
        "{key} does more than to set gains, masses and dampings, or the delay of links, and between two of its values there is no box: vary it by `--curve`, or ask `stability map` without --prove"
    )]
    Key {
        /// The key.
        key: String,
    },
    /// A range of delays has too many different frames.
    #[error("{key} has more than {most} delays of which each makes a frame of its own: expected a shorter range")]
    Stretches {
        /// The key.
        key: String,
        /// Largest number of frames.
        most: usize,
    },
    /// Gains or the mass of a copy depend on the number of peers.
    #[error(
        "gains or the mass of a copy depend on the number of peers, which no box of keys covers: expected average-position coordination without scaling and object.split-mass = false; or one number at a time, by `--curve scene.count=N`"
    )]
    Scaled,
    /// A verdict for every number of peers was asked for, of scenes that are followed for their own number of peers only.
    #[error(
        "{what}: a box of keys holds for the number of peers that the scene has; expected no --every-number, and one number at a time, by `--curve scene.count=N`"
    )]
    OneNumber {
        /// The coordination or the topology, in words.
        what: &'static str,
    },
    /// A certificate was asked for, of scenes whose frames the checker does not derive.
    #[error(
        "{what} has no certificate, since the program that checks it does not follow that: expected no --certificate; the verdicts of --prove hold without"
    )]
    NoCertificate {
        /// The feature of the scene without certificates, in words.
        what: &'static str,
    },
    /// The scene has walls, and its law is analysed without them.
    #[error(
        "with {strategy} coordination walls are left out of every analysis: expected a scene without object.enclosure for --prove; `stability map` and `boundary` without it say what they leave out"
    )]
    WallLeftOut {
        /// The name of the law.
        strategy: &'static str,
    },
    /// Clients of a server send displacements, or feel nothing.
    #[error(
        "a server is followed whose clients send states and feel a force: expected sends = \"states\" and returns = \"force\" or \"object\"; \
         `stability point`, `map` and `boundary` follow the others, without --prove"
    )]
    Clients,
    /// Waves run over links that differ, or between clocks that differ.
    #[error(
        "waves are followed over equal links between peers whose clocks and phases are equal: expected such a scene; `stability point`, `map` and `boundary` follow the others, without --every-number and --prove"
    )]
    UnequalWaves,
    /// The range of numbers of peers is empty or begins below 2.
    #[error("expected numbers of peers from 2 on, the least first, such as 2.. or 2..100")]
    Numbers,
    /// The number of peers is too small to leave enough peers in the class that grows.
    #[error("fewer than {least} peers leave none of those that are equal: expected {least} and more")]
    Fewer {
        /// The least number.
        least: u64,
    },
    /// No two peers are equal over equal links, so that no class can grow.
    #[error("no two peers are equal over equal links, of which there could be more: expected some; `stability map` varies keys of a scene as it is")]
    Unequal,
    /// A device touches nothing, and no damping brings the device to rest.
    #[error("the device of {peer} touches nothing and does not come to rest: expected a damping or a contact")]
    Loose {
        /// The first such peer.
        peer: String,
    },
    /// Links have jitter or losses, and the proof is about one sequence of events.
    #[error(
        "links leave something to chance, and a guarantee is about one sequence of events: expected links without jitter and loss; `stability map` and `boundary` without --prove take the mean square, `stability point --losses-in-a-row` bounds all losses"
    )]
    Chance,
    /// Links lose between peers that differ, or are random otherwise than by independent losses.
    #[error(
        "links leave something to chance: expected equal peers over equal links that lose independently and on which nothing overtakes, for every number of them in the mean square; `stability point` without --every-number follows more"
    )]
    UnequalChance,
    /// A law uses the ages of samples, and links lose samples.
    #[error(
        "{strategy} coordination uses the ages of samples, which differ from link to link where some are lost: expected links without loss, or ask `stability point` for one number of peers at a time"
    )]
    Ages {
        /// The name of the law.
        strategy: &'static str,
    },
    /// A law remembers numbers whose unit is a gain that varies.
    #[error("the coordination remembers numbers whose unit is a gain that varies: ask `stability point` for single scenes")]
    Remembered,
    /// A body that is tied to ground varies.
    #[error("a body that an arm ties to ground varies: its step map is not monotone; keep its mass, damping and arm as they are")]
    TiedBody,
    /// A mass or damping varies, and clocks drift.
    #[error("a mass or damping varies and clocks drift: expected drift = 0")]
    Drift,
    /// Too many numbers vary.
    #[error(
        "{} numbers of the steps vary at once, {coefficients} of them coefficients of step maps of bodies: a damping makes four of each different body, a mass beside \
         a damping that stays two, and a mass without damping one; at most {most} can, so expected fewer keys that are masses and dampings, or peers with equal \
         bodies; `--curve` varies one of them", coefficients + others
    )]
    Numerous {
        /// Number of coefficients of step maps that vary.
        coefficients: usize,
        /// Number of gains and weights that vary.
        others: usize,
        /// Largest number of coefficients, gains and weights that may vary together.
        most: usize,
    },
}
