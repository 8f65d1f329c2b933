//! Random scenes of coordination, which shrink to the calmest scene on which a test still fails.
//!
//! [`any_scene`] draws scenes of 2 to 6 peers, [`scenes_like`] scenes with links within [`LinkBounds`]. An [`AnyScene`] is printed as the TOML text of a scene
//! file. The scenes may be unstable.
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
//! Scenes shrink like [networks](super#shrinking), in this order:
//!
//! 1. *Fewer peers*, down to the least number that may be drawn. The links of the remaining peers stay.
//! 2. *Fewer sections*: walls, start of the object, integrator, damping of the object; of each peer the activity of its hand, its contact, start, clock,
//!    compute delay and phase.
//! 3. *Fewer links*, then *fewer stages* of links.
//! 4. *Plainer forms*: one axis; an arm or a sine becomes a constant force; then stages of links.
//! 5. *Plainer numbers*: towards those of [`Draft::calm`] (an object of 0.45 kg, 1000 N/m, and so on), a duration of 100 ms and a sample per tick; then the
//!    numbers of links. Numbers of few digits are tried in between.

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

/// Random scene. `Display` and `Debug` print the TOML text.
#[derive(Clone, PartialEq)]
pub struct AnyScene {
    /// The scene without its links.
    draft: Draft,
    network: ImpairedNetwork,
}

impl AnyScene {
    /// Returns the text of the scene file.
    #[must_use]
    pub fn to_toml(&self) -> String {
        self.draft().to_toml()
    }

    /// Returns the scene as a draft, with its links in the words of netem.
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

    /// Returns the links between the peers. Peers are numbered in the order of the draft.
    #[must_use]
    pub const fn network(&self) -> &ImpairedNetwork {
        &self.network
    }

    /// Reads the text like a scene file.
    ///
    /// # Errors
    ///
    /// Never for a drawn scene. The type is the type of errors of the reader.
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

/// Draws any scene: [`scenes_like`] with 2 to 6 peers and [`LinkBounds::any`].
pub fn any_scene() -> Scenes {
    scenes_like(2..=6, LinkBounds::any())
}

/// Draws scenes with a number of peers from `peers`, and links within `bounds`.
///
/// # Panics
///
/// With less than 2 or more than 100 peers, or if the bounds make no sense; [`LinkBounds::check`] returns an error instead.
#[track_caller]
pub fn scenes_like(peers: RangeInclusive<usize>, bounds: LinkBounds) -> Scenes {
    let (least, most) = (*peers.start(), *peers.end());
    assert!(2 <= least && least <= most && most <= 100, "scenes cannot have {least} to {most} peers: expected a range within 2 to 100 peers");
    Scenes { least, most, bounds: checked(bounds) }
}

/// Strategy of scenes: see [`scenes_like`].
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
        // A scene that the reader refuses is no input: proptest then draws another scene.
        scene.read().map_err(|error| error.to_string())?;
        let space = SceneSpace { least: self.least, network: NetworkSpace(LinkSpace(Arc::clone(&self.bounds))) };
        Ok(Box::new(Search::new(space, scene)))
    }
}
