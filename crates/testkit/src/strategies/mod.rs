//! Strategies of proptest: links and networks that shrink to the least impaired one on which a test still fails.
//!
//! [`any_hits`] draws packets that are [hit](crate::hit). [`any_link`] and [`any_network`] draw any, [`links_like`] and [`networks_like`] those within [`LinkBounds`]. What a failing test prints can be pasted back:
//! an [`ImpairedLink`] is shown as the words of `tc-netem`, an [`ImpairedNetwork`] as such words for each link that is not ideal.
//!
//! ```
//! use cohaptic_testkit::proptest::prelude::*;
//! use cohaptic_testkit::strategies::{any_link, any_network};
//!
//! proptest! {
//!     // In a test module: #[test]
//!     fn whatever_the_link_my_program_copes(link in any_link(), network in any_network(3)) {
//!         prop_assert!(link.stages().len() <= 8 && network.hosts() == 3);
//!     }
//! }
//! # whatever_the_link_my_program_copes();
//! ```
//!
//! proptest stands in [`crate::proptest`]: a package needs no dependency but this one.
//!
//! # Shrinking
//!
//! One impairment is one [`Stage`]. `delay 10ms` is one, `delay 10ms 2ms` is one, jitter, and so is `delay 10ms reorder 25%`, reordering: both are nothing
//! without the delay, so it is theirs. `delay 10ms 2ms reorder 25%` is two. Shrinking asks in this order, and keeps to what still fails:
//!
//! 1. *Fewer links*: all links of the network to ideal ones at once, then the first half of them and the second, the halves of what could not go, and so on to
//!    single links. By a link's number that is: the links of `a` first.
//! 2. *Fewer stages*: the stages of all links that are left, in the same way, those of a link in the order of the words.
//! 3. *Plainer stages*, link by link. Reordering becomes its delay alone; jitter becomes its delay, jitter without correlation, or without a
//!    distribution. Bursts become random loss that loses as much, else loss without correlation, chains with fewer probabilities that lose as much, or two
//!    states in place of four. Corruption, duplication and reordering lose their correlation, reordering its gap. Slots lose their distribution, get a fixed
//!    length, and lose their limits.
//! 4. *Smaller numbers*, link by link: jitter, delay, loss, corruption, duplication, reordering, rate, limit, slots, each towards the end of its range
//!    that impairs least: the upper end for rate and limit, the lower one for all others. That end comes first, then those of one significant digit by bisection,
//!    then those of two; more digits only if the number drawn has more and none rounder fails. So it ends at `loss 3%`, `delay 11ms`, `rate 1500kbit`.
//!
//! If anything went, it begins again at 1, where each number is now tried a step at a time, and what has been tried is not tried again, until nothing goes. A stage
//! that [`LinkBounds::always`] asks for stays, and whatever is tried is within the bounds. A few dozen runs of the test are usual:
//!
//! ```
//! use std::time::Duration;
//! use cohaptic_testkit::proptest::test_runner::{TestCaseError, TestError, TestRunner};
//! use cohaptic_testkit::strategies::{ImpairedNetwork, any_network};
//!
//! // A program that cannot stand 20 ms on any link.
//! let failure = TestRunner::deterministic().run(&any_network(4), |network| {
//!     let is_late = network.links().any(|(_, _, link)| link.config().delay.mean() >= Duration::from_millis(20));
//!     if is_late { Err(TestCaseError::fail("too late")) } else { Ok(()) }
//! });
//! let Err(TestError::Fail(_, network)) = failure else { panic!("it stands everything") };
//! assert_eq!(network.impaired().map(|(_, _, link)| link.to_string()).collect::<Vec<_>>(), ["delay 20ms"]);
//! assert_eq!(network.stages(), 1);
//! ```
//!
//! In a strategy of your own, combined by `prop_map`, tuples and the like, links shrink in the same way.

mod admits;
mod any;
mod bounds;
mod bounds_error;
mod draw;
mod forms;
mod grid;
mod hits;
mod link;
mod network;
mod numbers;
#[cfg(feature = "scenes")]
pub mod scene;
mod shrink;
mod space;
mod stage;
mod units;

pub use any::{Links, Networks, any_link, any_network, links_like, networks_like};
pub use bounds::{LinkBounds, LossModel};
pub use bounds_error::BoundsError;
pub use hits::{PacketSets, any_hits};
pub use link::{ImpairedLink, LinkError};
pub use network::{ImpairedNetwork, NetworkTextError};
pub use stage::Stage;
