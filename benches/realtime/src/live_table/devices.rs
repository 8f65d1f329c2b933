//! The calls of a session to a device: `read` and `hold` of a Falcon whose thread exchanges packets with a simulated device.

use std::error::Error;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant as Clock};

use cohaptic_device::{Description, Device, GatedForce, Reading, Stopper};
use cohaptic_live::falcons::Falcons;
use cohaptic_live::{Session, SessionConfig};
use cohaptic_realtime::{Lateness, LatenessSummary, Wishes};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use crate::session::Nobody;

/// Three people with a Falcon each, as in `scenarios/live/three-falcons.toml`.
const SCENE: &str = "
scene = { title = \"Devices\", duration = \"1h\", axes = 3 }
object = { mass = 0.45 }
coordination = { strategy = \"average-position\", stiffness = 300.0, damping = 5.0, update = \"8ms\" }
link = { delay = \"24ms\" }
peers = [{ name = \"left\" }, { name = \"right\" }, { name = \"third\" }]
[peer]
kind = \"falcon\"
falcon = { device = \"simulated\", force-limit = 4.0 }
device = { mass = 0.1, damping = 5.0 }
coupling = { stiffness = 1000.0, damping = 2.0 }
hand = { arm = { mass = 0.3, damping = 10.0, stiffness = 100.0 } }
";

/// Device whose calls are timed.
struct Timed {
    device: Box<dyn Device>,
    /// Duration of the latest `read`.
    reading: Duration,
    /// Durations of `read` and `hold` together, of each tick and of all devices.
    took: Arc<Mutex<Lateness>>,
}

impl Device for Timed {
    fn description(&self) -> Description {
        self.device.description()
    }

    fn stopper(&self) -> Stopper {
        self.device.stopper()
    }

    fn read(&mut self, now: Instant) -> Option<Reading> {
        let begin = Clock::now();
        let reading = self.device.read(now);
        self.reading = begin.elapsed();
        reading
    }

    fn hold(&mut self, now: Instant, span: Duration, force: GatedForce) {
        let begin = Clock::now();
        self.device.hold(now, span, force);
        self.took.lock().unwrap_or_else(PoisonError::into_inner).record(self.reading + begin.elapsed());
    }

    fn stop(&mut self) {
        self.device.stop();
    }
}

/// Runs a session with three simulated Falcons for `span`, and returns how long `read` and `hold` took together.
pub(crate) fn run(wishes: Wishes, span: Duration) -> Result<LatenessSummary, Box<dyn Error>> {
    let scene = Scene { duration: span, ..Scene::parse_live(SCENE, Path::new("devices.toml"), &[])? };
    let mut falcons = Falcons::open(&scene, None, wishes, |_, _| {})?;
    while !falcons.simulated_are_ready() {
        thread::sleep(Duration::from_millis(20));
    }
    let took = Arc::new(Mutex::new(Lateness::new()));
    let config = SessionConfig { wishes, ..SessionConfig::new(([127, 0, 0, 1], 0).into()) };
    let timed = |device| Box::new(Timed { device, reading: Duration::ZERO, took: Arc::clone(&took) }) as Box<dyn Device>;
    let session = Session::open(&scene, config, |peer| falcons.take(peer).map(timed))?;
    thread::spawn(move || session.run(&mut Nobody)).join().map_err(|_| "the session panicked")??;
    let took = took.lock().unwrap_or_else(PoisonError::into_inner);
    Ok(took.summary())
}
