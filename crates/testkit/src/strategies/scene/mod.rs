//! Scenes of coordination at random, which shrink to the calmest one on which a test still fails.
//!
//! [`any_scene`] draws scenes of 2 to 6 peers, [`scenes_like`] those whose links are within [`LinkBounds`]. An [`AnyScene`] is shown as TOML text
//! that can be saved as a scene file. The scenes may be unstable.
//!
//! ```
//! use cohaptic_testkit::proptest::test_runner::{TestCaseError, TestError, TestRunner};
//! use cohaptic_testkit::strategies::scene::any_scene;
//!
//! // Whatever it is that fails with a loss somewhere.
//! let failure = TestRunner::deterministic().run(&any_scene(), |scene| {
//!     let loses = scene.network().links().any(|(_, _, link)| link.config().loss.mean() > Some(0.0));
//!     if loses { Err(TestCaseError::fail("lost")) } else { Ok(()) }
//! });
//! let Err(TestError::Fail(_, scene)) = failure else { panic!("nothing is ever lost") };
//! assert_eq!(scene.draft().peers.len(), 2);
//! assert_eq!(scene.draft().links[0].keys, r#"netem = "loss 0.1%""#);
//! assert!(scene.to_toml().contains(r#"coordination = { strategy = "#));
//! ```
//!
//! # Shrinking
//!
//! As for [networks](super#shrinking), in this order:
//!
//! 1. *Fewer peers*, down to as few as may be drawn; the links of those that stay, stay.
//! 2. *Fewer sections*: walls, the object's start, the integrator, the object's damping; of each peer what its hand does, its contact, start, clock, compute
//!    delay and phase.
//! 3. *Fewer links*, then *fewer stages* of links.
//! 4. *Plainer forms*: one axis; an arm to a constant force, a sine to a constant force; then stages of links.
//! 5. *Plainer numbers*: towards those of [`Draft::calm`] (an object of 0.45 kg, 1000 N/m, and so on), a duration of 100 ms and a sample a tick, then those of
//!    links. In between, those of few digits.

mod draft;
mod draw;
mod knobs;
mod space;

use core::fmt;
use core::ops::RangeInclusive;
use std::sync::Arc;

use cohaptic_scene::{Scene, SceneError};
use proptest::strategy::{NewTree, Strategy, ValueTree};
use proptest::test_runner::TestRunner;

use super::any::{Networks, checked};
use super::bounds::LinkBounds;
use super::grid::Dice;
use super::network::ImpairedNetwork;
use super::shrink::Search;
use super::space::{LinkSpace, NetworkSpace};
pub use draft::{Draft, DraftHand, DraftLink, DraftPeer, Place, contact_to_toml};
use space::SceneSpace;

/// A scene at random. `Display` and `Debug` are its TOML text.
#[derive(Clone, PartialEq)]
pub struct AnyScene {
    /// Without links.
    draft: Draft,
    network: ImpairedNetwork,
}

impl AnyScene {
    /// The scene file.
    #[must_use]
    pub fn to_toml(&self) -> String {
        self.draft().to_toml()
    }

    /// The scene as a draft, its links in the words of netem.
    #[must_use]
    pub fn draft(&self) -> Draft {
        let mut draft = self.draft.clone();
        let name = |node: cohaptic_wan::NodeId| draft.peers.get(node.index()).map(|peer| peer.name.clone());
        let link = |(from, to, link): (_, _, &super::ImpairedLink)| {
            Some(DraftLink { from: name(from)?, to: name(to)?, keys: format!("netem = \"{link}\"") })
        };
        draft.links = self.network.impaired().filter_map(link).collect();
        draft
    }

    /// The links between the peers, in their order.
    #[must_use]
    pub const fn network(&self) -> &ImpairedNetwork {
        &self.network
    }

    /// Reads the text as a scene file is read.
    ///
    /// # Errors
    ///
    /// None for what was drawn; the type is that of the reader.
    pub fn read(&self) -> Result<Scene, SceneError> {
        self.draft().read()
    }
}

impl fmt::Display for AnyScene {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.to_toml())
    }
}

impl fmt::Debug for AnyScene {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "\n{self}")
    }
}

/// Any scene: [`scenes_like`] with 2 to 6 peers and [`LinkBounds::any`].
pub fn any_scene() -> Scenes {
    scenes_like(2..=6, LinkBounds::any())
}

/// Scenes of that number of peers with such links.
///
/// # Panics
///
/// With less than 2 or more than 100 peers, or if the bounds make no sense; [`LinkBounds::check`] gives an error instead.
#[track_caller]
pub fn scenes_like(peers: RangeInclusive<usize>, bounds: LinkBounds) -> Scenes {
    let (least, most) = (*peers.start(), *peers.end());
    assert!(2 <= least && least <= most && most <= 100, "scenes of {least} to {most} peers: expected a range within 2 to 100");
    Scenes { least, most, bounds: checked(bounds) }
}

/// Scenes at random: see [`scenes_like`].
#[derive(Clone, Debug)]
#[must_use = "strategies do nothing unless used"]
pub struct Scenes {
    least: usize,
    most: usize,
    bounds: Arc<LinkBounds>,
}

impl Strategy for Scenes {
    type Tree = Box<dyn ValueTree<Value = AnyScene>>;
    type Value = AnyScene;

    fn new_tree(&self, runner: &mut TestRunner) -> NewTree<Self> {
        let mut dice = Dice(runner.rng());
        let peers = self.least + usize::try_from(dice.below((self.most - self.least + 1) as u64)).unwrap_or(0);
        let draft = draw::draft(peers, &mut dice);
        let network = Networks::within(peers, &self.bounds).new_tree(runner)?.current();
        let scene = AnyScene { draft, network };
        scene.read().map_err(|error| error.to_string())?;
        let space = SceneSpace { least: self.least, network: NetworkSpace(LinkSpace(Arc::clone(&self.bounds))) };
        Ok(Box::new(Search::new(space, scene)))
    }
}
