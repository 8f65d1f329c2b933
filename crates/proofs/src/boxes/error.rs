//! Reasons why nothing can be proven of a set of scenes.

use cohaptic_stability::{AnalysisError, FamilyError};

/// Why nothing can be proven of a set of scenes.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ProofError {
    /// The scene cannot be analysed.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// A scene of the family is refused.
    #[error(transparent)]
    Family(#[from] FamilyError),
    /// There are not two keys.
    #[error("expected two open keys for a region")]
    Keys,
    /// There is not one key.
    #[error("expected one open key for a line")]
    OneKey,
    /// A key does more than to set numbers.
    #[error(
        "{key} does more than to set gains, masses and dampings, or the delay of links, and between two of its values there is no box: vary it by `--curve`, or ask `stability map` without --prove"
    )]
    Key {
        /// The key.
        key: String,
    },
    /// A range of delays with too many frames.
    #[error("{key} has more than {most} delays of which each makes a frame of its own: expected a shorter range")]
    Stretches {
        /// The key.
        key: String,
        /// How many may.
        most: usize,
    },
    /// Gains or masses depend on the number of peers.
    #[error(
        "gains or the mass of a copy depend on the number of peers, and a box of keys holds no such: expected average-position coordination without scaling and object.split-mass = false; or one number at a time, by `--curve scene.count=N`"
    )]
    Scaled,
    /// A box of keys and numbers of peers, of scenes that are followed for one number alone.
    #[error(
        "{what}: a box of keys holds for the number of peers that the scene has; expected no --every-number, and one number at a time, by `--curve scene.count=N`"
    )]
    OneNumber {
        /// The coordination, or the topology.
        what: &'static str,
    },
    /// A certificate of scenes whose frames the checker does not derive.
    #[error(
        "{what} has no certificate, since the program that checks it does not follow that: expected no --certificate; the verdicts of --prove hold without"
    )]
    NoCertificate {
        /// As above.
        what: &'static str,
    },
    /// Walls with a law whose analyses leave them out.
    #[error(
        "with {strategy} coordination walls are left out of every analysis: expected a scene without object.enclosure for --prove; `stability map` and `boundary` without it say what they leave out"
    )]
    WallLeftOut {
        /// The name of the law.
        strategy: &'static str,
    },
    /// Waves over links or between clocks that differ.
    #[error(
        "waves are followed over equal links between peers whose clocks and phases are equal: expected such a scene; `stability point`, `map` and `boundary` follow the others, without --every-number and --prove"
    )]
    UnequalWaves,
    /// Numbers of peers that are none.
    #[error("expected numbers of peers from 2 on, the least first, such as 2.. or 2..100")]
    Numbers,
    /// Fewer peers than the scene has besides those that grow in number.
    #[error("fewer than {least} peers leave none of those that are equal: expected {least} and more")]
    Fewer {
        /// The least number.
        least: u64,
    },
    /// No two peers are equal.
    #[error("no two peers are equal over equal links, of which there could be more: expected some; `stability map` varies keys of a scene as it is")]
    Unequal,
    /// A device hangs on nothing, and nothing brings it to rest.
    #[error("the device of {peer} touches nothing and does not come to rest: expected a damping or a contact")]
    Loose {
        /// The first such peer.
        peer: String,
    },
    /// Something is left to chance.
    #[error(
        "links leave something to chance, and a guarantee is about one sequence of events: expected links without jitter and loss; `stability map` and `boundary` without --prove take the mean square, `stability point --losses-in-a-row` bounds all losses"
    )]
    Chance,
    /// Something is left to chance among peers that differ, or otherwise than independently.
    #[error(
        "links leave something to chance: expected equal peers over equal links that lose independently and on which nothing overtakes, for every number of them in the mean square; `stability point` without --every-number follows more"
    )]
    UnequalChance,
    /// A law uses the ages of samples, of which some are lost.
    #[error(
        "{strategy} coordination uses the ages of samples, which differ from link to link where some are lost: expected links without loss, or ask `stability point` for one number of peers at a time"
    )]
    Ages {
        /// Its name.
        strategy: &'static str,
    },
    /// Numbers that a law remembers are measured by gains.
    #[error("the coordination remembers numbers whose unit is a gain that varies: ask `stability point` for single scenes")]
    Remembered,
    /// A body that is tied to ground varies.
    #[error("a body that an arm ties to ground varies: its step map is not monotone; keep its mass, damping and arm as they are")]
    TiedBody,
    /// Bodies of clocks that drift vary.
    #[error("a mass or damping varies and clocks drift: expected drift = 0")]
    Drift,
    /// Too many numbers vary.
    #[error(
        "{} numbers of the steps vary at once, {coefficients} of them coefficients of step maps of bodies: a damping makes four of each different body, a mass beside \
         a damping that stays two, and a mass without damping one; at most {most} can, so expected fewer keys that are masses and dampings, or peers with equal \
         bodies; `--curve` varies one of them", coefficients + others
    )]
    Numerous {
        /// Coefficients of step maps that vary.
        coefficients: usize,
        /// Gains and weights that vary.
        others: usize,
        /// The number that may vary.
        most: usize,
    },
}
