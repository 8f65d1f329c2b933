//! Proofs about the stability of scenes: verdicts that hold for whole sets of scenes, and for every behaviour of the network and of the contacts.
//!
//! Use this crate if you ask from Rust for more than the verdict on one scene, which [`cohaptic_stability`] gives: whether every scene of a box of gains and
//! delays is stable, or the scene with every number of peers; how fast a disturbance can grow under any losses in a row; whether contacts that open and close
//! make a stable scene unstable. Each finding is checked with bounds of all rounding errors. Certificates hold the numbers by which a reader can repeat the
//! check.
//!
//! ```
//! use cohaptic_proofs::{Guarantee, prove_every_number};
//! use cohaptic_scene::Scene;
//! use cohaptic_stability::Unwatched;
//!
//! let text = r#"
//!     scene = { duration = "1s", count = 3 }
//!     object = { mass = 0.45, split-mass = false }
//!     coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
//!     peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
//!     link = { delay = "8ms" }
//! "#;
//! let proof = prove_every_number(&Scene::parse(text, "three.toml".as_ref(), &[])?, 2, None, &Unwatched)?;
//! let spans: Vec<_> = proof.spans.iter().map(|span| (span.from, span.to, span.guarantee)).collect();
//! assert_eq!(spans, [(2, None, Guarantee::Stable)]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod boxes;
mod inequality;
mod newton;
#[cfg(test)]
#[path = "../../stability/src/paper_scene.rs"]
mod paper_scene;
mod switching;
mod worst_case;

pub use boxes::{
    BoxCertificate, EveryNumber, FrameState, FreeCircle, Guarantee, KnownPieces, MOST_FOLLOWED, MOST_HALVINGS, MomentCertificate, Nearness,
    NumberCertificate, NumberProof, NumberSpan, Openness, PartCertificate, ProofError, ProvenBox, ProvenLine, ProvenRegion, ProvenStretch,
    SharedProof, TopologyCertificate, prove_every_number,
};
pub use switching::{GrowingMotion, PushCertificate, Switching, SwitchingCertificate, SwitchingError, SwitchingMotion, prove_switching};
pub use worst_case::{
    AutomatonError, Effort, Links, PatternError, Patterns, SceneWorstCase, SceneWorstCaseError, WorstPart, WorstVerdict, worst_case,
    worst_case_watched,
};
