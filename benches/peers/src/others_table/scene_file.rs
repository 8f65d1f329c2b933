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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back_as_the_same_bits_and_delays_as_they_are_drawn() {
        let mesh = Mesh { peers: 10, impaired: true };
        let text = text(mesh);
        let numbers: Vec<f64> = text
            .lines()
            .filter(|line| line.starts_with("copy") || line.starts_with("gains"))
            .flat_map(|line| line.split(' ').skip(1))
            .map(|number| number.parse().unwrap())
            .collect();
        let Numbers { copy, gains, .. } = Numbers::new(mesh);
        assert_eq!(numbers, [copy.x[0], copy.x[1], copy.v[0], copy.v[1], gains.stiffness, gains.damping]);
        let bytes = bytes(mesh, 1_000);
        // Frame 100 from peer 3 to peer 7.
        let place = ((100 * 10 + 3) * 10 + 7) * 8;
        let delay = i64::from_le_bytes(bytes[place..place + 8].try_into().unwrap());
        assert_eq!(delay, Draws::new(mesh, 3, 7).delay(100).map_or(LOST, |delay| i64::try_from(delay).unwrap()));
        assert_eq!(bytes.len(), 125 * 100 * 8);
    }
}
