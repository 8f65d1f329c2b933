//! The answers of the commands: results of runs, checks, verdicts, campaigns and other work as values, as JSON documents, as text for people and as pictures.
//!
//! Use this crate if your program answers as `cohaptic --json` does: the command line and the Python package take their documents from this crate.
//!
//! [`run()`] is the document of a run, [`explanation()`] of the model of a scene. [`check()`] checks the expectations of a scene. [`methods()`] lists the
//! methods selectable in a scene, and [`measure()`] measures the cost and the error of each. [`map_picture()`], [`boundary_picture()`] and
//! [`admittance_picture()`] draw analyses. [`document!`] makes a document.
//!
//! The other commands have a module each, with a function `document` for the JSON document and a function `words` for the text: [`campaign`], [`compare`],
//! [`mod@link`], [`fit`], [`point`], [`map`], [`boundary`] and [`admittance`]. Five of these have a function `html` for a [`page`] too. [`shards`] has the
//! answers about work shared by several processes.
//!
//! The crate reads no clock and prints nothing: [`measure()`] takes the clock as an argument.
//!
//! ```
//! use cohaptic_answers::run;
//! use cohaptic_harness::{Model, NoObserver, Simulation};
//! use cohaptic_scene::Scene;
//!
//! let text = r#"
//!     scene = { duration = "1s", count = 2 }
//!     object = { mass = 0.45 }
//!     coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
//!     peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
//! "#;
//! let scene = Scene::parse(text, "two.toml".as_ref(), &[])?;
//! let summary = Simulation::new(&scene, Model::Least).run(&mut NoObserver)?;
//! let document = serde_json::to_value(run(&scene, &summary, &[], None, None))?;
//! assert_eq!(document["ticks"], 1000);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![expect(non_camel_case_types, reason = "`document!` makes a type parameter of each key")]

pub mod admittance;
pub mod boundary;
pub mod campaign;
mod check;
pub mod compare;
mod explanation;
pub mod fit;
pub mod library;
pub mod link;
pub mod map;
mod methods;
pub mod page;
mod parts;
mod pictures;
pub mod point;
mod run;
pub mod shards;
mod text_plot;
mod verdict;
mod words;

pub use check::{Answered, OutcomeDocument, check};
pub use explanation::{explanation, explanation_with_costs};
pub use methods::{Kind, Measured, MeasuredMethod, MeasurementWatch, Method, cost_picture, error_in_words, measure, methods};
pub use parts::{link, links_and_distances, measures_of, motion, peer};
pub use pictures::{AdmittanceCurve, NamedMap, admittance_picture, axis_of, boundary_picture, map_picture};
pub(crate) use pictures::{AdmittanceWords, admittance_words, axis_of_key, crossing_in_words, label};
pub use run::{angle_text, diverged, measured_lines, packets, run, run_words, task_of};
pub use text_plot::TEXT_PLOT_SPANS;
pub(crate) use text_plot::text_plot;
pub use verdict::{OPERATIONS_A_SECOND, notes};
pub(crate) use words::LAW;
pub use words::{are, figure, legend_name, length};
