//! Stability and performance of a scene, without simulating it.
//!
//! Use this crate if you ask from Rust for which gains and delays a scene is stable, and how stiff or heavy it feels.
//!
//! One frame of a linear scene, from one common sampling to the next, multiplies its state by a constant matrix, the *monodromy matrix*. The scene is stable if
//! and only if every eigenvalue of that matrix is inside the unit circle, once the motion of everything together is left out: space has no origin. This crate
//! builds that matrix from the same plants and strategies that the simulator steps (lifting: Araki & Yamamoto 1986; Rakhsha & Constantinescu 2015, Section 3),
//! reduces it where peers are alike, and says how sure it is of the answer. The crate `cohaptic-proofs` stands above it and has verdicts on sets of scenes.
//!
//! ```
//! use cohaptic_scene::Scene;
//! use cohaptic_stability::{Method, Verdict, analyse};
//!
//! let text = r#"
//!     scene = { duration = "1s", count = 2 }
//!     object = { mass = 0.45 }
//!     coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
//!     peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
//!     link = { delay = "8ms" }
//! "#;
//! let verdict = |overrides: &[String]| -> Result<Verdict, Box<dyn std::error::Error>> {
//!     Ok(analyse(&Scene::parse(text, "two.toml".as_ref(), overrides)?, Method::Reduced)?.verdict())
//! };
//! assert_eq!(verdict(&[])?, Verdict::Stable);
//! assert_eq!(verdict(&["link.delay=24ms".to_owned()])?, Verdict::Unstable);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod admittance;
mod analyse;
mod analysis;
mod boundary;
mod combinations;
mod cost;
mod definite;
mod determinant;
mod error;
mod factorisation;
mod family;
pub mod frames;
mod full;
mod graph;
mod judgement;
mod kind;
mod lifted;
mod linear_form;
mod map;
mod matrix;
mod mean_square;
mod method;
pub mod moments;
mod monodromy;
mod network;
pub mod numerics;
mod operators;
#[cfg(test)]
mod paper_scene;
mod parts;
mod pieces;
mod radius;
mod rounding;
mod scene_radius;
mod spectrum;
mod stack_frame;
mod state_name;
mod structure;
mod timetable;
mod turning;
mod unseen;
mod watch;

pub use admittance::{Admittance, AdmittanceError, AdmittancePoint, Estimate, FrequencyResponse, LowFrequencyFit, PushedAxis, admittance, ideal};
pub use analyse::{analyse, analyse_loaded, analyse_spinning, analyse_watched, analyse_with};
pub use analysis::{ARMS_ALONE, Analysis, CHANGES_LEFT_OUT, ContactMode, TRACKED, UNLOADED};
pub use boundary::blocks::BoundaryBlock;
pub use boundary::{Boundary, BoundaryError, BoundaryOptions, Crossing, Stretch};
pub use cost::{MOST_MEMORY, PartCost};
pub use determinant::{DelayedLoop, DelayedLoopError, Kernel};
pub use error::AnalysisError;
pub use family::{Cell, Family, FamilyError, FamilyScratch, KeyRange, KeyRangeError};
pub use graph::{Graph, GraphError, analyse_on, analyse_on_watched};
pub use judgement::{Judgement, NOMINAL, has_chance, judge, judge_watched, left_out};
pub use kind::{Criterion, Kinds, VerdictKind, nominal_head};
pub use map::contour::Polyline;
pub use map::{Grid, Map, MapError, MapRow};
pub use matrix::{Dense, Matrix};
pub use mean_square::{MeanSquare, MeanSquareMethod, QUICK_UNKNOWNS, mean_square, mean_square_watched};
pub use method::Method;
pub use monodromy::{Monodromy, monodromy, monodromy_with};
pub use parts::{Part, PartKind};
pub use radius::{Radius, Verdict};
pub use spectrum::{bounded_radius, eigenvalues, radius, radius_small};
pub use state_name::{StateKind, StateName};
pub use watch::{Limits, Unwatched, Watch};

/// Runs the code of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
