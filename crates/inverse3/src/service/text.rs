//! Texts of inventory and replies.

use serde_json::Value;

use crate::axes::{Triple, to_haply};
use crate::protocol::{Format, PRESET};

/// Middle of the workspace, from the base of the device, in Haply's axes \[m\]. Made up.
pub const MIDDLE: Triple = [0.0, 0.18, 0.16];

/// Parts of a reply.
#[derive(Clone, Copy, Debug)]
pub(super) struct Text<'a> {
    pub(super) format: Format,
    pub(super) session: u64,
    /// Id of the device; `None` for an empty list.
    pub(super) device: Option<&'a str>,
    /// Position of the grip from the middle, in the axes of a scene \[m\]; `None` leaves out the field.
    pub(super) position: Option<Triple>,
    /// Velocity of the grip, in the axes of a scene \[m/s\]; `None` leaves out the field.
    pub(super) velocity: Option<Triple>,
    /// Force of the motors, in the axes of a scene \[N\].
    pub(super) force: Triple,
    /// `true` for coordinates from the middle of the workspace, `false` for coordinates from the base.
    pub(super) is_centred: bool,
    /// `true` for permuted axes.
    pub(super) is_turned: bool,
    /// `true` for a transform of the session.
    pub(super) is_transformed: bool,
    pub(super) is_ready: bool,
    /// `true` to write the configuration.
    pub(super) is_full: bool,
}

impl Text<'_> {
    pub(super) fn write(&self) -> String {
        let device = self.device.map(|id| self.device(id)).unwrap_or_default();
        format!("{{\"session_id\":{},\"inverse3\":[{device}],\"verse_grip\":[],\"wireless_verse_grip\":[]}}", self.session)
    }

    fn device(&self, id: &str) -> String {
        let Self { position, velocity, force, is_ready, .. } = self;
        let offset = if self.is_centred { [0.0; 3] } else { MIDDLE };
        let place = |place: &Triple| {
            let vector = to_haply(*place);
            core::array::from_fn(|axis| vector[axis] + offset[axis])
        };
        let mut state: Vec<String> = Vec::new();
        state.extend(position.as_ref().map(|position| format!("\"cursor_position\":{}", self.vector(place(position)))));
        state.extend(velocity.map(|velocity| format!("\"cursor_velocity\":{}", self.vector(to_haply(velocity)))));
        // A quarter of a turn about the vertical.
        let rotation = if self.is_transformed { "\"x\":0,\"y\":0,\"z\":0.70710677,\"w\":0.70710677" } else { "\"x\":0,\"y\":0,\"z\":0,\"w\":1" };
        state.push(format!("\"mode\":\"idle\",\"control_mode\":\"force\",\"transform\":{{\"rotation\":{{{rotation}}}}}"));
        if self.format == Format::V35 {
            state.push(format!("\"current_cursor_force\":{}", self.vector(to_haply(*force))));
        }
        let config = if self.is_full { self.config(id) } else { String::new() };
        let id = Value::from(id);
        let status = format!("\"calibrated\":true,\"in_use\":false,\"power_supply\":true,\"ready\":{is_ready},\"started\":true");
        format!("{{\"device_id\":{id},{config}\"state\":{{{}}},\"status\":{{{status}}}}}", state.join(","))
    }

    fn config(&self, id: &str) -> String {
        let basis = if self.is_turned { "XZY" } else { "XYZ" };
        let origin = match (self.format, self.is_centred) {
            (Format::V31, _) => "\"coordinate_origin\":\"device_base\"".to_owned(),
            (Format::V35, true) => format!("\"preset\":\"{PRESET}\",\"mount\":{{}}"),
            (Format::V35, false) => "\"preset\":\"arm_front\",\"mount\":{}".to_owned(),
        };
        let id = Value::from(id);
        format!(
            "\"config\":{{\"type\":\"inverse3\",\"device_info\":{{\"id\":{id}}},\"handedness\":\"right\",\"basis\":{{\"permutation\":\"{basis}\"}},{origin}}},"
        )
    }

    /// Returns a vector in single precision, as the service computes.
    #[expect(clippy::cast_possible_truncation, reason = "the precision of the service")]
    fn vector(&self, [x, y, z]: Triple) -> String {
        let [y, z] = if self.is_turned { [z, y] } else { [y, z] };
        format!("{{\"x\":{},\"y\":{},\"z\":{}}}", x as f32, y as f32, z as f32)
    }
}
