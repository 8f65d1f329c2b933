//! Strategies of proptest: links and networks that shrink to the least impaired links and networks on which a test still fails.
//!
//! [`any_hits`] draws packets that are [hit](crate::hit). [`any_link`] and [`any_network`] draw any links and networks; [`links_like`] and [`networks_like`]
//! stay within [`LinkBounds`], and `links_like("lte-driving")` draws links like one of the library (feature `files`). The output of a failing test can be
//! pasted into a test: an [`ImpairedLink`] is printed as the words of `tc-netem`, an [`ImpairedNetwork`] as such words for each link that is not ideal.
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
//! proptest is re-exported as [`crate::proptest`], so that a package needs no further dependency.
//!
//! # Shrinking
//!
//! An impairment is a [`Stage`]. `delay 10ms` is one stage. `delay 10ms 2ms` is one stage, jitter, and `delay 10ms reorder 25%` is one stage, reordering: both
//! need the delay, so the delay belongs to them. `delay 10ms 2ms reorder 25%` is two stages. Shrinking tries in this order, and keeps every change after which
//! the test still fails:
//!
//! 1. *Fewer NATs and links*: the NATs of hosts ([`Networks::behind_nats`]) go with the links. All links of the network become ideal at once, then the first
//!    half of them and the second half, then halves of those halves that had to stay, and so on down to single links. Links are sorted by sender, then receiver:
//!    the links of `a` come first.
//! 2. *Fewer stages*: the stages of all remaining links, in the same way. The stages of a link are in the order of the words.
//! 3. *Plainer stages*, link by link, after more open NATs: `strict` becomes `home`, `address`, and `open`. Reordering becomes its delay alone; jitter becomes
//!    its delay, jitter without correlation, or jitter without a distribution. Bursts become random loss with the same long-run loss, otherwise loss without
//!    correlation, chains with fewer probabilities and the same long-run loss, or two states in place of four. Corruption, duplication and reordering lose their
//!    correlation, and reordering its gap. Slots lose their distribution, get a fixed length, and lose their limits.
//! 4. *Smaller numbers*, link by link: jitter, delay, loss, corruption, duplication, reordering, rate, limit, slots. Each number goes towards the end of its
//!    range that impairs least: the upper end for rate and limit, the lower end for all others. That end is tried first, then numbers of one significant digit
//!    by bisection, then numbers of two digits. More digits are tried only if the number drawn has more, and no rounder number fails. Results are numbers such
//!    as `loss 3%`, `delay 11ms`, `rate 1500kbit`.
//!
//! If anything was accepted, the search begins again at 1, where each number is now tried a step at a time, until nothing changes. A value that was tried is
//! not tried again. A stage required by [`LinkBounds::always`] stays, and every value tried is within the bounds. A few dozen runs of the test are usual:
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
//! In strategies combined from these by `prop_map`, tuples and the like, links shrink in the same way.

mod admits;
mod any;
mod bounds;
mod bounds_error;
mod draw;
mod forms;
mod grid;
mod hits;
#[cfg(feature = "files")]
mod library;
mod link;
mod network;
mod numbers;
#[cfg(feature = "scenes")]
pub mod scene;
mod shrink;
mod space;
mod stage;
mod units;

pub use any::{Likeness, Links, Networks, any_link, any_network, links_like, networks_like};
pub use bounds::{LinkBounds, LossModel};
pub use bounds_error::BoundsError;
pub use hits::{PacketSets, any_hits};
#[cfg(feature = "files")]
pub use library::LibraryLinks;
pub use link::{ImpairedLink, LinkError};
pub use network::{ImpairedNetwork, NetworkTextError};
pub use stage::Stage;
