//! A simulated device with a driver, in virtual time.

use core::time::Duration;

use cohaptic_falcon::driver::{Driver, DriverConfig, DriverError, Phase, Setpoint, Status};
use cohaptic_falcon::kinematics::Triple;
use cohaptic_falcon::simulator::{Hand, SharedSimulator, SimulatedTransport, Simulator, SimulatorConfig, Waypoints};
use cohaptic_units::Instant;

pub(crate) const MILLISECOND: Duration = Duration::from_millis(1);

pub(crate) fn seconds(seconds: f64) -> Duration {
    Duration::from_secs_f64(seconds)
}

/// Returns a device with running firmware.
pub(crate) fn running() -> SimulatorConfig {
    SimulatorConfig { running: true, seed: 7, ..SimulatorConfig::default() }
}

/// A driver on a device, with access to the simulation.
pub(crate) struct Bench {
    pub(crate) driver: Driver<SimulatedTransport>,
    pub(crate) simulator: SharedSimulator,
    next: Instant,
}

impl Bench {
    pub(crate) fn new(simulator: SimulatorConfig, hand: impl Hand + 'static, config: DriverConfig) -> Self {
        let transport = SimulatedTransport::in_virtual_time(Simulator::new(simulator, hand));
        let simulator = transport.simulator();
        let driver = Driver::open(transport, config).unwrap();
        let next = driver.now();
        Self { driver, simulator, next }
    }

    /// Returns a bench that a hand has homed and armed, and then moves with this sway.
    pub(crate) fn active(simulator: SimulatorConfig, sway: Triple, frequency: f64, config: DriverConfig) -> Self {
        let mut bench = Self::new(simulator, Waypoints::homing(Duration::ZERO).swaying(sway, frequency), config);
        bench.run(seconds(4.5), |_, _| None).unwrap();
        assert_eq!(bench.driver.status().phase, Phase::Homed);
        bench
    }

    /// Makes one exchange per millisecond, with a force that may depend on time and status.
    pub(crate) fn run(&mut self, span: Duration, mut force: impl FnMut(Instant, &Status) -> Option<Triple>) -> Result<(), DriverError> {
        let end = self.driver.now() + span;
        while self.driver.now() < end {
            let at = self.driver.now();
            let wanted = force(at, self.driver.status()).map(|force| Setpoint { force, at });
            self.driver.exchange(wanted)?;
            self.next = (self.next + MILLISECOND).max(self.driver.now());
            self.driver.sleep_until(self.next);
        }
        Ok(())
    }

    /// Returns the largest motor count that the device has received before homing.
    pub(crate) fn unhomed_count(&self) -> u16 {
        self.simulator.with(|device| device.observed().largest_count_unhomed)
    }
}

pub(crate) fn distance(a: Triple, b: Triple) -> f64 {
    let [x, y, z] = [0, 1, 2].map(|axis| a[axis] - b[axis]);
    (x * x + y * y + z * z).sqrt()
}

/// Returns the position in the frame of the device for a position of a driver with the default origin.
pub(crate) fn in_device(position: Triple) -> Triple {
    [position[0], position[1], position[2] + 0.125]
}
