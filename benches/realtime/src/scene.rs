//! The scene of the sessions: simulated peers, and one in another program.

use std::path::Path;
use std::time::Duration;

use cohaptic_scene::{Scene, SceneError};

/// Soft enough to stand the delay.
const COMMON: &str = r#"
[object]
mass = 0.45

[coordination]
strategy = "average-position"
stiffness = 30.0
damping = 2.0
update = "8ms"

[peer]
contact = "grasp"
device = { mass = 0.1, damping = 5.0 }
coupling = { stiffness = 1000.0, damping = 5.0 }

[link]
delay = "24ms"
jitter = "2ms"
loss = "1%"
"#;

/// A scene of this number of peers, the last of them in another program, for a session that may last that time.
///
/// # Errors
///
/// If it is refused, which a test would show.
pub fn scene(title: &str, seed: u64, peers: usize, duration: Duration) -> Result<Scene, SceneError> {
    with_programs(title, seed, peers - 1, &["program"], duration)
}

/// The same with all of this number of peers simulated.
///
/// # Errors
///
/// If it is refused, which a test would show.
pub fn simulated_scene(title: &str, seed: u64, peers: usize, duration: Duration) -> Result<Scene, SceneError> {
    with_programs(title, seed, peers, &[], duration)
}

/// The same with peers in several other programs, of these names, after the simulated ones.
///
/// # Errors
///
/// If it is refused, which a test would show.
pub fn with_programs(title: &str, seed: u64, simulated: usize, programs: &[&str], duration: Duration) -> Result<Scene, SceneError> {
    let mut text = format!("[scene]\ntitle = \"{title}\"\nduration = \"1s\"\nseed = {seed}\n{COMMON}");
    for place in 1..=simulated {
        text.push_str(&format!("\n[[peers]]\nname = \"peer-{place}\"\n"));
    }
    for name in programs {
        text.push_str(&format!("\n[[peers]]\nname = \"{name}\"\nkind = \"udp\"\n"));
    }
    let mut scene = Scene::parse_live(&text, Path::new("session.toml"), &[])?;
    scene.duration = duration;
    Ok(scene)
}
