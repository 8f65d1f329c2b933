//! Devices in people's hands: opens the devices of a scene, makes the devices ready, and hands each to the session.

use std::path::Path;

use cohaptic_device::Device;
use cohaptic_realtime::Wishes;
use cohaptic_scene::{Scene, SceneError};

use crate::failure::{self, Failure};

/// Kinds of peers with a device, each with the feature of cargo that drives the device, and whether this program was built with the feature.
const DRIVERS: [(&str, &str, bool); 1] = [("falcon", "falcon", cfg!(feature = "falcon"))];

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

/// Opens the devices of the scene, and waits until all simulated devices are ready. Returns `None` if the user asked for the end while waiting.
#[cfg_attr(not(feature = "falcon"), allow(unused_mut, unused_variables, reason = "without drivers nothing is opened"))]
pub(crate) fn ready(scene: &Scene, firmware: Option<&Path>, wishes: Wishes) -> Result<Option<Devices>, Failure> {
    let mut devices: Devices = scene.peers.iter().map(|_| None).collect();
    #[cfg(feature = "falcon")]
    {
        let Some(mut falcons) = falcons::ready(scene, firmware, wishes)? else { return Ok(None) };
        for (place, device) in devices.iter_mut().enumerate() {
            *device = falcons.take(place);
        }
    }
    Ok(Some(devices))
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
