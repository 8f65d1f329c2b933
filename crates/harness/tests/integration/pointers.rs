//! Peers with a simulated device that a pointer, such as a mouse, pulls.

use std::convert::Infallible;
use std::time::Duration;

use cohaptic_device::{Description, Device, GatedForce, Reading, Stopper};
use cohaptic_harness::live::{LiveScene, Presence};
use cohaptic_harness::{Observer, TickRow};
use cohaptic_units::Instant;

use crate::records::{again, first_difference, session};
use crate::remote::millis;
use crate::scenes::{Written, read};

const COUPLING: f64 = 900.0;
const ARM: f64 = 400.0;
const FADE: f64 = 250.0;

/// Pointer whose position along x \[m\] is a function of the millisecond; `None` while it holds nothing.
struct Shown(fn(u64) -> Option<f64>);

impl Device for Shown {
    fn description(&self) -> Description {
        Description { name: "pointer".to_owned(), motions: 1, force: 20.0, period: Duration::from_millis(1) }
    }

    fn stopper(&self) -> Stopper {
        Stopper::default()
    }

    fn read(&mut self, now: Instant) -> Option<Reading> {
        (self.0)(now.as_nanos() / 1_000_000).map(|x| Reading { position: [x, 0.0, 0.0], velocity: [0.0; 3] })
    }

    fn hold(&mut self, _now: Instant, _span: Duration, _force: GatedForce) {}
}

/// Returns a scene of two peers. `hand` has further keys of the second peer, which a pointer pulls.
fn duo(hand: &str) -> Written {
    read(format!(
        "scene = {{ duration = \"3s\" }}\nobject = {{ mass = 0.4, damping = 2.0 }}\n\
         coordination = {{ strategy = \"average-position\", stiffness = 500.0, damping = 5.0, update = \"8ms\" }}\n\
         peer = {{ device = {{ mass = 0.1, damping = 5.0 }}, coupling = {{ stiffness = {COUPLING}, damping = 3.0 }} }}\n\
         peers = [{{ name = \"other\" }}, {{ name = \"hand\", kind = \"pointer\", {hand} }}]\nlink = {{ delay = \"4ms\" }}\n"
    ))
}

/// State of a tick: device and copy of the peer with the pointer, each as position \[m\] and velocity [m/s], the coupling force of this peer \[N\], and the
/// position of the other peer's copy \[m\].
#[derive(Clone, Copy, PartialEq, Debug, Default)]
struct Row {
    device: [f64; 2],
    copy: [f64; 2],
    force: f64,
    other: f64,
}

#[derive(Default)]
struct Rows(Vec<Row>, f64);

impl Observer for Rows {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        if row.peer == 0 {
            self.1 = row.object.position[0];
        } else {
            let state = |row: cohaptic_harness::StateRow<'_>| [row.position[0], row.velocity[0]];
            self.0.push(Row { device: state(row.device), copy: state(row.object), force: row.coupling_force[0], other: self.1 });
        }
        Ok(())
    }
}

fn run(written: &Written, shows: fn(u64) -> Option<f64>, until: u64) -> (Vec<Row>, LiveScene) {
    let mut live = LiveScene::new(&written.scene, |place| {
        assert_eq!(place, 1, "only the pointer's peer has one");
        Some(Box::new(Shown(shows)))
    });
    let mut rows = Rows::default();
    let Ok(()) = live.handle_timeout(millis(until), &mut rows);
    (rows.0, live)
}

/// A device that nobody holds is simulated all the same: it stays coupled to its copy, and its mass is felt by the other peer.
#[test]
fn a_pointer_that_never_comes_leaves_a_device_that_follows() {
    let written = duo("device-position = 0.02");
    let (rows, live) = run(&written, |_| None, 2000);
    assert!((rows[0].force - COUPLING * 0.02).abs() < 1e-12, "{:?}", rows[0]);
    assert!(rows[2000].other.abs() > 1e-4 && (rows[2000].device[0] - rows[2000].copy[0]).abs() < 1e-4, "{:?}", rows[2000]);
    assert_eq!((live.presence(1), live.seat_stats(1).unwrap().joined), (Some(Presence::Absent), 0));
}

/// The pointer takes hold at 300 ms, 5 cm off, and lets go at 1000 ms. It takes hold again at 1200 ms on the other side, and goes at 1900 ms.
#[test]
fn a_hand_takes_hold_and_lets_go_without_a_jump() {
    let written = duo("");
    let (rows, live) = run(
        &written,
        |t| match t {
            300..1000 => Some(0.05),
            1200..1900 => Some(-0.05),
            _ => None,
        },
        2500,
    );
    assert!(rows[..=300].iter().all(|row| *row == Row::default()), "nothing moves before it comes");
    // What accelerates the device over a tick is the arm's pull; it begins at nothing, and grows by no more than 1/250 of what it may be.
    let pull = |rows: &[Row]| {
        let [from, to] = [rows[0], rows[1]];
        // 100 g with a damping of 5 N·s/m, to first order in a tick; the terms left out are below 3 % of it.
        0.1 * (to.device[1] - from.device[1]) / 1e-3 + 5.0 * from.device[1] + from.force
    };
    let pulls: Vec<f64> = rows.windows(2).map(pull).collect();
    let largest = ARM * 0.1 + 20.0 * 0.5;
    let jump = pulls.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
    assert!(jump < 3.0 * largest / FADE, "{jump} N from one tick to the next");
    let strongest = pulls[300..1000].iter().copied().fold(0.0, f64::max);
    assert!(strongest > 1.0, "it pulls while it holds: {strongest} N");
    // Last read at 999 ms, silent from 1099 ms: at the return it has 1 − 101/250 of its arm.
    assert!(rows[1000].copy[0] > 0.02 && rows[1850].copy[0] < -0.01);
    assert!(pulls[2400].abs() < 0.01, "it has let go: {}", pulls[2400]);
    assert_eq!(live.seat_stats(1).unwrap().joined, 2);
    assert_eq!(live.presence(1), Some(Presence::Stale(millis(1999))));
}

/// A scene that begins with the state in which another scene has stopped, with the pointer holding the device, continues with the force of that state.
#[test]
fn a_scene_begun_anew_in_the_middle_goes_on_without_a_jump() {
    fn shows(_: u64) -> Option<f64> {
        Some(0.03)
    }
    let (rows, _) = run(&duo(""), shows, 700);
    let (last, next) = (rows[699], rows[700]);
    let Row { device: [xd, vd], copy: [xc, vc], other, .. } = next;
    let text = duo(&format!("position = {xc:?}, velocity = {vc:?}, device-position = {xd:?}, device-velocity = {vd:?}, pointer = {{ held = true }}"))
        .text
        .replace("name = \"other\"", &format!("name = \"other\", position = {other:?}"));
    let (anew, live) = run(&read(text), shows, 10);
    assert_eq!((anew[0].device, anew[0].copy, anew[0].force.to_bits()), (next.device, next.copy, next.force.to_bits()));
    assert!((anew[1].force - anew[0].force).abs() < 2.0 * (next.force - last.force).abs() + 1e-3, "{anew:?}");
    assert_eq!((live.presence(1), live.seat_stats(1).unwrap().joined), (Some(Presence::Present), 1));
    // Without the word the hand takes hold anew, and the device is pulled back by its copy meanwhile.
    let (let_go, _) = run(&duo(&format!("position = {xc:?}, device-position = {xd:?}")), shows, 10);
    assert!(let_go[10].device[0] < anew[10].device[0] - 1e-4, "{} {}", let_go[10].device[0], anew[10].device[0]);
}

#[test]
fn a_recorded_pointer_moves_everything_again_to_the_byte() {
    let written = duo("");
    let shows: fn(u64) -> Option<f64> = |t| (!(900..1300).contains(&t)).then(|| 0.03 * (millis(t).as_secs_f64() * 5.0).sin());
    let recorded = session(&written.scene, |_| Some(Box::new(Shown(shows))), |_, _, _| {});
    let text = String::from_utf8(recorded.files["inputs.csv"].clone()).unwrap();
    assert!(text.contains("\n5000000,device,hand,,") && text.contains("\n1000000000,device,hand,,none\n"));
    let (files, summary) = again(&written, &recorded);
    assert_eq!(first_difference(&recorded.files, &files), None);
    assert_eq!(summary, recorded.summary);
    assert!(summary.peers[0].position[0].abs() > 1e-5, "{summary:?}");
}
