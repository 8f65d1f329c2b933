//! Messages of a program to the service.

use serde_json::Value;

use super::{Format, PRESET};
use crate::axes::Triple;

/// Message of a program to the service. The service answers each message by a reply.
#[derive(Clone, PartialEq, Debug)]
pub struct Request {
    /// Device of force and preset; `None` for a message without both.
    pub device: Option<String>,
    /// Force on the hand \[N\], in Haply's axes.
    pub force: Option<Triple>,
    /// `true` to ask for coordinates with the origin in the middle of the workspace.
    pub centred: bool,
    /// `true` to ask for the configuration of devices in the reply.
    pub full: bool,
}

impl Request {
    /// Returns the message that only asks for a reply with the configuration of devices.
    pub const INVENTORY: Self = Self { device: None, force: None, centred: false, full: true };

    /// Returns the message as the text of a frame.
    #[must_use]
    pub fn write(&self, format: Format) -> String {
        let mut parts = Vec::new();
        if let Some(device) = &self.device {
            let mut entry = format!("{{\"device_id\":{}", Value::from(device.as_str()));
            if self.centred {
                entry += &format!(",\"configure\":{{\"preset\":{{\"preset\":\"{PRESET}\"}}}}");
            }
            if let Some([x, y, z]) = self.force {
                let key = format.force_key();
                entry += &format!(",\"commands\":{{\"set_cursor_force\":{{\"{key}\":{{\"x\":{x},\"y\":{y},\"z\":{z}}}}}}}");
            }
            parts.push(format!("\"inverse3\":[{entry}}}]"));
        }
        if self.full {
            parts.push("\"session\":{\"force_render_full_state\":{}}".to_owned());
        }
        format!("{{{}}}", parts.join(","))
    }

    /// Returns the message of the frame `text`, as a service of `format` takes the message: unknown keys are ignored. `None` if the text is not JSON.
    #[must_use]
    pub fn read(text: &str, format: Format) -> Option<Self> {
        let value: Value = serde_json::from_str(text).ok()?;
        let entry = value.get("inverse3").and_then(|list| list.get(0));
        let device = entry.and_then(|entry| entry.get("device_id")?.as_str()).map(str::to_owned);
        let vector = entry.and_then(|entry| entry.pointer("/commands/set_cursor_force")?.get(format.force_key()));
        let part = |axis: &str| vector.and_then(|vector| vector.get(axis)?.as_f64());
        let force = part("x").zip(part("y")).zip(part("z")).map(|((x, y), z)| [x, y, z]);
        let preset = entry.and_then(|entry| entry.pointer("/configure/preset/preset")?.as_str());
        let centred = format == Format::V35 && preset == Some(PRESET);
        let full = format == Format::V35 && value.pointer("/session/force_render_full_state").is_some();
        Some(Self { device, force, centred, full })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_are_written_in_the_words_of_the_documentation() {
        let device = || Some("04C3".to_owned());
        let force = Request { device: device(), force: Some([1.0, -3.0, 0.5]), centred: false, full: false };
        assert_eq!(
            force.write(Format::V35),
            r#"{"inverse3":[{"device_id":"04C3","commands":{"set_cursor_force":{"vector":{"x":1,"y":-3,"z":0.5}}}}]}"#
        );
        assert!(force.write(Format::V31).contains(r#""values":{"x":1,"#));
        let first = Request { device: device(), force: None, centred: true, full: true };
        assert_eq!(
            first.write(Format::V35),
            r#"{"inverse3":[{"device_id":"04C3","configure":{"preset":{"preset":"arm_front_centered"}}}],"session":{"force_render_full_state":{}}}"#
        );
        assert_eq!(Request::INVENTORY.write(Format::V35), r#"{"session":{"force_render_full_state":{}}}"#);
    }

    #[test]
    fn a_service_reads_what_a_program_writes() {
        for full in [false, true] {
            let request = Request { device: Some("a \"b\"".to_owned()), force: Some([1e-9, -0.25, 3.0]), centred: full, full };
            assert_eq!(Request::read(&request.write(Format::V35), Format::V35), Some(request.clone()));
            // A service before 3.5 knows neither presets nor `vector`, and says nothing about both.
            let old = Request::read(&request.write(Format::V35), Format::V31);
            assert_eq!(old, Some(Request { force: None, centred: false, full: false, ..request }));
        }
        assert_eq!(Request::read("{", Format::V35), None);
        let missing = r#"{"inverse3":[{"device_id":"A","commands":{"set_cursor_force":{"vector":{"x":1,"y":null,"z":0}}}}]}"#;
        assert_eq!(Request::read(missing, Format::V35).unwrap().force, None);
    }
}
