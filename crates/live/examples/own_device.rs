//! A session with a device of your own: a knob in a hand, and a simulated partner who holds the same object 20 ms away.
//!
//! `crates/device/examples/lever.rs` shows a driver with a thread. The knob here answers at once and has no motor, which keeps the example short.
#![allow(clippy::print_stdout, reason = "the example prints")]

use std::error::Error;
use std::path::Path;
use std::time::Duration;

use cohaptic_device::{Description, Device, GatedForce, Reading, Stopper};
use cohaptic_live::{Conductor, LinkChange, Session, SessionConfig, Status};
use cohaptic_realtime::Wishes;
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

const SCENE: &str = r#"
scene = { title = "A knob and a partner", duration = "3s" }
object = { mass = 0.4, damping = 2.0 }
coordination = { strategy = "average-position", stiffness = 300.0, damping = 5.0, update = "8ms" }
peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 800.0, damping = 5.0 } }
link = { delay = "20ms" }
[[peers]]
name = "hand"
kind = "falcon" # a device in a hand
[[peers]]
name = "partner"
"#;

/// Knob that a hand holds 15 mm to the right.
struct Knob(Stopper);

impl Device for Knob {
    fn description(&self) -> Description {
        Description { name: "knob".to_owned(), motions: 1, force: 4.0, period: Duration::from_millis(1) }
    }

    fn stopper(&self) -> Stopper {
        self.0.clone()
    }

    fn read(&mut self, _now: Instant) -> Option<Reading> {
        Some(Reading { position: [0.015, 0.0, 0.0], velocity: [0.0; 3] })
    }

    fn hold(&mut self, _now: Instant, _span: Duration, _force: GatedForce) {
        // A motor would get the force here: force.newtons() are its components on the hand.
    }
}

/// Lets the session run to the end of the scene.
struct ToTheEnd;

impl Conductor for ToTheEnd {
    fn keep_going(&mut self) -> bool {
        true
    }

    fn next_change(&mut self) -> Option<LinkChange> {
        None
    }

    fn show(&mut self, _status: Status) {}
}

fn run() -> Result<String, Box<dyn Error>> {
    let scene = Scene::parse_live(SCENE, Path::new("scene.toml"), &[])?;
    // No peer is in another program, so the session opens no socket.
    let config = SessionConfig { wishes: Wishes::NONE, ..SessionConfig::new("127.0.0.1:0".parse()?) };
    let stopper = Stopper::default();
    let session = Session::open(&scene, config, |peer| (peer == 0).then(|| Box::new(Knob(stopper.clone())) as Box<dyn Device>))?;
    let report = session.run(&mut ToTheEnd)?;
    let mut told = String::new();
    for peer in &report.summary.peers {
        told += &format!("{} ends at {:.1} mm\n", peer.name, peer.position[0] * 1e3);
    }
    told += &format!("the knob is {}\n", if stopper.is_stopped() { "stopped" } else { "not stopped" });
    Ok(told)
}

fn main() -> Result<(), Box<dyn Error>> {
    print!("{}", run()?);
    Ok(())
}

/// The page shows what the example prints.
#[test]
fn the_page_shows_the_output() {
    let told = run().unwrap();
    assert!(include_str!("../../../docs/extending.md").contains(&told), "{told}");
}
