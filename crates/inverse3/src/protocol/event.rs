//! Events of the service, from a second WebSocket.

use serde_json::Value;

/// Event that concerns the force of a device. The service names the device by its id.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Event {
    /// The device was lost.
    Disconnected(String),
    /// The emergency brake locks the device.
    Braked(String),
    /// The emergency brake was released.
    Released(String),
    /// A motor stalled.
    Stalled(String),
}

impl Event {
    /// Returns the event of the frame `text`. `None` for an event without a part in forces, and for a text without a known form.
    #[must_use]
    pub fn read(text: &str) -> Option<Self> {
        let value: Value = serde_json::from_str(text).ok()?;
        let device = || value.pointer("/data/device_id")?.as_str().map(str::to_owned);
        match value.get("name")?.as_str()? {
            "device-disconnected" => device().map(Self::Disconnected),
            "device-safety-triggered" => match value.pointer("/data/safety_type")?.as_str()? {
                "ebrake_triggered" => device().map(Self::Braked),
                "ebrake_released" => device().map(Self::Released),
                "stall_detected" => device().map(Self::Stalled),
                _ => None,
            },
            _ => None,
        }
    }

    /// Returns the event as the text of a frame.
    #[must_use]
    pub fn write(&self) -> String {
        let (name, level, safety, id) = match self {
            Self::Disconnected(id) => ("device-disconnected", "warning", None, id),
            Self::Braked(id) => ("device-safety-triggered", "error", Some("ebrake_triggered"), id),
            Self::Released(id) => ("device-safety-triggered", "notice", Some("ebrake_released"), id),
            Self::Stalled(id) => ("device-safety-triggered", "warning", Some("stall_detected"), id),
        };
        let safety = safety.map(|safety| format!(",\"safety_type\":\"{safety}\"")).unwrap_or_default();
        let id = Value::from(id.as_str());
        format!("{{\"name\":\"{name}\",\"category\":\"device\",\"level\":\"{level}\",\"data\":{{\"device_id\":{id}{safety}}},\"message\":\"\"}}")
    }

    /// Returns the id of the device.
    #[must_use]
    pub fn device(&self) -> &str {
        match self {
            Self::Disconnected(id) | Self::Braked(id) | Self::Released(id) | Self::Stalled(id) => id,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_come_back_as_they_were_written() {
        let id = || "04C3".to_owned();
        for event in [Event::Disconnected(id()), Event::Braked(id()), Event::Released(id()), Event::Stalled(id())] {
            assert_eq!(Event::read(&event.write()), Some(event.clone()), "{event:?}");
            assert_eq!(event.device(), "04C3");
        }
    }

    #[test]
    fn other_events_are_none() {
        let other = r#"{"name":"device-safety-triggered","level":"info","data":{"device_id":"049D","safety_type":"fod_stage_changed"}}"#;
        for text in [other, r#"{"name":"device-connected","data":{"device_id":"049D"}}"#, "{}", "", "[]", r#"{"name":"device-disconnected"}"#] {
            assert_eq!(Event::read(text), None, "{text}");
        }
    }
}
