//! Place of a device in the list of its service, its configuration, and its readings, as replies tell them.

use cohaptic_device::Reading;
use cohaptic_units::Instant;

use super::{Client, JITTER, LOOK, PAUSES, Refusal, Which};
use crate::axes::{length, to_scene};
use crate::protocol::{Config, Device, FASTEST, Flaw, Format, Kinematics, PRESET};

impl Client {
    /// Takes the own device of a list of devices, and returns the flaw of its state. `answered`: instant of the latest message, if the list is the reply to
    /// this message.
    pub(super) fn take(&mut self, now: Instant, own: Option<&Device>, answered: Option<Instant>) -> Option<Flaw> {
        self.is_listed = own.is_some();
        let Some(device) = own else {
            self.lose();
            if self.sent_force.iter().any(|part| *part != 0.0) {
                self.message(now);
            } else if self.exchanges.sent.is_none() {
                // The search for the device counts from the inventory.
                self.exchanges.sent = Some(now);
            }
            return None;
        };
        if let Some(config) = &device.config {
            self.look(now, config);
        }
        self.is_ready = device.status.is_ready();
        if !self.is_ready {
            self.lose();
        }
        let kinematics = match device.state {
            Ok(kinematics) => kinematics,
            Err(flaw) => return Some(flaw),
        };
        self.is_transformed = kinematics.is_transformed;
        if self.is_transformed {
            self.lose();
        }
        // An older reply tells of device and axes, and not of the place: the newest reply is on the way.
        let sent = answered.filter(|_| self.known.is_placed)?;
        self.read(now, sent, &kinematics)
    }

    /// Returns the own device of a list, chosen at the first list with a fitting device.
    pub(super) fn choose<'a>(&mut self, devices: &'a [Device]) -> Option<&'a Device> {
        if self.device.is_none()
            && let Which::Place { place, besides } = &self.config.which
        {
            self.device = devices.iter().map(|device| &device.id).filter(|id| !besides.contains(id)).nth(*place).cloned();
        }
        let own = self.device.as_ref()?;
        devices.iter().find(|device| device.id == *own)
    }

    /// Looks at the configuration of the device.
    fn look(&mut self, now: Instant, config: &Config) {
        self.known.looked = Some(now);
        if !self.known.is_placed {
            // A preset may have its own mounting: the mounting that counts is the one with the preset.
            self.known.mount = None;
        }
        let mount = self.known.mount.get_or_insert_with(|| config.mount.clone());
        self.known.is_straight = config.is_straight() && *mount == config.mount;
        if !self.known.is_straight {
            self.lose();
        }
        if let Some(asked) = self.known.asked.filter(|_| !self.known.is_placed) {
            let has_preset = config.preset.as_deref() == Some(PRESET);
            // A service may need a moment for a preset.
            if has_preset || now.saturating_duration_since(asked) >= LOOK {
                self.place_device(has_preset);
            }
        }
    }

    /// Makes the origin of the coordinates certain, or gives the device up.
    pub(super) fn place_device(&mut self, has_preset: bool) {
        // A service that tells no version is known by its preset, which services before 3.5 ignore.
        if self.version.is_none() && !has_preset {
            self.format = Format::V31;
        }
        if self.config.origin.is_none() && !has_preset {
            self.refusal = Some(Refusal::NoPreset(self.version));
            self.gate.stop();
            return self.leave();
        }
        self.known.is_placed = true;
        // A connection that works ends the search for a connection.
        self.pause = PAUSES[0];
    }

    /// Takes the reading of the newest reply. Returns the flaw of a jump.
    fn read(&mut self, now: Instant, sent: Instant, kinematics: &Kinematics) -> Option<Flaw> {
        let Kinematics { position, velocity, force, .. } = *kinematics;
        if let Some((before, at)) = self.place {
            let moved = length(core::array::from_fn(|axis| position[axis] - before[axis]));
            let passed = now.saturating_duration_since(at).saturating_add(JITTER);
            if moved > FASTEST * passed.as_secs_f64() {
                return Some(Flaw::Jump);
            }
        }
        self.place = Some((position, now));
        let origin = self.config.origin.unwrap_or_default();
        // The negative of zero would be shown as `-0`.
        let plain = |vector| to_scene(vector).map(|part| part + 0.0);
        let position = plain(core::array::from_fn(|axis| position[axis] - origin[axis]));
        let reading = Reading { position, velocity: plain(velocity) };
        // The instant at which the service read the device is unknown. The age counts from the message, because the service reads the device later.
        self.reading = Some((reading, sent));
        self.exchanges.note(now, sent, force.map(to_scene), self.config.exchange);
        if self.may_arm() {
            self.arming.read(now, &reading, &self.config, self.config.limits.reading_age);
        }
        None
    }

    /// Returns whether nothing but the hand hinders forces.
    pub(super) const fn may_arm(&self) -> bool {
        self.is_listed && self.is_ready && !self.is_transformed && !self.is_braked && self.known.is_straight
    }
}
