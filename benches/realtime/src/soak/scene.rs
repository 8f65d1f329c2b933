//! The scene of the live session.

use std::path::Path;
use std::time::Duration;

use cohaptic_scene::{Scene, SceneError};

/// The place of the peer in another program: the last.
pub(super) const VISITOR: u32 = 3;

/// How many peers there are.
pub(super) const PEERS: usize = 4;

/// Of the control loop.
pub(super) const TICK: Duration = Duration::from_millis(1);

/// Soft enough to stand the delay: three peers and a program that moves to and fro.
const TEXT: &str = r#"
[scene]
title = "A soak"
duration = "1s"
seed = 11

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

[[peers]]
name = "left"

[[peers]]
name = "right"

[[peers]]
name = "third"

[[peers]]
name = "visitor"
kind = "udp"

[link]
delay = "24ms"
jitter = "2ms"
loss = "1%"
"#;

/// The scene, for a session that may last so long.
pub(super) fn scene(duration: Duration) -> Result<Scene, SceneError> {
    let mut scene = Scene::parse_live(TEXT, Path::new("soak.toml"), &[])?;
    scene.duration = duration;
    Ok(scene)
}
