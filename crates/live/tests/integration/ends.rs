//! Every end of a session ends the force on a hand: the end that a conductor asks for, as after a signal, a panic of the session's thread, and a drop.

use std::path::Path;
use std::thread;
use std::time::Duration;

use cohaptic_device::{Device, Stopper};
use cohaptic_falcon::device::{Axes, Axis, DeviceConfig, FalconDevice};
use cohaptic_falcon::driver::DriverConfig;
use cohaptic_falcon::simulator::{SharedSimulator, SimulatedTransport, Simulator, SimulatorConfig, Waypoints};
use cohaptic_live::{Conductor, LinkChange, Session, SessionConfig, Status};
use cohaptic_realtime::Wishes;
use cohaptic_scene::Scene;

const SCENE: &str = "
scene = { duration = \"1h\" }
object = { mass = 0.4, damping = 2.0 }
coordination = { strategy = \"average-position\", stiffness = 300.0, damping = 5.0, update = \"8ms\" }
peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 800.0, damping = 5.0 } }
link = { delay = \"20ms\" }
peers = [{ name = \"hand\", kind = \"falcon\" }, { name = \"partner\" }]
";

/// End of a session, once the hand feels a force.
#[derive(Clone, Copy, PartialEq)]
enum End {
    Asked,
    Panic,
}

struct Ending {
    end: End,
    simulator: SharedSimulator,
}

impl Conductor for Ending {
    fn keep_going(&mut self) -> bool {
        let is_felt = self.simulator.with(|device| device.motor_force()) != [0.0; 3];
        assert!(!is_felt || self.end != End::Panic, "in the loop of the session");
        !is_felt
    }

    fn next_change(&mut self) -> Option<LinkChange> {
        None
    }

    fn show(&mut self, _status: Status) {}
}

/// Opens a session with a simulated Falcon in a swaying hand, which homes the device however late its thread begins.
fn open() -> (Session, SharedSimulator, Stopper) {
    let hand = Waypoints::new([(Duration::ZERO, [0.0, 0.0, 0.110])]).swaying([0.01, 0.0, 0.010], 2.0);
    let transport = SimulatedTransport::in_real_time(Simulator::new(SimulatorConfig { running: true, ..SimulatorConfig::default() }, hand));
    let simulator = transport.simulator();
    let driver = DriverConfig { arm_beyond: None, longest_silence: Duration::from_secs(60), ..DriverConfig::DEFAULT };
    let config = DeviceConfig { driver, ..DeviceConfig::new(Axes::new([Axis::X]).unwrap()) };
    let mut falcon = Some(FalconDevice::start(transport, config).unwrap());
    let stopper = falcon.as_ref().unwrap().stopper();
    let scene = Scene::parse_live(SCENE, Path::new("scene.toml"), &[]).unwrap();
    let config = SessionConfig { wishes: Wishes::NONE, ..SessionConfig::new("127.0.0.1:0".parse().unwrap()) };
    let session = Session::open(&scene, config, |_| falcon.take().map(|falcon| Box::new(falcon) as Box<dyn Device>)).unwrap();
    (session, simulator, stopper)
}

#[test]
fn the_hand_feels_nothing_after_any_end() {
    for end in [End::Asked, End::Panic] {
        let (session, simulator, stopper) = open();
        let mut conductor = Ending { end, simulator: simulator.clone() };
        let ended = thread::spawn(move || session.run(&mut conductor).map(|_| ())).join();
        assert_eq!(ended.is_err(), end == End::Panic);
        assert!(stopper.is_stopped());
        simulator.with(|device| assert_eq!(device.motor_force(), [0.0; 3]));
    }
    let (session, simulator, stopper) = open();
    drop(session);
    assert!(stopper.is_stopped());
    simulator.with(|device| assert_eq!(device.motor_force(), [0.0; 3]));
}
