//! The work that is measured: a full mesh of N peers at 1 kHz, 125 samples of 64 bytes a second, 24 ms one way.
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    clippy::float_cmp,
    reason = "a bare loop is written for speed; every number here is small"
)]

pub mod bare;
pub mod bare_pair;
pub mod by_hand;
pub mod effort;
pub mod kernel;
pub mod machine;
pub mod one_link;
pub mod pages;
pub mod scaling;
pub mod turning;
pub mod verdicts;
pub mod watched;

pub use cohaptic_benches_common::mesh::Mesh;

/// The damping of every copy [N·s/m].
pub const COPY_DAMPING: f64 = 0.0;

#[cfg(test)]
mod tests {
    use cohaptic_benches_common::mesh::SEED;

    use super::*;

    /// The loop and the program do the same work: same packets, same motion. The loop adds up increments in another order, so positions agree to
    /// rounding: 1000 ticks of motions below 1 m, each rounded to 2^-53, in a damped system that forgets them.
    #[test]
    fn the_bare_loop_and_the_program_agree() {
        for mesh in Mesh::ALL {
            let bare = bare::run(mesh, 1000);
            let summary = Mesh::run(&mesh.scene(1000, SEED));
            for (peer, position) in summary.peers.iter().zip(&bare.positions) {
                assert!((peer.position[0] - position).abs() < 1e-11, "{mesh:?}: {} is not {position}", peer.position[0]);
            }
            assert!((summary.max_discrepancy - bare.max_discrepancy).abs() < 1e-11);
            let delivered: u64 = summary.links.iter().map(|link| link.stats.delivered()).sum();
            // The program also delivers what arrives after the last tick, up to the end of the scene.
            let last_millisecond = (mesh.peers * mesh.peers) as u64;
            assert!((bare.delivered..bare.delivered + last_millisecond).contains(&delivered), "{mesh:?}");
        }
    }
}
