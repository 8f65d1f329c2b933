//! The simulated device alone, byte by byte.

use core::time::Duration;

use cohaptic_falcon::ftdi::{self, PACKET};
use cohaptic_falcon::protocol::{Report, nibbles};
use cohaptic_falcon::simulator::{Activity, Simulator, SimulatorConfig, StillHand, Waypoints};
use cohaptic_falcon::transport::Request;
use cohaptic_units::Instant;

use crate::common::{running, seconds};

fn set_up(device: &mut Simulator) {
    device.control(Request::LatencyTimer, 1);
    device.control(Request::BaudRate, ftdi::BAUD_RUNNING);
}

/// Returns a packet with these motor counts, without the encoder of the driver.
fn packet(motors: [i16; 3], control: u8) -> [u8; 16] {
    let mut packet = *b"<AAAAAAAAAAAAAA>";
    for (place, count) in packet[1..13].chunks_exact_mut(4).zip(motors) {
        place.copy_from_slice(&nibbles::encode(count));
    }
    packet[13] = b'A' + control;
    packet
}

/// Writes a packet, advances until a packet with payload is due, and returns this packet with its status bytes.
fn ask(device: &mut Simulator, packet: [u8; 16]) -> Vec<u8> {
    device.write(&packet);
    loop {
        let next = device.next_packet().min(device.now() + Duration::from_micros(50));
        device.advance(next);
        let mut bytes = [0; PACKET];
        let length = device.read_packet(&mut bytes);
        if length > ftdi::STATUS {
            return bytes[..length].to_vec();
        }
    }
}

fn report(bytes: &[u8]) -> Report {
    Report::decode(bytes[2..].try_into().unwrap()).unwrap()
}

#[test]
fn sixteen_bytes_out_cause_sixteen_in_behind_two_of_status() {
    let mut device = Simulator::new(running(), StillHand);
    set_up(&mut device);
    let begin = device.now();
    let answer = ask(&mut device, packet([0; 3], 0));
    assert_eq!((answer.len(), &answer[..2]), (18, &[0x01, 0x60][..]));
    // 107 us to the device, 107 us back, and the timer of 1 ms.
    assert!(device.now() - begin >= Duration::from_micros(213) && device.now() - begin <= Duration::from_millis(3));
    // No more bytes are due, so the next end of the timer gives a packet with status bytes alone.
    let next = device.next_packet();
    device.advance(next);
    assert_eq!(device.read_packet(&mut [0; PACKET]), 2);
}

#[test]
fn encoders_mean_nothing_until_they_are_homed_and_everything_then() {
    let mut device = Simulator::new(running(), Waypoints::homing(Duration::ZERO));
    set_up(&mut device);
    let before = report(&ask(&mut device, packet([0; 3], 1)));
    // At 0.100 m a homed encoder would stand at −740.8.
    assert!(before.encoders.iter().all(|count| count.abs_diff(-741) >= 99) && before.homed == [false; 3], "{before:?}");
    for _ in 0..4200 {
        device.advance(device.now() + Duration::from_millis(1));
        ask(&mut device, packet([0; 3], 1));
    }
    let after = report(&ask(&mut device, packet([0; 3], 1)));
    // In the middle, at 0.125 m, the count is −200.1, as near as dry friction lets the hand bring the grip: 0.2 N on 600 N/m, and 25 counts are a millimetre.
    assert!(after.all_homed() && after.encoders.iter().all(|count| count.abs_diff(-200) <= 12), "{after:?}");
    // One packet without the homing bit ends the homing.
    assert_eq!(report(&ask(&mut device, packet([0; 3], 0))).homed, [false; 3]);
    let forgotten = report(&ask(&mut device, packet([0; 3], 1)));
    assert!(!forgotten.all_homed() && forgotten.encoders.iter().all(|count| count.abs_diff(-200) >= 80), "{forgotten:?}");
}

#[test]
fn motors_hold_a_torque_for_its_time_and_saturate() {
    let mut device = Simulator::new(SimulatorConfig { torque_timeout: Duration::from_millis(25), ..running() }, StillHand);
    set_up(&mut device);
    ask(&mut device, packet([i16::MAX; 3], 1));
    let force = device.motor_force();
    // A torque of 0.4095 N·m at each arm, backwards, is a force straight into the device.
    assert!(force[2] < -5.0 && force[0].abs() < 1e-9 && force[1].abs() < 1e-9, "{force:?}");
    assert_eq!(device.observed().saturated, 1);
    device.advance(device.now() + Duration::from_millis(20));
    assert!(device.motor_force()[2] < -5.0);
    device.advance(device.now() + Duration::from_millis(10));
    assert_eq!((device.motor_force(), device.observed().torque_timeouts), ([0.0; 3], 1));
}

#[test]
fn a_device_that_was_just_switched_on_hears_nothing_of_this() {
    let mut device = Simulator::new(SimulatorConfig::default(), StillHand);
    set_up(&mut device);
    device.write(&packet([4000; 3], 1));
    device.advance(Instant::ZERO + seconds(0.1));
    assert_eq!((device.activity(), device.observed().commands, device.observed().misheard), (Activity::Asleep, 0, 16));
    assert_eq!(device.motor_force(), [0.0; 3]);
}

#[test]
fn bytes_at_the_wrong_speed_are_noise() {
    let mut device = Simulator::new(running(), StillHand);
    device.control(Request::BaudRate, ftdi::BAUD_LOADING);
    device.write(&packet([4000; 3], 1));
    device.advance(Instant::ZERO + seconds(0.1));
    assert_eq!((device.observed().commands, device.observed().misheard), (0, 16));
}
