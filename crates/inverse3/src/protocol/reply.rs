//! Inventory and replies of the service. Both have one form; a reply usually leaves out the configuration of devices.

use serde_json::Value;

use crate::axes::{Triple, length};

/// Longest distance of a position from the origin of the device \[m\]. The arm of the device is shorter.
const FARTHEST: f64 = 1.0;
/// Greatest speed \[m/s\] of a hand, with room.
pub(crate) const FASTEST: f64 = 20.0;

/// Inventory or reply of the service.
#[derive(Clone, PartialEq, Debug)]
pub struct Reply {
    /// Number of the session, `None` if the service gives none.
    pub session: Option<u64>,
    /// Devices in the list `inverse3`.
    pub devices: Vec<Device>,
}

/// Device in a reply.
#[derive(Clone, PartialEq, Debug)]
pub struct Device {
    /// Id of the device.
    pub id: String,
    /// Configuration; `None` in a reply that leaves out the configuration.
    pub config: Option<Config>,
    /// Place, speed and force, or the flaw for which the reply has no meaning.
    pub state: Result<Kinematics, Flaw>,
    /// Readiness. A missing part counts as `false`.
    pub status: Status,
}

/// Configuration of a device, as far as readings and forces depend on the configuration.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Config {
    /// Preset of the coordinates.
    pub preset: Option<String>,
    /// Permutation of the axes; the service is taken to mean XYZ by `None`.
    pub basis: Option<String>,
    /// Mounting of the device, compared as a whole; null if the service gives none.
    pub mount: Value,
}

impl Config {
    /// Returns whether the axes are those of the device: X, Y, Z, not permuted and not mirrored.
    #[must_use]
    pub fn is_straight(&self) -> bool {
        self.basis.as_deref().is_none_or(|basis| basis == "XYZ")
    }
}

/// Place, speed and force of a device, in Haply's axes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Kinematics {
    /// Position of the cursor \[m\].
    pub position: Triple,
    /// Velocity of the cursor \[m/s\].
    pub velocity: Triple,
    /// Force that the service says to apply \[N\]; `None` if the service does not say.
    pub force: Option<Triple>,
    /// `true` if another program moves, turns or scales the coordinates of this session.
    pub is_transformed: bool,
}

/// Readiness of a device.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Status {
    /// `true` if the device knows its position.
    pub calibrated: bool,
    /// `true` if the service can command the device.
    pub ready: bool,
    /// `true` if the power supply is plugged in.
    pub power_supply: bool,
}

impl Status {
    /// Returns whether the device gives positions and takes forces.
    #[must_use]
    pub const fn is_ready(self) -> bool {
        self.calibrated && self.ready && self.power_supply
    }
}

/// Reason for which a reply is dropped.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Flaw {
    /// The text is not JSON.
    NotJson,
    /// The text has no list of devices, or a device without an id.
    NoDevices,
    /// The position is missing, or is not three numbers.
    NoPosition,
    /// The velocity is missing, or is not three numbers.
    NoVelocity,
    /// The position is more than 1 m from the origin of the device.
    Far,
    /// The velocity is above 20 m/s.
    Fast,
    /// The position changed faster than 20 m/s since the reading before.
    Jump,
}

impl Flaw {
    /// All flaws.
    pub const ALL: [Self; 7] = [Self::NotJson, Self::NoDevices, Self::NoPosition, Self::NoVelocity, Self::Far, Self::Fast, Self::Jump];

    /// Returns the name in a few words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::NotJson => "not JSON",
            Self::NoDevices => "no list of devices",
            Self::NoPosition => "no position",
            Self::NoVelocity => "no velocity",
            Self::Far => "position out of range",
            Self::Fast => "velocity out of range",
            Self::Jump => "position jumps",
        }
    }

    /// Returns the index in [`Flaw::ALL`].
    #[must_use]
    pub(crate) const fn index(self) -> usize {
        self as usize
    }
}

impl Reply {
    /// Returns the reply of the frame `text`. Never panics, whatever the text is.
    ///
    /// # Errors
    ///
    /// [`Flaw::NotJson`] or [`Flaw::NoDevices`]. Flaws of single devices are in [`Device::state`], because a fault of a device that belongs to another program
    /// concerns nobody here.
    pub fn read(text: &str) -> Result<Self, Flaw> {
        let value: Value = serde_json::from_str(text).map_err(|_| Flaw::NotJson)?;
        let devices = value.get("inverse3").and_then(Value::as_array).ok_or(Flaw::NoDevices)?;
        let devices = devices.iter().map(device).collect::<Option<_>>().ok_or(Flaw::NoDevices)?;
        Ok(Self { session: value.get("session_id").and_then(Value::as_u64), devices })
    }
}

fn device(value: &Value) -> Option<Device> {
    let flag = |key: &str| value.get("status").and_then(|status| status.get(key)?.as_bool()).unwrap_or(false);
    let text = |config: &Value, path: &str| config.pointer(path).and_then(Value::as_str).map(str::to_owned);
    let config = value.get("config").filter(|config| config.is_object()).map(|config| Config {
        preset: text(config, "/preset"),
        basis: text(config, "/basis/permutation"),
        mount: config.get("mount").cloned().unwrap_or_default(),
    });
    Some(Device {
        id: value.get("device_id")?.as_str()?.to_owned(),
        config,
        state: kinematics(value.get("state")),
        status: Status { calibrated: flag("calibrated"), ready: flag("ready"), power_supply: flag("power_supply") },
    })
}

fn kinematics(state: Option<&Value>) -> Result<Kinematics, Flaw> {
    let position = triple(state, "cursor_position").ok_or(Flaw::NoPosition)?;
    let velocity = triple(state, "cursor_velocity").ok_or(Flaw::NoVelocity)?;
    if !(0.0..=FARTHEST).contains(&length(position)) {
        return Err(Flaw::Far);
    }
    if !(0.0..=FASTEST).contains(&length(velocity)) {
        return Err(Flaw::Fast);
    }
    let is_transformed = !state.and_then(|state| state.get("transform")).is_none_or(is_identity);
    Ok(Kinematics { position, velocity, force: triple(state, "current_cursor_force"), is_transformed })
}

/// Returns the numbers x, y and z of the entry `key`. An integer is a number, null is none.
fn triple(state: Option<&Value>, key: &str) -> Option<Triple> {
    let vector = state?.get(key)?;
    let part = |axis: &str| vector.get(axis)?.as_f64();
    Some([part("x")?, part("y")?, part("z")?])
}

/// Returns whether a transform changes nothing. The service leaves out parts that change nothing.
fn is_identity(transform: &Value) -> bool {
    const PARTS: [(&str, &[(&str, f64)]); 3] = [
        ("position", &[("x", 0.0), ("y", 0.0), ("z", 0.0)]),
        ("rotation", &[("x", 0.0), ("y", 0.0), ("z", 0.0), ("w", 1.0)]),
        ("scale", &[("x", 1.0), ("y", 1.0), ("z", 1.0)]),
    ];
    // The service computes in single precision, in which a turn there and back leaves 1e-7.
    let near = |part: &Value, axis: &str, expected: f64| {
        part.get(axis).is_none_or(|found| found.as_f64().is_some_and(|found| (found - expected).abs() < 1e-6))
    };
    transform.is_null()
        || (transform.is_object()
            && PARTS
                .iter()
                .all(|(name, axes)| transform.get(name).is_none_or(|part| axes.iter().all(|(axis, expected)| near(part, axis, *expected)))))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A reply of a device in the form of the documentation, with `change` made to the text.
    fn reply(from: &str, to: &str) -> Result<Reply, Flaw> {
        let text = r#"{"session_id":176,"inverse3":[{"device_id":"04C3","config":{"preset":"arm_front_centered","basis":{"permutation":"XYZ"},"mount":{}},
            "state":{"cursor_position":{"x":0.127,"y":0,"z":-0.05},"cursor_velocity":{"x":-0.0001,"y":1e-5,"z":2},"mode":"idle",
            "current_cursor_force":{"x":0,"y":0.5,"z":0},"transform":{"rotation":{"x":0,"y":0,"z":0,"w":1}}},
            "status":{"calibrated":true,"in_use":false,"power_supply":true,"ready":true,"started":true}}],"verse_grip":[],"wireless_verse_grip":[]}"#;
        assert!(from.is_empty() || text.contains(from), "{from}");
        Reply::read(&if from.is_empty() { text.to_owned() } else { text.replacen(from, to, 1) })
    }

    fn state(from: &str, to: &str) -> Result<Kinematics, Flaw> {
        reply(from, to).unwrap().devices[0].state
    }

    #[test]
    fn replies_of_the_documentation_are_read() {
        let Reply { session, devices } = reply("", "").unwrap();
        assert_eq!((session, devices.len()), (Some(176), 1));
        let Device { id, config, state, status } = &devices[0];
        assert_eq!((id.as_str(), status.is_ready()), ("04C3", true));
        let config = config.as_ref().unwrap();
        assert_eq!((config.preset.as_deref(), config.is_straight()), (Some("arm_front_centered"), true));
        let expected =
            Kinematics { position: [0.127, 0.0, -0.05], velocity: [-0.0001, 1e-5, 2.0], force: Some([0.0, 0.5, 0.0]), is_transformed: false };
        assert_eq!(*state, Ok(expected));
    }

    #[test]
    fn missing_parts_have_their_flaws() {
        assert_eq!(Reply::read("{\"inverse3\":["), Err(Flaw::NotJson));
        for text in ["{}", "[]", "3", r#"{"inverse3":{}}"#, r#"{"inverse3":[{}]}"#, r#"{"inverse3":[{"device_id":3}]}"#] {
            assert_eq!(Reply::read(text), Err(Flaw::NoDevices), "{text}");
        }
        assert_eq!(Reply::read(r#"{"inverse3":[]}"#).unwrap().devices, []);
        assert_eq!(state("cursor_position", "cursor"), Err(Flaw::NoPosition));
        assert_eq!(state("0.127", "null"), Err(Flaw::NoPosition));
        assert_eq!(state("0.127", "\"0.127\""), Err(Flaw::NoPosition));
        assert_eq!(state("cursor_velocity", "speed"), Err(Flaw::NoVelocity));
        assert_eq!(state("0.127", "1.01"), Err(Flaw::Far));
        assert_eq!(state("\"z\":2", "\"z\":20.1"), Err(Flaw::Fast));
        // Beyond the range of a double, JSON is not read at all.
        assert_eq!(reply("\"z\":2", "\"z\":1e999"), Err(Flaw::NotJson));
        assert_eq!(state("current_cursor_force", "force").unwrap().force, None);
    }

    #[test]
    fn a_transform_is_the_identity_unless_a_part_says_otherwise() {
        for identity in ["{}", "null", r#"{"position":{"x":0,"y":0,"z":0},"scale":{"x":1.0}}"#] {
            assert!(!state(r#"{"rotation":{"x":0,"y":0,"z":0,"w":1}}"#, identity).unwrap().is_transformed, "{identity}");
        }
        for turned in
            [r#"{"rotation":{"x":0.1,"w":0.995}}"#, r#"{"scale":{"x":2}}"#, r#"{"position":{"z":0.01}}"#, r#"{"scale":{"x":null}}"#, "[]", "1"]
        {
            assert!(state(r#"{"rotation":{"x":0,"y":0,"z":0,"w":1}}"#, turned).unwrap().is_transformed, "{turned}");
        }
        assert!(!reply("XYZ", "XZY").unwrap().devices[0].config.as_ref().unwrap().is_straight());
        assert!(!reply("\"ready\":true", "\"ready\":0").unwrap().devices[0].status.is_ready());
    }

    #[test]
    fn every_flaw_has_its_own_place() {
        for (place, flaw) in Flaw::ALL.into_iter().enumerate() {
            assert_eq!(flaw.index(), place);
        }
    }
}
