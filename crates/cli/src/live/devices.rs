//! Devices in people's hands: opens the devices of a scene, makes the devices ready, and passes each to the session.

use std::path::Path;

use cohaptic_device::Device;
use cohaptic_realtime::Wishes;
use cohaptic_scene::{Scene, SceneError};

use super::exchanges::DeviceFacts;
use crate::failure::{self, Failure};

/// Kinds of peers with a device, each with the feature of cargo that drives the device, and whether this program was built with the feature.
const DRIVERS: [(&str, &str, bool); 2] = [("falcon", "falcon", cfg!(feature = "falcon")), ("inverse3", "inverse3", cfg!(feature = "inverse3"))];

/// Returns the error for the first peer of a scene with a device that this program cannot drive; `None` if there is no such peer.
pub(crate) fn undriven(scene: &Scene, overrides: &[String]) -> Option<SceneError> {
    scene.peers.iter().enumerate().find_map(|(place, peer)| {
        let kind = peer.kind.name();
        let (_, feature, _) = DRIVERS.iter().find(|(driven, _, is_here)| *driven == kind && !is_here)?;
        failure::at_peer_of(scene, overrides, place, &format!("a peer of kind {kind:?}: {}", failure::without_feature(feature)))
    })
}

/// Opened devices, indexed by peer. `None` for a peer without a device.
pub(crate) type Devices = Vec<Option<Box<dyn Device>>>;

/// Opens the devices of the scene, and waits until all simulated devices are ready. Returns the devices with handles to facts about the devices, or `None` if
/// the user asked for the end while waiting.
#[cfg_attr(not(all(feature = "falcon", feature = "inverse3")), allow(unused_mut, unused_variables, reason = "without drivers nothing is opened"))]
pub(crate) fn ready(scene: &Scene, firmware: Option<&Path>, wishes: Wishes) -> Result<Option<(Devices, DeviceFacts)>, Failure> {
    let mut devices: Devices = scene.peers.iter().map(|_| None).collect();
    let mut facts = DeviceFacts::default();
    #[cfg(feature = "falcon")]
    {
        let Some(mut falcons) = falcons::ready(scene, firmware, wishes)? else { return Ok(None) };
        for (place, device) in devices.iter_mut().enumerate() {
            *device = falcons.take(place);
        }
    }
    #[cfg(feature = "inverse3")]
    {
        let Some(mut inverse3s) = inverse3s::ready(scene, wishes)? else { return Ok(None) };
        facts.inverse3s = inverse3s.facts();
        for (place, device) in devices.iter_mut().enumerate().filter(|(_, device)| device.is_none()) {
            *device = inverse3s.take(place);
        }
    }
    Ok(Some((devices, facts)))
}

#[cfg(feature = "falcon")]
mod falcons {
    use std::path::Path;
    use std::thread;
    use std::time::{Duration, Instant as Clock};

    use cohaptic_falcon::boot;
    use cohaptic_live::falcons::{Falcons, SIMULATED_HOMING};
    use cohaptic_realtime::Wishes;
    use cohaptic_scene::Scene;

    use crate::failure::Failure;
    use crate::falcon::loading;
    use crate::interrupt;
    use crate::realtime::say;

    /// Opens the Falcons of the scene and waits until all simulated Falcons are homed by simulated hands. Returns `None` if the user asked for the end while
    /// waiting. Real Falcons are homed by their users during the session.
    pub(super) fn ready(scene: &Scene, firmware: Option<&Path>, wishes: Wishes) -> Result<Option<Falcons>, Failure> {
        let told = |peer: &str, progress: boot::Progress| {
            if let Some(said) = loading(progress) {
                say(&format!("the Falcon of {peer}: {said}"));
            }
        };
        let falcons = Falcons::open(scene, firmware, wishes, told).map_err(|fault| Failure::System(fault.to_string()))?;
        // A second signal ends the program without running destructors, so the motors are stopped by actions before the exit.
        for stopper in falcons.stoppers() {
            interrupt::before_exit(move || stopper.stop());
        }
        let names = |simulated: bool| -> Vec<&str> {
            falcons.readiness().filter(|(_, at)| at.is_simulated == simulated).map(|(peer, _)| scene.peers[peer].name.as_str()).collect()
        };
        let simulated = names(true);
        if !simulated.is_empty() {
            say(&format!("homing the simulated Falcons of {}", simulated.join(", ")));
            let start = Clock::now();
            while !falcons.simulated_are_ready() {
                if interrupt::requested() {
                    return Ok(None);
                }
                if start.elapsed() > SIMULATED_HOMING {
                    return Err(Failure::System(
                        "a simulated Falcon could not be homed: this machine is too slow to simulate it in real time".to_owned(),
                    ));
                }
                thread::sleep(Duration::from_millis(20));
            }
        }
        for peer in names(false) {
            say(&format!("the Falcon of {peer}: pull the grip fully out, push it fully in, pull it out again; {peer} joins when its light is green"));
        }
        Ok(Some(falcons))
    }
}

#[cfg(feature = "inverse3")]
mod inverse3s {
    use std::thread;
    use std::time::{Duration, Instant as Clock};

    use cohaptic_live::inverse3s::Inverse3s;
    use cohaptic_realtime::Wishes;
    use cohaptic_scene::Scene;

    use crate::failure::Failure;
    use crate::interrupt;
    use crate::realtime::say;

    /// Time limit for arming simulated devices. Arming takes 0.2 s; the limit allows for a busy machine.
    const ARMING: Duration = Duration::from_secs(60);

    /// Starts the drivers of the scene's Inverse3s and waits until simulated hands have armed all simulated devices. Returns `None` if the user asked for the end
    /// while waiting. Real devices are armed by their users during the session.
    pub(super) fn ready(scene: &Scene, wishes: Wishes) -> Result<Option<Inverse3s>, Failure> {
        let inverse3s = Inverse3s::open(scene, wishes).map_err(|fault| Failure::System(fault.to_string()))?;
        // A second signal ends the program without running destructors, so the forces are stopped by actions before the exit.
        for stopper in inverse3s.stoppers() {
            interrupt::before_exit(move || stopper.stop());
        }
        let begin = Clock::now();
        while !inverse3s.simulated_are_ready() {
            if interrupt::requested() {
                return Ok(None);
            }
            if begin.elapsed() > ARMING {
                return Err(Failure::System(
                    "a simulated Inverse3 could not be armed: this machine is too slow to simulate it in real time".to_owned(),
                ));
            }
            thread::sleep(Duration::from_millis(20));
        }
        for (peer, _) in inverse3s.readiness().filter(|(_, readiness)| !readiness.is_simulated) {
            let peer = &scene.peers[peer].name;
            say(&format!("the Inverse3 of {peer}: start Haply's Inverse Service, and hold the cursor at the origin for a moment; {peer} joins then"));
        }
        Ok(Some(inverse3s))
    }
}
