//! Configuration of a client.

use core::time::Duration;

use cohaptic_device::{Limits, LimitsError};
use thiserror::Error;

use crate::axes::Triple;

/// Largest force that a scene may ask for \[N\]. The largest force of the device is not published; other programs clip at 2 N an axis and at 10 N.
pub const MOST_FORCE: f64 = 10.0;

/// Selection of a device in the list of a service.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Which {
    /// The device at this place of the list, from 0, devices with the ids `besides` left out.
    Place {
        /// Place in the list.
        place: usize,
        /// Ids of devices for other peers.
        besides: Vec<String>,
    },
    /// The device with this id.
    Id(String),
}

impl Which {
    /// The first device of the list.
    pub const FIRST: Self = Self::Place { place: 0, besides: Vec::new() };
}

/// Configuration of a client.
#[derive(Clone, PartialEq, Debug)]
pub struct ClientConfig {
    /// Device to use. A chosen device is kept: after a new connection, another device does not take its place.
    pub which: Which,
    /// Origin of the scene in the coordinates of the device, in Haply's axes \[m\]. `None`: the middle of the workspace, which needs a service of 3.5 or later.
    pub origin: Option<Triple>,
    /// Limits of forces.
    pub limits: Limits,
    /// Time from one exchange to the next in the scene. A reply that takes longer counts as late.
    pub exchange: Duration,
    /// Distance from the origin within which the cursor arms the device \[m\].
    pub arming_distance: f64,
    /// Time within `arming_distance` after which forces go out.
    pub arming_time: Duration,
}

impl ClientConfig {
    /// Default values: the first device, the middle of the workspace, 2 N, an exchange each millisecond, and forces after 200 ms within 20 mm of the origin.
    pub const DEFAULT: Self = Self {
        which: Which::FIRST,
        origin: None,
        limits: Limits { force: 2.0, ..Limits::DEFAULT },
        exchange: Duration::from_millis(1),
        arming_distance: 0.020,
        arming_time: Duration::from_millis(200),
    };

    /// Sets the exchange, and age of a reading and gap of the loop after the exchange: the larger of the default and three exchanges. `age` replaces the age.
    #[must_use]
    pub fn exchanging(mut self, exchange: Duration, age: Option<Duration>) -> Self {
        self.exchange = exchange;
        let three = exchange.saturating_mul(3);
        self.limits.reading_age = age.unwrap_or_else(|| Limits::DEFAULT.reading_age.max(three));
        // A loop that waits for each reply has no shorter period than the exchange.
        self.limits.gap = Limits::DEFAULT.gap.max(three);
        self
    }

    /// Returns the configuration if all numbers are within their ranges.
    ///
    /// # Errors
    ///
    /// [`ClientConfigError`] with the first number out of range.
    pub(super) fn checked(self) -> Result<Self, ClientConfigError> {
        self.limits.checked()?;
        if self.limits.force > MOST_FORCE {
            return Err(ClientConfigError::Force(self.limits.force));
        }
        // `contains` is false for NaN.
        if self.origin.is_some_and(|origin| !origin.iter().all(|part| (-1.0..=1.0).contains(part))) {
            return Err(ClientConfigError::Origin);
        }
        if !(0.0..=1.0).contains(&self.arming_distance) || self.arming_time > Duration::from_secs(60) {
            return Err(ClientConfigError::Arming);
        }
        Ok(self)
    }
}

/// Error of a configuration with a number out of range.
#[derive(Clone, Copy, PartialEq, Debug, Error)]
#[expect(missing_docs, reason = "the messages describe the variants")]
#[non_exhaustive]
pub enum ClientConfigError {
    #[error(transparent)]
    Limits(#[from] LimitsError),
    #[error("the limit of force is {0} N, above 10 N: what the device bears is not published")]
    Force(f64),
    #[error("the origin is more than 1 m from the origin of the device")]
    Origin,
    #[error("the device arms within more than 1 m, or after more than a minute")]
    Arming,
}
