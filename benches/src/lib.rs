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
pub mod large;
pub mod machine;
pub mod one_link;
pub mod pages;
pub mod records;
pub mod scaling;
pub mod turning;
pub mod verdicts;
pub mod watched;

pub use cohaptic_benches_common::mesh::Mesh;

/// The damping of every copy [N·s/m].
pub const COPY_DAMPING: f64 = 0.0;

/// Links by name: their keys beside a delay of 24 ms, or a link of the library, which has a delay of its own.
pub const LINKS: [(&str, &str); 12] = [
    ("constant", ""),
    ("jitter and loss", Mesh::IMPAIRMENTS),
    ("rate and queue", "jitter = \"2ms\"\nloss = \"1%\"\nrate = \"10Mbit\"\nqueue = { limit = \"100 packets\" }"),
    ("full line", "jitter = \"2ms\"\nloss = \"1%\"\nrate = \"60kbit\"\nqueue = { limit = \"8 packets\" }"),
    ("chains", "jitter = { sd = \"2ms\", distribution = \"gamma\", correlation = 0.5 }\nloss = { gilbert-elliott = { p = 0.01, r = 0.3 } }"),
    ("CoDel", "jitter = \"2ms\"\nloss = \"1%\"\nrate = \"10Mbit\"\nqueue = { limit = \"100 packets\", discipline = \"codel\" }"),
    (
        "full line, CoDel",
        "jitter = \"2ms\"\nloss = \"1%\"\nrate = \"60kbit\"\nqueue = { limit = \"100 packets\", discipline = { codel = { mtu = \"100B\" } } }",
    ),
    ("token bucket", "jitter = \"2ms\"\nloss = \"1%\"\ntoken-bucket = { rate = \"10Mbit\", burst = \"3kB\", limit = \"100 packets\" }"),
    ("starlink", "profile = \"starlink/down\""),
    ("lte-driving", "profile = \"lte-driving/down\""),
    ("wifi-busy", "profile = \"wifi-busy/down\""),
    ("dsl", "profile = \"dsl/down\""),
];

#[cfg(test)]
mod tests {
    use cohaptic_benches_common::mesh::SEED;
    use cohaptic_scene::Scene;

    use super::*;

    /// The loop and the program do the same work: same packets, same motion. The loop adds up increments in another order, so positions agree to
    /// rounding: 1000 ticks of motions below 1 m, each rounded to 2^-53, in a damped system that forgets them.
    fn compare(mesh: Mesh, bare: &bare::Outcome, scene: &Scene) {
        let summary = Mesh::run(scene);
        for (peer, position) in summary.peers.iter().zip(&bare.positions) {
            assert!((peer.position[0] - position).abs() < 1e-11, "{mesh:?}: {} is not {position}", peer.position[0]);
        }
        assert!((summary.max_discrepancy - bare.max_discrepancy).abs() < 1e-11);
        let delivered: u64 = summary.links.iter().map(|link| link.stats.delivered()).sum();
        // The program also delivers what arrives after the last tick, up to the end of the scene.
        let last_millisecond = (mesh.peers * mesh.peers) as u64;
        assert!((bare.delivered..bare.delivered + last_millisecond).contains(&delivered), "{mesh:?}");
    }

    #[test]
    fn the_bare_loop_and_the_program_agree() {
        for mesh in Mesh::ALL {
            compare(mesh, &bare::run(mesh, 1000), &mesh.scene(1000, SEED));
        }
    }

    /// The queues of the tables: one in which no sample waits, and one that is full most of the time.
    #[test]
    fn the_bare_queue_and_that_of_the_program_agree() {
        for mesh in Mesh::ALL.into_iter().filter(|mesh| mesh.impaired) {
            for (queue, rate) in [(bare::Queue::NEVER_FULL, "10Mbit"), (bare::Queue::FULL, "60kbit")] {
                let keys = format!("{}\nrate = \"{rate}\"\nqueue = {{ limit = \"{} packets\" }}", Mesh::IMPAIRMENTS, queue.limit);
                compare(mesh, &bare::run_through(Some(queue), mesh, 1000), &mesh.scene_over(&keys, 1000, SEED));
            }
        }
    }
}
