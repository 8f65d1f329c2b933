//! Parameters of operators. Every number is finite and in the stated range. The caller that makes a parameter checks this.

use core::time::Duration;

use super::ticks;

/// A model of a person who does a task: what the person sees, and the law of the hand.
#[derive(Clone, PartialEq, Debug)]
pub struct OperatorConfig {
    /// Copy of the object that the person sees.
    pub sees: Seen,
    /// Time from an image to its use, τ.
    pub visual_delay: Duration,
    /// Law of the hand.
    pub law: OperatorLaw,
}

/// Copy of the object that a person sees.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Seen {
    /// The copy of the person's own peer.
    Own,
    /// The newest sample that the person's peer holds of the peer at this place of the session.
    Peer(usize),
}

/// Law by which a person moves the hand.
#[derive(Clone, PartialEq, Debug)]
pub enum OperatorLaw {
    /// Movements toward a target at rest, one after the other, each after a look at the result of the movement before.
    Moves(MovesConfig),
    /// Continuous tracking of a moving target: the velocity of the hand is proportional to the seen error (McRuer & Jex 1967).
    Crossover {
        /// Crossover frequency ωc \[rad/s\], above zero.
        frequency: f64,
    },
}

/// Parameters of movements.
#[derive(Clone, PartialEq, Debug)]
pub struct MovesConfig {
    /// Time until the first movement, and wait after a movement of which nothing came through.
    pub reaction: Duration,
    /// Least duration T of a movement, above zero.
    pub duration: Duration,
    /// Largest speed at the peak of a movement [m/s], above zero; `None` for no limit. A faster movement lasts longer.
    pub speed: Option<f64>,
    /// Largest length of a movement \[m\], above zero; `None` for no limit.
    pub step: Option<f64>,
    /// Standard deviation c of the end of a movement along each axis, over the length of the movement; at least zero.
    pub noise: f64,
    /// Weight of the newest movement in the estimated gain, from 0 to 1. 0 for a person who takes the gain for 1 and is never surprised.
    pub learns: f64,
    /// Delay expected by the person; `None` for the delay known to the driver.
    pub expects: Option<Duration>,
}

impl OperatorConfig {
    /// Returns the visual delay m in ticks, rounded up.
    #[must_use]
    pub fn visual_ticks(&self, tick: Duration) -> u64 {
        ticks(self.visual_delay, tick)
    }
}

impl OperatorLaw {
    /// Returns the name of the law, as written in scenes.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Moves(_) => "moves",
            Self::Crossover { .. } => "crossover",
        }
    }
}
