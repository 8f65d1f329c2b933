//! What happens before time begins.

use std::io::{self, Write as _};
use std::net::SocketAddr;
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant as Clock};

use cohaptic_falcon::boot::Progress;
use cohaptic_live::falcons::{Falcons, SIMULATED_HOMING};
use cohaptic_realtime::Wishes;
use cohaptic_scene::{PeerKind, Scene};
use cohaptic_units::print::Counted;
use cohaptic_units::visible_lines;

use crate::failure::Failure;
use crate::interrupt;
use crate::realtime::loading;

/// Opens the Falcons of the scene and waits until the hands of simulated ones have homed them; `None` if the user did not want to wait.
pub(super) fn ready_falcons(scene: &Scene, firmware: Option<&Path>, wishes: Wishes) -> Result<Option<Falcons>, Failure> {
    let told = |peer: &str, progress: Progress| {
        if let Some(said) = loading(progress) {
            say(&format!("the Falcon of {peer}: {said}"));
        }
    };
    let falcons = Falcons::open(scene, firmware, wishes, told).map_err(|fault| Failure::System(fault.to_string()))?;
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

/// Says where whom the session waits for is to send.
pub(super) fn announce(scene: &Scene, address: Option<SocketAddr>, has_key: bool) {
    let Some(address) = address else { return };
    let peers = scene.peers.iter().enumerate().filter(|(_, peer)| matches!(peer.kind, PeerKind::Udp(_)));
    let peers: Vec<String> = peers.map(|(place, peer)| format!("{} at place {place}", peer.name)).collect();
    let key = if has_key { "with its key" } else { "without a key" };
    say(&format!("listening on {address} for {}: session {}, {}, {key}", peers.join(", "), scene.seed, Counted(scene.axes.count(), "axis")));
}

fn say(line: &str) {
    // What cannot be said does not keep the session from beginning.
    let _ = writeln!(io::stderr(), "{}", visible_lines(line));
}
