//! Three simulated Falcons hold one object over links of 24 ms, down to the bytes of the device, in virtual time: the scene
//! `scenarios/live/three-falcons.toml`.
//!
//! The expected positions are the equilibrium of the scene. Arm ka and coupling KC in series have the stiffness k = ka·KC/(ka + KC). With W the sum of the
//! wanted positions w, a copy rests at x = (k·w + KT·W/2)/(k + 3/2·KT). The weights of all w in this sum are positive and add up to 1 for each copy. So if
//! every w shifts by at most Δ, no copy shifts by more than Δ.

use std::convert::Infallible;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use cohaptic_device::{Description, Device, GatedForce, Reading, Stopper};
use cohaptic_falcon::calibration::Calibration;
use cohaptic_falcon::device::{Axes, Axis, DeviceConfig, SteppedFalcon};
use cohaptic_falcon::driver::DriverConfig;
use cohaptic_falcon::safety::Limits;
use cohaptic_falcon::simulator::{MechanicsConfig, SharedSimulator, SimulatedTransport, Simulator, SimulatorConfig, Waypoints};
use cohaptic_falcon::transport::Request;
use cohaptic_falcon::transport::{Transport, TransportError};
use cohaptic_harness::live::LiveScene;
use cohaptic_harness::{Model, Observer, Simulation, TickRow};
use cohaptic_scene::{PeerKind, Scene};
use cohaptic_units::Instant;

const PEERS: usize = 3;
/// Stiffness of an arm in the scene \[N/m\].
const ARM: f64 = 100.0;
/// Position that the hand on each grip wants \[m\], indexed by peer.
const WANTED: [[f64; 3]; PEERS] = [[0.03, 0.0, -0.015], [0.0; 3], [0.0; 3]];
/// Dry friction of a simulated grip \[N\].
const COULOMB: f64 = MechanicsConfig::DEFAULT.coulomb;

/// Largest apparent shift of a hand's wanted position through rounding to whole counts \[m\]. Each of the three encoders is off by at most one count of 0.06
/// mm (docs/falcon.md): √3·0.06 mm together. Each motor is off by at most half a count, which is 5e-5 N·m at 10,000 counts per N·m: √3 times that together.
/// The force on the grip is at most 29 rad/m times the torques, because a count of 6.36e-4 rad is at least 0.022 mm. The force of 2.5 mN shifts a grip that ka
/// holds by 0.025 mm.
const COUNTS: f64 = 1.732 * 0.06e-3 + 1.732 * 5e-5 * 29.0 / ARM;

fn scene() -> Scene {
    Scene::read_live(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/live/three-falcons.toml"), &[]).unwrap()
}

/// Transport that records every byte in both directions.
struct Tapped {
    inner: SimulatedTransport,
    bytes: Arc<Mutex<Vec<u8>>>,
}

impl Transport for Tapped {
    fn now(&self) -> Instant {
        self.inner.now()
    }

    fn sleep_until(&mut self, until: Instant) {
        self.inner.sleep_until(until);
    }

    fn control(&mut self, request: Request, value: u16) -> Result<(), TransportError> {
        self.inner.control(request, value)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        self.bytes.lock().unwrap().extend(bytes);
        self.inner.write(bytes)
    }

    fn read(&mut self, into: &mut [u8], patience: Duration) -> Result<usize, TransportError> {
        let count = self.inner.read(into, patience)?;
        self.bytes.lock().unwrap().extend(&into[..count]);
        Ok(count)
    }
}

/// Falcon that the ticks of its peer drive.
struct Stepped {
    falcon: SteppedFalcon<Tapped, 3>,
    /// Largest force sent to the device \[N\].
    largest: Arc<Mutex<f64>>,
}

impl Device for Stepped {
    fn description(&self) -> Description {
        self.falcon.description()
    }

    fn stopper(&self) -> Stopper {
        self.falcon.stopper()
    }

    fn read(&mut self, now: Instant) -> Option<Reading> {
        self.falcon.read(now)
    }

    fn stop(&mut self) {
        self.falcon.stop();
    }

    fn hold(&mut self, now: Instant, span: Duration, force: GatedForce) {
        self.falcon.hold(now, span, force);
        let mut largest = self.largest.lock().unwrap();
        *largest = largest.max(length(self.falcon.snapshot().force));
    }
}

/// Access to a simulated device while the scene owns the Falcon.
struct Desk {
    simulator: SharedSimulator,
    bytes: Arc<Mutex<Vec<u8>>>,
    largest: Arc<Mutex<f64>>,
}

/// Returns a homed Falcon in a hand that wants the position `WANTED[place]`. `coulomb`: dry friction \[N\]. `limit`: limit of the force \[N\].
fn falcon(scene: &Scene, place: usize, coulomb: f64, limit: f64) -> (Stepped, Desk) {
    let peer = &scene.peers[place];
    let (PeerKind::Falcon(_, spec), Some(cohaptic_peer::Hand::Arm { arm, follows })) = (&peer.kind, peer.hand.clone()) else {
        panic!("a Falcon in a hand")
    };
    assert_eq!((arm.stiffness, follows.value::<3>(Instant::ZERO), spec.force_limit), (ARM, WANTED[place], Limits::DEFAULT.force));
    let mechanics = MechanicsConfig { mass: peer.device.mass + arm.mass, damping: peer.device.damping, coulomb, ..MechanicsConfig::DEFAULT };
    let config = SimulatorConfig { seed: place as u64, running: true, mechanics, ..SimulatorConfig::default() };
    let transport = SimulatedTransport::in_virtual_time(Simulator::new(config, Waypoints::homing(Duration::ZERO)));
    let (simulator, bytes, largest) = (transport.simulator(), Arc::default(), Arc::default());
    let transport = Tapped { inner: transport, bytes: Arc::clone(&bytes) };
    let calibration = Calibration::new(spec.counts_per_newton_metre, spec.origin).unwrap();
    let driver = DriverConfig { calibration, limits: Limits { force: limit, ..Limits::DEFAULT }, ..DriverConfig::DEFAULT };
    let axes = Axes::new([Axis::X, Axis::Y, Axis::Z]).unwrap();
    let mut falcon = SteppedFalcon::start(transport, DeviceConfig { driver, ..DeviceConfig::new(axes) }).unwrap();
    assert!(falcon.wait(Duration::from_millis(4500)).unwrap().is_ready());
    let (origin, wanted) = (spec.origin, WANTED[place]);
    // The hand homes the device first, and becomes the arm of the scene only now.
    simulator.with(|device| {
        device.set_hand(move |_: Instant, position: [f64; 3], velocity: [f64; 3]| {
            [0, 1, 2].map(|axis| arm.stiffness * (origin[axis] + wanted[axis] - position[axis]) - arm.damping * velocity[axis])
        });
    });
    (Stepped { falcon, largest: Arc::clone(&largest) }, Desk { simulator, bytes, largest })
}

/// All numbers of all ticks as bits, and the mean positions of each copy and each device over the last half second.
#[derive(Default)]
struct Trace {
    bits: Vec<u64>,
    from: Instant,
    /// Sums of positions, indexed by peer, then copy (0) and device (1), then axis.
    sums: [[[f64; 3]; 2]; PEERS],
    /// Number of ticks in the sums, of all peers together.
    count: u32,
}

impl Trace {
    fn of(scene: &Scene) -> Self {
        Self { from: Instant::ZERO + (scene.duration - Duration::from_millis(500)), ..Self::default() }
    }

    fn mean(&self, peer: usize, which: usize) -> [f64; 3] {
        self.sums[peer][which].map(|sum| sum / f64::from(self.count / 3))
    }

    fn copy(&self, peer: usize) -> [f64; 3] {
        self.mean(peer, 0)
    }

    fn device(&self, peer: usize) -> [f64; 3] {
        self.mean(peer, 1)
    }
}

impl Observer for Trace {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        let numbers =
            [row.device.position, row.device.velocity, row.object.position, row.object.velocity, row.coupling_force, row.coordination_force];
        self.bits.extend(numbers.into_iter().flatten().map(|number| number.to_bits()));
        if row.at >= self.from {
            self.count += 1;
            for (sums, position) in self.sums[row.peer].iter_mut().zip([row.object.position, row.device.position]) {
                for (sum, part) in sums.iter_mut().zip(position) {
                    *sum += part;
                }
            }
        }
        Ok(())
    }
}

/// Result of a session.
struct Session {
    trace: Trace,
    desks: Vec<Desk>,
}

/// Runs the scene to its end, and checks that all devices joined once, exchanged no garbage, and kept the limit of the force.
fn session(scene: &Scene, coulomb: f64, limit: f64) -> Session {
    let mut desks = Vec::new();
    let mut live = LiveScene::new(scene, |place| {
        let (device, desk) = falcon(scene, place, coulomb, limit);
        desks.push(desk);
        Some(Box::new(device))
    });
    let mut trace = Trace::of(scene);
    while let Some(at) = live.poll_timeout() {
        let Ok(()) = live.handle_timeout(at, &mut trace);
    }
    for place in 0..PEERS {
        let stats = live.seat_stats(place).unwrap();
        assert_eq!((stats.joined, stats.refused), (1, 0), "it joins once and stays");
    }
    drop(live);
    for desk in &desks {
        let observed = desk.simulator.with(|device| *device.observed());
        assert_eq!((observed.largest_count_unhomed, observed.garbage, observed.misheard, observed.torque_timeouts), (0, 0, 0, 0));
        assert_eq!(desk.simulator.with(|device| device.motor_force()), [0.0; 3], "force ends with the session");
        assert!(*desk.largest.lock().unwrap() <= limit * (1.0 + 1e-12), "no force above the limit goes out");
    }
    Session { trace, desks }
}

fn length([x, y, z]: [f64; 3]) -> f64 {
    x.hypot(y).hypot(z)
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    length([0, 1, 2].map(|axis| a[axis] - b[axis]))
}

#[test]
fn the_same_session_is_the_same_to_the_last_byte() {
    let scene = Scene { duration: Duration::from_millis(1500), ..scene() };
    let [one, two] = [(); 2].map(|()| session(&scene, COULOMB, 4.0));
    assert_eq!(one.trace.bits.len(), 1500 * PEERS * 18);
    assert!(one.trace.bits == two.trace.bits, "motion");
    for (one, two) in one.desks.iter().zip(&two.desks) {
        let (one, two) = (one.bytes.lock().unwrap(), two.bytes.lock().unwrap());
        // Homing and session last 6 s, with one exchange of a packet and a report per 1.02 ms: 0.02 ms is the duration of the call that ends the exchange.
        assert!(one.len() >= 32 * 5850, "{}", one.len());
        assert!(*one == *two, "bytes");
    }
}

/// The copies rest where the copies of plain masses rest, within the uncertainty of whole counts and dry friction.
#[test]
fn the_copies_rest_where_plain_masses_do() {
    let scene = scene();
    let mut plain = Trace::of(&scene);
    let Ok(_) = Simulation::new(&scene, Model::Least).run(&mut plain);
    for coulomb in [0.0, COULOMB] {
        let Session { trace, desks } = session(&scene, coulomb, 4.0);
        // Friction of a grip at rest shifts the copies like a hand whose wanted position is shifted.
        let shift = coulomb / ARM + COUNTS;
        for (peer, desk) in desks.iter().enumerate() {
            let off = distance(trace.copy(peer), plain.copy(peer));
            assert!(off <= shift, "{peer}, friction {coulomb} N: {off} m off, at most {shift} m expected");
            // The driver must know the true position of the grip within the rounding of counts, because KC·(grip − copy) is the force that the hand feels.
            let grip = desk.simulator.with(|device| device.position());
            let seen = trace.device(peer);
            let off = distance(seen, [grip[0], grip[1], grip[2] - 0.125]);
            assert!(off <= COUNTS + 2e-5, "{peer}: the device is {off} m from where it is seen");
        }
        // The expected distance of the copies is k·w/(k + 3/2·KT), with w = 33.5 mm.
        let apart = distance(trace.copy(0), trace.copy(1));
        let k = ARM * 1000.0 / (ARM + 1000.0);
        let expected = k / (k + 450.0);
        assert!((apart - expected * length(WANTED[0])).abs() <= expected * 2.0 * shift, "{apart}");
    }
}

/// Without a limit, the peer `left` pulls with 1.69 N. With a limit of 1 N, its hand comes 6.9 mm closer to its wanted position.
#[test]
fn a_limit_of_force_gives_way_to_the_hand() {
    let Session { trace, desks } = session(&scene(), COULOMB, 1.0);
    assert!((*desks[0].largest.lock().unwrap() - 1.0).abs() < 1e-9, "it is reached");
    let lags = distance(trace.device(0), WANTED[0]);
    assert!((lags - 1.0 / ARM).abs() <= COULOMB / ARM + COUNTS, "{lags} m: 10 mm, and what 0.2 N of friction hold");
}
