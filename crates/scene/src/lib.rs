//! Scene files: from TOML text to a checked [`Scene`].
//!
//! Use this crate if your program reads scene files.
//!
//! A scene file names the peers, the shared object, the coordination that keeps the copies of the object together, and the network between the peers.
//! This crate reads the file, fills in every default and refuses contradictions: a [`Scene`] that exists can be run. Every refusal is a [`SceneError`] that
//! names file, line, column and key, shows the line, and says what was expected.
//!
//! The crate does not run a scene and prints nothing. The fields of a [`Scene`] hold gains as written; [`Scene::peer_config`] returns the parts of a peer
//! with every scaling applied.
//!
//! Read [`Scene::parse`] first, then [`Scene`]. The document, its faults and the links are types of `cohaptic-linkfile`.
//!
//! ```
//! use std::path::Path;
//! use cohaptic_scene::Scene;
//!
//! let text = r#"
//!     scene        = { duration = "7s", count = 2 }
//!     object       = { mass = 0.3 }
//!     coordination = { strategy = "average-position", stiffness = 1000.0, update = "8ms" }
//!     peer         = { device = { mass = 0.1 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
//!     link         = { delay = "24ms" }
//! "#;
//! let scene = Scene::parse(text, Path::new("two.toml"), &["peers.peer2.contact=none".to_owned()])?;
//! assert_eq!(scene.peers[1].name, "peer2");
//!
//! let error = Scene::parse(&text.replace("24ms", "24 parsecs"), Path::new("two.toml"), &[]).unwrap_err();
//! assert!(error.to_string().starts_with("two.toml:6:30: link.delay: unknown unit \"parsecs\""));
//! # Ok::<(), cohaptic_scene::SceneError>(())
//! ```

mod assembly;
mod content;
mod context;
mod expect;
mod judged;
mod link_keys;
mod measures;
mod model;
mod oldest_sample;
mod operators;
mod path;
mod quantities;
mod read;
mod rotation;
mod rotation_parts;
pub mod schema;
mod sections;
mod strategies;
mod strategy_limits;
mod task;
#[cfg(test)]
mod tests;
mod topology;

pub use cohaptic_linkfile::{Diagnostic, FileError as SceneError, Fingerprint, KeysOfLinks, LinkChange, LinkKeys, LinkSelector, LinkTable};
pub use content::{SceneContent, scene_content, scene_content_of_text, scene_text};
pub use expect::{Bounds, Expect, ExpectDelay, ExpectLoss, ExpectMeasure, ExpectOrientation, ExpectPosition, ExpectTask, ExpectTravel};
pub use link_keys::{link_key_changes_of_text, link_keys, link_keys_of_text};
pub use measures::{Measure, MeasureName, Scope};
pub use model::*;
pub use path::{Leave, PathTask};
pub use read::{at_peer, scene_files};
pub use rotation::{DeviceRotationSpec, PeerRotation, RotationSpec};
pub use rotation_parts::{RotationPart, RotationParts};
pub use strategies::{FromScene, Strategies};
pub use task::{Carry, Gap, Hold, Judged, Reach, Target, TargetOrder, TaskEnd, TaskKind, TaskOutcome, TaskSpec, Track};
pub use topology::{Topology, TopologyKind, WeightsError, read_weights};
