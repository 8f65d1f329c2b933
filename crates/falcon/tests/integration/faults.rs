//! Faults of the connection, and their effects.

use cohaptic_device::ZeroCause as Cause;
use cohaptic_falcon::driver::{DriverConfig, DriverError, Phase};
use cohaptic_falcon::protocol::{Buttons, Leds};
use cohaptic_falcon::safety::ZeroCause;
use cohaptic_falcon::simulator::{Faults, Simulator, SimulatorConfig};
use cohaptic_falcon::transport::TransportError;

use crate::common::{Bench, MILLISECOND, distance, in_device, running, seconds};

fn active() -> Bench {
    Bench::active(running(), [0.01, 0.0, 0.01], 0.5, DriverConfig::DEFAULT)
}

/// Runs a weak spring, so that a fault can end a force.
fn spring(bench: &mut Bench, span: f64) -> Result<(), DriverError> {
    bench.run(seconds(span), |_, status| Some(status.reading.map_or([0.0; 3], |reading| reading.position.map(|part| -100.0 * part))))
}

#[test]
fn fragments_cost_time_and_nothing_else() {
    let mut bench = active();
    bench.simulator.with(|device| device.set_faults(Faults { fragment: 0.3, ..Faults::NONE }));
    spring(&mut bench, 3.0).unwrap();
    let statistics = *bench.driver.statistics();
    assert_eq!((statistics.garbage_bytes, statistics.implausible, statistics.unhomed), (0, 0, 0));
    assert!(statistics.reports > 1000);
    assert_eq!(bench.driver.status().phase, Phase::Active);
}

#[test]
fn garbage_is_counted_and_passed_by() {
    for seed in 0..8 {
        let mut bench = Bench::active(SimulatorConfig { seed, ..running() }, [0.01, 0.0, 0.01], 0.5, DriverConfig::DEFAULT);
        let faults = Faults {
            drop_to_host: 0.003,
            garble_to_host: 0.003,
            insert_to_host: 0.01,
            drop_to_device: 0.002,
            garble_to_device: 0.002,
            ..Faults::NONE
        };
        bench.simulator.with(|device| device.set_faults(faults));
        let simulator = bench.simulator.clone();
        let (mut far, mut ticks) = (0, 0);
        bench
            .run(seconds(3.0), |_, status| {
                ticks += 1;
                if let Some(reading) = status.reading {
                    // A flipped bit in a number may move an encoder by up to 300 counts and be believed, which is 15 mm.
                    let error = distance(in_device(reading.position), simulator.with(|device| device.position()));
                    assert!(error < 0.02, "{error}");
                    far += u32::from(error > 0.001);
                }
                Some([0.0, 0.0, 0.5])
            })
            .unwrap();
        let statistics = *bench.driver.statistics();
        // One packet in twelve is damaged in one direction or the other.
        assert!(statistics.garbage_bytes > 100 && statistics.timeouts > 20, "{statistics:?}");
        assert!(statistics.reports > 1000, "{statistics:?}");
        // Wrong positions that are believed are rare.
        assert!(far * 20 < ticks, "{far} of {ticks}");
        bench.simulator.with(|device| device.set_faults(Faults::NONE));
        spring(&mut bench, 0.2).unwrap();
        let garbage = bench.driver.statistics().garbage_bytes;
        spring(&mut bench, 0.5).unwrap();
        assert_eq!(bench.driver.statistics().garbage_bytes, garbage);
    }
}

#[test]
fn a_lost_byte_does_not_lose_the_place() {
    let mut bench = active();
    for _ in 0..50 {
        bench.simulator.with(|device| device.set_faults(Faults { drop_to_host: 0.2, ..Faults::NONE }));
        bench.run(2 * MILLISECOND, |_, _| None).unwrap();
        bench.simulator.with(|device| device.set_faults(Faults::NONE));
        bench.run(10 * MILLISECOND, |_, _| None).unwrap();
        let before = *bench.driver.statistics();
        bench.run(10 * MILLISECOND, |_, _| None).unwrap();
        let after = *bench.driver.statistics();
        // The stream is aligned again and no answer is late: one report for each exchange.
        assert_eq!((after.garbage_bytes, after.timeouts), (before.garbage_bytes, before.timeouts));
        assert_eq!(after.reports - before.reports, after.exchanges - before.exchanges);
    }
}

#[test]
fn an_answer_that_came_late_makes_no_other_late() {
    let config = DriverConfig { patience: 2 * MILLISECOND, ..DriverConfig::DEFAULT };
    let mut bench = Bench::active(running(), [0.0; 3], 0.0, config);
    for round in 0..40_u8 {
        bench.simulator.with(|device| device.set_faults(Faults { fragment: 0.9, ..Faults::NONE }));
        bench.run(20 * MILLISECOND, |_, _| None).unwrap();
        bench.simulator.with(|device| device.set_faults(Faults::NONE));
        bench.run(10 * MILLISECOND, |_, _| None).unwrap();
        // The state of the device at the arrival of a packet is in the report of the same exchange.
        let buttons = Buttons::from_bits(round);
        bench.simulator.with(|device| device.press(buttons));
        assert_eq!(bench.driver.exchange(None).unwrap().buttons, buttons, "round {round}");
    }
    let timeouts = bench.driver.statistics().timeouts;
    assert!(timeouts > 20, "{timeouts}");
}

#[test]
fn unplugging_is_noticed_at_once_and_for_good() {
    let mut bench = active();
    spring(&mut bench, 0.2).unwrap();
    assert!(bench.driver.status().motors.get() != [0; 3]);
    bench.simulator.with(Simulator::unplug);
    assert_eq!(spring(&mut bench, 0.1), Err(DriverError::Transport(TransportError::Unplugged)));
    assert_eq!((bench.driver.status().phase, bench.driver.status().force), (Phase::Stopped, [0.0; 3]));
    assert_eq!(bench.simulator.with(|device| device.motor_force()), [0.0; 3]);
    // After a power cycle the stopped driver sends nothing to the motors.
    bench.simulator.with(Simulator::power_cycle);
    let _ = spring(&mut bench, 0.1);
    assert_eq!(bench.driver.status().force, [0.0; 3]);
    assert_eq!(bench.simulator.with(|device| device.observed().largest_count), 0);
}

#[test]
fn a_device_that_falls_silent_gets_no_force_and_is_given_up() {
    let mut bench = active();
    spring(&mut bench, 0.2).unwrap();
    bench.simulator.with(|device| device.set_faults(Faults { mute: true, ..Faults::NONE }));
    let begin = bench.driver.now();
    let error = spring(&mut bench, 5.0).unwrap_err();
    assert!(matches!(error, DriverError::Silent { silence } if silence > seconds(1.0) && silence < seconds(1.1)), "{error:?}");
    assert!(bench.driver.now() - begin < seconds(1.1));
    assert!(bench.driver.statistics().zeroed_by(ZeroCause::Gate(Cause::StaleReading)) > 100);
    assert_eq!(bench.simulator.with(|device| device.motor_force()), [0.0; 3]);
    // The device answers again and is still homed, but a failed driver stays stopped.
    bench.simulator.with(|device| device.set_faults(Faults::NONE));
    spring(&mut bench, 0.2).unwrap();
    assert_eq!(bench.driver.status().homed, [true; 3]);
    assert_eq!((bench.driver.status().phase, bench.driver.status().force), (Phase::Stopped, [0.0; 3]));
}

#[test]
fn losing_one_encoder_ends_force_until_it_is_homed_and_armed_again() {
    for encoder in 0..3 {
        let mut bench = active();
        bench.run(seconds(0.2), |_, _| Some([0.0, 0.0, 1.0])).unwrap();
        bench.simulator.with(|device| device.lose_homing(encoder));
        // The packet on its way was made before the device reported the loss; the next packet follows the report.
        bench.run(3 * MILLISECOND, |_, _| Some([0.0, 0.0, 1.0])).unwrap();
        bench
            .run(seconds(0.2), |_, status| {
                assert_eq!((status.force, status.phase, status.reading), ([0.0; 3], Phase::Homing, None));
                Some([0.0, 0.0, 1.0])
            })
            .unwrap();
        assert_eq!(bench.simulator.with(|device| device.leds()), Leds::RED);
        assert_eq!(bench.driver.statistics().unhomed, 1);
        // The grip passes the index again without going out, so the device is homed and not armed.
        let now = bench.driver.now().as_nanos();
        let path = [(1, 0.125), (500, 0.085), (1000, 0.125)].map(|(ms, z)| (core::time::Duration::from_nanos(now + ms * 1_000_000), [0.0, 0.0, z]));
        bench.simulator.with(|device| device.set_hand(cohaptic_falcon::simulator::Waypoints::new(path)));
        bench
            .run(seconds(1.5), |_, status| {
                assert_eq!(status.force, [0.0; 3]);
                Some([0.0, 0.0, 1.0])
            })
            .unwrap();
        assert_eq!(bench.driver.status().phase, Phase::Homed);
        assert!(bench.driver.statistics().zeroed_by(ZeroCause::Gate(Cause::NotArmed)) > 100);
    }
}

#[test]
fn a_leap_is_not_believed_at_once_and_ends_force_when_it_is() {
    let mut bench = active();
    let pull = [0.0, 0.0, 1.0];
    bench.run(seconds(0.2), |_, _| Some(pull)).unwrap();
    let place = bench.driver.status().reading.unwrap().position;
    bench.simulator.with(|device| device.slip(0, 700));
    let mut seen = vec![];
    bench
        .run(seconds(0.1), |_, status| {
            seen.push((status.reading.map(|reading| reading.position), status.force));
            // The jump of the counts must not appear as a velocity: the hand moves at some centimetres per second.
            assert!(status.reading.is_none_or(|reading| distance(reading.velocity, [0.0; 3]) < 0.2), "{status:?}");
            Some(pull)
        })
        .unwrap();
    assert_eq!(bench.driver.statistics().implausible, 3);
    // While the jump is not believed, the old position stays. Then there is no position and no force, until ten reports agree.
    let leap = seen.iter().position(|(position, _)| position.is_none()).unwrap();
    assert!(leap >= 3 && seen[..leap].iter().all(|(position, _)| distance(position.unwrap(), place) < 0.002));
    let back = leap + seen[leap..].iter().position(|(position, _)| position.is_some()).unwrap();
    assert_eq!(back - leap, 9);
    // The force of an exchange is computed before its report arrives.
    assert!(seen[leap + 1..back].iter().all(|(_, force)| *force == [0.0; 3]));
    assert!(seen[back..].iter().all(|(position, _)| distance(position.unwrap(), place) > 0.01));
    assert_eq!(seen.last().unwrap().1, pull);
}

#[test]
fn a_device_without_firmware_is_silent() {
    let mut bench = Bench::new(SimulatorConfig::default(), cohaptic_falcon::simulator::StillHand, DriverConfig::DEFAULT);
    assert!(matches!(bench.run(seconds(3.0), |_, _| None), Err(DriverError::Silent { .. })));
    assert_eq!(bench.driver.statistics().reports, 0);
}
