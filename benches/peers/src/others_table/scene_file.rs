//! The scene as programs in other languages read it: lines of a key and numbers, and beside them the delays of all packets, if they differ.

use std::fmt::Write;
use std::path::Path;

use cohaptic_benches_peers::mesh::body::{Motion, Numbers};
use cohaptic_benches_peers::mesh::draws::Draws;
use cohaptic_benches_peers::mesh::{DELAY_NANOS, HAND_FORCE, Mesh, TICK_NANOS, TICKS_A_FRAME};

/// Of a packet that is lost.
const LOST: i64 = -1;

/// Writes the scene there, and its delays into a file beside it.
pub fn write(path: &Path, mesh: Mesh, ticks: u64) {
    let mut text = text(mesh);
    writeln!(text, "ticks {ticks}").expect("a string takes all");
    if mesh.impaired {
        let delays = path.with_extension("delays");
        std::fs::write(&delays, bytes(mesh, ticks)).expect("a temporary file");
        writeln!(text, "delays {}", delays.display()).expect("a string takes all");
    }
    std::fs::write(path, text).expect("a temporary file");
}

/// What does not depend on how long it is. Numbers are the shortest that read back as the same bits.
#[must_use]
pub fn text(mesh: Mesh) -> String {
    let Numbers { device, copy, coupling, gains } = Numbers::new(mesh);
    let motion = |Motion { x, v }: Motion| format!("{:?} {:?} {:?} {:?}", x[0], x[1], v[0], v[1]);
    format!(
        "peers {}\nticks_a_frame {TICKS_A_FRAME}\ntick_nanos {TICK_NANOS}\ndelay {DELAY_NANOS}\nhand {HAND_FORCE:?}\ndevice {}\ncopy {}\ncoupling {:?} {:?}\n\
         gains {:?} {:?}\n",
        mesh.peers,
        motion(device),
        motion(copy),
        coupling.stiffness,
        coupling.damping,
        gains.stiffness,
        gains.damping,
    )
}

/// Frame by frame, from by to, in nanoseconds; little-endian.
fn bytes(mesh: Mesh, ticks: u64) -> Vec<u8> {
    let draws: Vec<Draws> = (0..mesh.peers).flat_map(|from| Draws::from(mesh, from)).collect();
    let frames = 0..ticks.div_ceil(TICKS_A_FRAME);
    let delay = |sequence: u64, draws: &Draws| draws.delay(sequence).map_or(LOST, |delay| i64::try_from(delay).unwrap_or(i64::MAX));
    frames.flat_map(|sequence| draws.iter().flat_map(move |draws| delay(sequence, draws).to_le_bytes())).collect()
}
