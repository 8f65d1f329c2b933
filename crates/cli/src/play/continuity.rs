//! Test that parts follow one another without a jerk: across the border of two parts, force and position of a moving hand change no faster than within a
//! part.

use std::convert::Infallible;
use std::path::Path;

use cohaptic_harness::live::LiveScene;
use cohaptic_harness::{Observer, TickRow};
use cohaptic_live::PeerStatus;
use cohaptic_live::pointers::Pointer;
use cohaptic_units::Instant;

use super::scene::PlayedScene;

const TEXT: &str = include_str!("../../scenarios/live/play.toml");
const TICK: u64 = 1_000_000;
/// Ticks between two positions of the hand, as from a display with 62.5 pictures per second.
const PICTURE: u64 = 16;
/// Ticks from the end of a part to the beginning of the next part. The hand moves on during the pause.
const PAUSE: u64 = 24;

/// Coupling force \[N\], position of the copy \[m\] and position of the device \[m\], each along x and y, indexed by peer and tick.
#[derive(Default)]
struct Felt(Vec<Vec<[f64; 6]>>);

impl Observer for Felt {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        if self.0.len() <= row.peer {
            self.0.resize(row.peer + 1, Vec::new());
        }
        let [force, copy, device] = [row.coupling_force, row.object.position, row.device.position];
        self.0[row.peer].push([force[0], force[1], copy[0], copy[1], device[0], device[1]]);
        Ok(())
    }
}

/// Returns the position of the hand at a tick: the hand moves along a circle at 0.2 m/s.
fn place(tick: u64) -> [f64; 3] {
    #[expect(clippy::cast_precision_loss, reason = "some thousand ticks")]
    let angle = 5.0 * tick as f64 * 1e-3;
    [0.04 * angle.sin(), 0.04 * (1.0 - angle.cos()), 0.0]
}

/// Runs a part for `ticks` ticks, with the hand's motion from tick `begin` on. Returns the observed values, and the state of each peer at the end.
fn run(played: &PlayedScene, pointer: &Pointer, begin: u64, ticks: u64) -> (Felt, Vec<PeerStatus>) {
    let scene = played.scene().unwrap();
    let mut live = LiveScene::new(&scene, |peer| (peer == 0).then(|| pointer.device()));
    let mut felt = Felt::default();
    for tick in 0..ticks {
        if (begin + tick).is_multiple_of(PICTURE) {
            pointer.tell(Some(place(begin + tick))).unwrap();
        }
        let Ok(()) = live.handle_timeout(Instant::from_nanos(tick * TICK), &mut felt);
    }
    let stands = |peer: usize| PeerStatus { state: live.peer(peer).unwrap(), force: [0.0; 3], seat: None, connection: None };
    (felt, (0..scene.peers.len()).map(stands).collect())
}

/// Returns the largest change of force \[N\] and of position \[m\] from one tick to the next.
fn largest(felt: &[[f64; 6]]) -> [f64; 2] {
    let change = |pair: &[[f64; 6]], of: usize| (pair[1][of] - pair[0][of]).hypot(pair[1][of + 1] - pair[0][of + 1]);
    felt.windows(2).fold([0.0, 0.0], |[force, way], pair| [change(pair, 0).max(force), change(pair, 2).max(change(pair, 4)).max(way)])
}

/// At the border itself, forces and positions change at most as much as from tick to tick before the border. After the border the device catches up with the
/// hand, which moved while no part ran; the copies receive nothing for 100 ms, and then samples of another strategy. In that time no force changes by more
/// than 0.3 N per millisecond, and nothing moves faster than 0.3 m/s. A pointer that jumped to the hand's new position would pull with 20 N·s/m at more than
/// 0.2 m/s, and so change the force by 4 N or more.
#[test]
fn nobody_is_jerked_when_a_part_begins() {
    let delay = ["link.delay=100ms".to_owned()];
    let played = PlayedScene::read(TEXT, Path::new("play.toml"), &delay).unwrap();
    let scene = played.scene().unwrap();
    // The five ends put the border at different ticks between two positions of the hand.
    for ends in [2000, 2003, 2007, 2011, 2015] {
        for (strategy, peers) in [("average-position", 3), ("average-position", 4), ("proportional-derivative", 3), ("proportional-derivative", 5)] {
            let pointer = Pointer::default();
            let (before, stands) = run(&played, &pointer, 0, ends);
            for tick in (ends..ends + PAUSE).filter(|tick| tick.is_multiple_of(PICTURE)) {
                pointer.tell(Some(place(tick))).unwrap();
            }
            let next = played.clone().standing(&stands, &scene).with_strategy(strategy).with_peers(peers);
            let (after, _) = run(&next, &pointer, ends + PAUSE, 300);
            for (peer, (before, after)) in before.0.iter().zip(&after.0).enumerate() {
                // The first second is left out: in that second the hand takes hold of the object.
                let [usual_force, usual_way] = largest(&before[1000..]);
                let [border_force, border_way] = largest(&[before[before.len() - 1], after[0]]);
                let said = format!("{ends} {strategy} {peers}, peer {peer}");
                assert!(border_force <= 1.01 * usual_force && border_way <= 1.01 * usual_way, "{said}: {border_force} N, {border_way} m");
                let [force, way] = largest(after);
                assert!(force < 0.3 && way < 0.3e-3, "{said}: {force} N and {way} m in a millisecond");
            }
        }
    }
}
