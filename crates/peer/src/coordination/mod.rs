//! Coordination: the force between the copies of the shared object.
//!
//! A [`Law`] is one function of the knowledge of a peer, in any [`Number`](crate::Number). Runs, runs in parallel lanes and the linear response of the
//! stability analysis use the same function. A new law is a file in this folder and a line in the [registry](Coordination). A [`Strategy`] is the interface
//! called by a [`Peer`](crate::Peer). Every law is a strategy, and so is a controller, which is simulated but is not a law.

mod average_position;
mod client_server;
mod extrapolated;
mod law;
mod law_strategy;
mod local_damping;
mod local_lag;
mod passivity_control;
mod past;
mod proportional_derivative;
pub(crate) mod registry;
mod session;
mod set_position;
mod smoothed_average_position;
pub(crate) mod strategy;
mod wave;

pub use average_position::AveragePosition;
pub use client_server::{ClientServer, Felt};
pub use extrapolated::Extrapolated;
pub use law::{Coefficients, Law, LawForm, LawParameter, LawParameters, LawValue, LawValues, LawVisitor, Observation, Pull, UsedGains};
pub use law_strategy::LawStrategy;
pub use local_damping::LocalDamping;
pub use local_lag::LocalLag;
pub use passivity_control::PassivityControl;
pub use proportional_derivative::ProportionalDerivative;
pub use registry::{BuiltIn, BuiltInStrategy, LawSettings};
pub use session::SessionParameters;
pub use set_position::SetPosition;
pub use smoothed_average_position::SmoothedAveragePosition;
pub use strategy::{Prediction, Role};
pub use wave::Wave;

use law::LawKind;
use registry::Coordination;
use strategy::{Command, Context, Strategy};
