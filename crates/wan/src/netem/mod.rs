//! The words of `tc-netem`, and the described links: as written, and with the behaviour of the Linux kernel.
//!
//! The module has three parts:
//!
//! - [`Netem`]: the options in the words. [`Netem::parse`] reads words as `tc` of iproute2 6.6 does (without `tc qdisc … netem`), refuses nonsense with
//!   [an error that points at the word](NetemError::excerpt), and `Display` prints words that read back to the same value. One option is not of `tc`: `cross`,
//!   packets of other senders.
//! - [`Netem::to_link_config`]: a link with exactly the behaviour of the words.
//! - [`kernel`]: the behaviour of Linux 6.6 with the same words, draw for draw. The kernel often differs from the words: `loss 1% 25%` loses 0.00015 %.
//!
//! ```
//! use cohaptic_wan::netem::{LossSpec, Netem};
//!
//! let netem = Netem::parse("delay 24ms 2ms distribution normal loss 1% 25%")?;
//! let Some(LossSpec::Random(loss)) = &netem.loss else { panic!("a random loss was said") };
//! assert_eq!(loss.percent.fraction(), 0.01);
//! assert_eq!(netem.to_string(), "delay 24ms 2ms distribution normal loss 1% 25%");
//!
//! let words = "delay 24ms loss 250%";
//! let error = Netem::parse(words).expect_err("more than everything");
//! assert_eq!(error.excerpt(words), "delay 24ms loss 250%\n                ^^^^ expected a percentage from 0 to 100");
//! # Ok::<(), cohaptic_wan::netem::NetemError>(())
//! ```

mod cross;
mod error;
mod exact;
pub mod kernel;
pub(crate) mod kernel_link;
mod number;
mod parse;
mod percent;
mod print;
mod rules;
mod spec;

pub use cross::{CrossSource, CrossSpec};
pub use error::{NetemError, NetemErrorKind};
pub use exact::ExactError;
pub use percent::Percent;
pub use rules::Contradiction;
pub use spec::{
    CellSpec, ChanceSpec, DelaySpec, Distribution, FramingSpec, GemodelSpec, JitterSpec, LossSpec, Netem, RateSpec, ReorderSpec, SlotGap, SlotSpec,
    StateSpec, TableName,
};

#[cfg(test)]
mod tests;
