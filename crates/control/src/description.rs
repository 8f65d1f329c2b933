//! What does not change while a run lasts: names.

use serde::Serialize;

/// The run, in names. The numbers of a [`Snapshot`](crate::Snapshot) stand in the same order.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Description {
    /// Which command runs.
    pub kind: Kind,
    /// The title of the run: the name of a scene, or an address.
    pub title: String,
    /// The links. Their places are the numbers by which they are asked for.
    pub links: Vec<LinkName>,
    /// The participants, or none.
    pub peers: Vec<PeerName>,
    /// The clocks whose lateness is measured, such as `"tick of left"` or `"release"`.
    pub clocks: Vec<String>,
}

/// The command that runs.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// A scene in wall time.
    Live,
    /// Datagrams of programs that know nothing of it.
    Relay,
    /// Whole packets between networks.
    Router,
}

impl Kind {
    /// Its name, as it is written on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Live => "live",
            Self::Relay => "relay",
            Self::Router => "router",
        }
    }
}

/// A link in names.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize)]
pub struct LinkName {
    /// The link itself, such as `"left->right"`; no other link has it.
    pub name: String,
    /// Where it begins.
    pub from: String,
    /// Where it ends.
    pub to: String,
}

/// A participant in names.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize)]
pub struct PeerName {
    /// No other participant has it.
    pub name: String,
    /// What it is, in a word or two, such as `"simulated Falcon"`.
    pub kind: String,
}
