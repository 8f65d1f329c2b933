//! State of a device as a client shows it: phase, reading, force.

use core::fmt;

use cohaptic_device::Reading;
use cohaptic_units::Instant;

use crate::protocol::Version;

/// Phase of a device.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Phase {
    /// There is no connection to the service, or the service has said nothing yet.
    #[default]
    Connecting,
    /// The service does not list the device.
    NoDevice,
    /// The device is not calibrated, not ready, or has no power supply.
    NotReady,
    /// Another program has changed the axes.
    Turned,
    /// The emergency brake locks the device, or a motor has stalled.
    Braked,
    /// The cursor has not been near the origin for long enough.
    Disarmed,
    /// Forces go out.
    Active,
    /// The device cannot be used with this configuration.
    Refused(Refusal),
    /// The device was stopped.
    Stopped,
}

impl Phase {
    /// Returns the name in a few words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Connecting => "connecting",
            Self::NoDevice => "no device",
            Self::NotReady => "not ready",
            Self::Turned => "axes turned",
            Self::Braked => "braked",
            Self::Disarmed => "disarmed",
            Self::Active => "active",
            Self::Refused(_) => "refused",
            Self::Stopped => "stopped",
        }
    }

    /// Returns what the user can do to reach the phase `Active`, or an empty text.
    #[must_use]
    pub const fn hint(self) -> &'static str {
        match self {
            Self::Connecting => "start Haply's Inverse Service",
            Self::NoDevice => "plug the device in",
            Self::NotReady => "calibrate the device, and plug its power supply in",
            Self::Turned => "end the program that changes the axes, such as a profile of Haply's Hub",
            Self::Braked => "release the emergency brake",
            Self::Disarmed => "hold the cursor still at the origin",
            Self::Active | Self::Refused(_) | Self::Stopped => "",
        }
    }
}

/// Reason why a device cannot be used with a configuration.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Refusal {
    /// The service did not take the preset, so that the origin of the coordinates is unknown. The version, if the service told one.
    NoPreset(Option<Version>),
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self::NoPreset(version) = self;
        write!(f, "the service")?;
        if let Some(version) = version {
            write!(f, ", version {version},")?;
        }
        write!(f, " does not put the origin into the middle of the workspace, as services from 3.5 on do: give the origin (inverse3.origin)")
    }
}

impl core::error::Error for Refusal {}

/// State of a client.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Snapshot {
    /// Time of the snapshot, on the clock of the client.
    pub at: Instant,
    /// Phase of the device.
    pub phase: Phase,
    /// Newest reading, from the origin, in the axes of a scene, and the instant of its message. `None` while no device answers. May be older than the limit.
    pub reading: Option<(Reading, Instant)>,
    /// `true` if the newest reading is younger than the limit.
    pub is_fresh: bool,
    /// Force of the latest message, in the axes of a scene \[N\].
    pub force: [f64; 3],
}

impl Snapshot {
    /// Returns the reading for a peer: `None` unless the device is armed, and its reading fresh.
    #[must_use]
    pub fn for_peer(&self) -> Option<Reading> {
        self.reading.filter(|_| self.phase == Phase::Active && self.is_fresh).map(|(reading, _)| reading)
    }
}
