//! Library of links with a name: each link with the sources of its numbers, the way from the sources to the numbers, and what is not modelled.
//!
//! A profile is one file in `profiles/`, in both directions: `down` towards the user, `up` away from the user. A version of a profile never changes, so that
//! a test which names a profile stays what it is. A bare name is version 1. This module reads the files and answers questions about them; `link/profile.rs` lays
//! the keys of a link over those of a profile.

mod name;
mod read;

use std::collections::BTreeMap;
use std::sync::Arc;

use cohaptic_wan::LinkModel;

use crate::document::Node;
use crate::reading::Modulators;

pub use name::{NameError, ProfileName};

/// Name, version and file of a profile.
type File<'a> = (&'a str, u32, &'a str);

/// Files of all profiles: profiles with sources first, then tables of tools. A further version of a profile follows its earlier versions.
const FILES: [File<'static>; 23] = [
    ("3g", 1, include_str!("profiles/3g.toml")),
    ("5g-walking", 1, include_str!("profiles/5g-walking.toml")),
    ("cable", 1, include_str!("profiles/cable.toml")),
    ("dsl", 1, include_str!("profiles/dsl.toml")),
    ("geo-satellite", 1, include_str!("profiles/geo-satellite.toml")),
    ("lte-driving", 1, include_str!("profiles/lte-driving.toml")),
    ("starlink", 1, include_str!("profiles/starlink.toml")),
    ("transatlantic", 1, include_str!("profiles/transatlantic.toml")),
    ("wifi-busy", 1, include_str!("profiles/wifi-busy.toml")),
    ("apple/3g", 1, include_str!("profiles/apple-3g.toml")),
    ("apple/edge", 1, include_str!("profiles/apple-edge.toml")),
    ("devtools/3g", 1, include_str!("profiles/devtools-3g.toml")),
    ("devtools/slow-4g", 1, include_str!("profiles/devtools-slow-4g.toml")),
    ("devtools/fast-4g", 1, include_str!("profiles/devtools-fast-4g.toml")),
    ("wpt/2g", 1, include_str!("profiles/wpt-2g.toml")),
    ("wpt/3g", 1, include_str!("profiles/wpt-3g.toml")),
    ("wpt/3g-fast", 1, include_str!("profiles/wpt-3g-fast.toml")),
    ("wpt/3g-slow", 1, include_str!("profiles/wpt-3g-slow.toml")),
    ("wpt/4g", 1, include_str!("profiles/wpt-4g.toml")),
    ("wpt/cable", 1, include_str!("profiles/wpt-cable.toml")),
    ("wpt/dsl", 1, include_str!("profiles/wpt-dsl.toml")),
    ("wpt/edge", 1, include_str!("profiles/wpt-edge.toml")),
    ("wpt/lte", 1, include_str!("profiles/wpt-lte.toml")),
];

/// Direction of a link of a profile.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Direction {
    /// Towards the user.
    Down,
    /// Away from the user.
    Up,
}

impl Direction {
    /// Both directions.
    pub const BOTH: [Self; 2] = [Self::Down, Self::Up];

    /// Returns the word for the direction in names: `down` or `up`.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Down => "down",
            Self::Up => "up",
        }
    }
}

/// Grade of a number, from the best to the worst.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Grade {
    /// Fitted from open data, whose hash and command stand beside the number.
    A,
    /// Computed from published figures.
    B,
    /// Assumed, wholly or in a part.
    C,
    /// Taken from the table of a tool. Nobody measured a link.
    Preset,
}

impl Grade {
    /// Words of files and answers for the grades, each with its meaning.
    pub const WORDS: [(&'static str, Self, &'static str); 4] = [
        ("A", Self::A, "fitted from open data"),
        ("B", Self::B, "computed from published figures"),
        ("C", Self::C, "assumed, wholly or in a part"),
        ("preset", Self::Preset, "the table of a tool, not measured"),
    ];

    /// Returns the word for the grade.
    #[must_use]
    pub fn word(self) -> &'static str {
        self.row().0
    }

    /// Returns the meaning of the grade.
    #[must_use]
    pub fn meaning(self) -> &'static str {
        self.row().2
    }

    fn row(self) -> (&'static str, Self, &'static str) {
        Self::WORDS.into_iter().find(|(_, grade, _)| *grade == self).expect("the table has a row for each grade")
    }
}

/// Profile of the library.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Profile {
    /// Name without version and direction, such as `starlink` or `wpt/cable`.
    pub name: String,
    /// Version, from 1.
    pub version: u32,
    /// Link that the profile models, in words.
    pub what: String,
    /// Place of the measurement. Empty if no source names a place.
    pub place: String,
    /// Time of the measurement. Empty if no source names a time.
    pub when: String,
    /// Way from the sources to the numbers.
    pub method: String,
    /// Properties of the real link without a key.
    pub not_modelled: Vec<String>,
    /// Sources by the names that [`Reason::sources`] uses.
    pub sources: BTreeMap<String, Source>,
    /// The link towards the user.
    pub down: Line,
    /// The link away from the user.
    pub up: Line,
    /// Modulators of both directions as TOML, in the order of the file.
    pub chains: Vec<String>,
    /// Modulators of both directions, as read from [`chains`](Self::chains).
    pub(crate) modulators: Arc<Modulators>,
}

/// Source of numbers.
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub struct Source {
    /// Authors, title, where and when it appeared, and where it can be found.
    pub cite: String,
    /// Kind of reading: `source` for the source itself, `transcription` for somebody's copy of its figures, `computed` for arithmetic, `recalled` for figures
    /// whose source was not found again.
    pub read: String,
    /// Licence of the data of the source, and what of the data is used here.
    pub licence: String,
}

/// Link of a profile in one direction.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Line {
    /// Keys of the link, as under `[link]` of a scene.
    pub(crate) keys: Node,
    /// Reason for each key, by the key's name. The keys in the states of a modulator have their reasons under the same names.
    pub reasons: BTreeMap<String, Reason>,
    /// Range of a number between one link and another, from the 10th to the 90th percentile, by key. This is no jitter: one link does not move in the range.
    pub between: BTreeMap<String, [String; 2]>,
}

/// Reason for the number of a key.
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub struct Reason {
    /// Grade of the knowledge about the number.
    pub grade: Grade,
    /// Names of sources in [`Profile::sources`]. Empty for an assumption.
    pub sources: Vec<String>,
    /// Way from the sources to the number.
    pub how: String,
}

impl Profile {
    /// Returns the name with the version: `starlink@1`.
    #[must_use]
    pub fn title(&self) -> String {
        format!("{}@{}", self.name, self.version)
    }

    /// Returns the link of one direction.
    #[must_use]
    pub const fn line(&self, direction: Direction) -> &Line {
        match direction {
            Direction::Down => &self.down,
            Direction::Up => &self.up,
        }
    }

    /// Returns whether both directions are equal.
    #[must_use]
    pub fn is_symmetric(&self) -> bool {
        self.down.keys() == self.up.keys()
    }

    /// Returns the worst grade of delay, rate and loss in both directions.
    #[must_use]
    pub fn grade(&self) -> Grade {
        // The other keys, such as the order of packets, are assumptions in nearly all profiles and would make every grade the same.
        let of = |line: &Line| {
            line.reasons.iter().filter(|(key, _)| ["delay", "rate", "loss"].contains(&key.as_str())).map(|(_, reason)| reason.grade).max()
        };
        // Grades are ordered from the best to the worst. A profile without any of the three keys has nothing that a source could support.
        of(&self.down).max(of(&self.up)).unwrap_or(Grade::C)
    }
}

impl Line {
    /// Returns each key of the link with its value as TOML, in the order of the file.
    #[must_use]
    pub fn keys(&self) -> Vec<(&str, String)> {
        self.keys
            .as_table()
            .map_or_else(Vec::new, |table| table.0.iter().map(|entry| (entry.name.as_str(), crate::document::value_text(&entry.node))).collect())
    }
}

/// Returns all profiles of the library, in all versions: first those with sources, then the tables of tools, each group by name.
pub fn profiles() -> impl Iterator<Item = Profile> {
    FILES.iter().map(|(name, _, text)| read::profile(name, text))
}

/// Returns the names of all profiles, in the order of [`profiles`].
pub fn names() -> impl Iterator<Item = &'static str> {
    // Every profile has a first version.
    FILES.iter().filter(|(_, version, _)| *version == 1).map(|(name, ..)| *name)
}

/// Returns the first version of the profile with a name, without version and direction. `None` if the library has no such profile.
#[must_use]
pub fn profile(name: &str) -> Option<Profile> {
    find(&FILES, name, 1)
}

fn find(files: &[File<'_>], name: &str, version: u32) -> Option<Profile> {
    files.iter().find(|(known, number, _)| (*known, *number) == (name, version)).map(|(name, _, text)| read::profile(name, text))
}

/// Returns the name of the library that `given` may mean; `None` if no name is near. Version and direction of `given` do not count.
#[must_use]
pub fn nearest(given: &str) -> Option<&'static str> {
    let bare = Direction::BOTH
        .iter()
        .fold(given, |name, direction| name.strip_suffix(direction.word()).and_then(|name| name.strip_suffix('/')).unwrap_or(name));
    // The version stands before the direction, so that the cut comes after the direction is gone.
    let bare = bare.split('@').next().unwrap_or(bare);
    crate::reading::nearest(&names().collect::<Vec<_>>(), bare)
}

/// Beginning of the names of the modulators of profiles. The names of the modulators of a file have no space, so that no file has such a name.
const OWN: &str = "profile ";

/// Returns the name of a modulator of a profile, whose name is in the file of the profile.
pub(crate) fn modulator_name(profile: &str, version: u32, modulator: &str) -> String {
    format!("{OWN}{profile}@{version} {modulator}")
}

/// Returns the access line `link` of the peer `owner`. A modulator of a profile is the peer's own then: the uplink and the downlink of a peer change state
/// together, and those of two peers apart. Any other link is returned unchanged.
#[must_use]
pub fn of_owner(link: Arc<LinkModel>, owner: &str) -> Arc<LinkModel> {
    match &*link {
        // A modulator of the user's file keeps its name: several peers that name it are meant to change state together.
        LinkModel::Modulated(modulated) if modulated.modulator().name().starts_with(OWN) => {
            let name = format!("{} of {owner}", modulated.modulator().name());
            Arc::new(LinkModel::Modulated(modulated.with_modulator_name(&name)))
        }
        LinkModel::Fixed(_) | LinkModel::Modulated(_) | LinkModel::Replay(_) | LinkModel::Kernel(_) => link,
    }
}
