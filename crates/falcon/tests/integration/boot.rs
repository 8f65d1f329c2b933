//! From power-on to running firmware.

use core::time::Duration;
use std::io::Write;

use cohaptic_falcon::boot::{BootError, BootOptions, Firmware, Progress, ensure_loaded, is_loaded, load};
use cohaptic_falcon::simulator::{Activity, Faults, SimulatedTransport, Simulator, SimulatorConfig, StillHand, Waypoints};
use cohaptic_falcon::transport::{Transport, TransportError};

/// Returns an image as long as the usual firmware, with other contents.
fn image() -> Vec<u8> {
    (0..8492_u32).map(|place| (place.wrapping_mul(2_654_435_761) >> 24).to_le_bytes()[0]).collect()
}

fn switched_on() -> SimulatorConfig {
    SimulatorConfig { image: Some(image()), ..SimulatorConfig::default() }
}

fn transport(config: SimulatorConfig) -> SimulatedTransport {
    SimulatedTransport::in_virtual_time(Simulator::new(config, StillHand))
}

fn load_into(transport: &mut SimulatedTransport, firmware: &Firmware) -> (Result<(), BootError>, Vec<Progress>) {
    let mut seen = Vec::new();
    let outcome = load(transport, firmware, &BootOptions::DEFAULT, &mut |progress| seen.push(progress));
    (outcome, seen)
}

#[test]
fn a_file_gets_into_the_device_and_runs() {
    let mut file = tempfile::NamedTempFile::new().unwrap();
    file.write_all(&image()).unwrap();
    let firmware = Firmware::read(file.path()).unwrap();
    let mut transport = transport(switched_on());
    assert_eq!(is_loaded(&mut transport, &BootOptions::DEFAULT), Ok(false));
    let begin = transport.now();
    let (outcome, seen) = load_into(&mut transport, &firmware);
    outcome.unwrap();
    assert_eq!(seen[..2], [Progress::Attempt(1), Progress::Greeted(1)]);
    assert_eq!(seen[seen.len() - 2..], [Progress::Loaded { done: 8492, of: 8492 }, Progress::Running]);
    assert_eq!(seen.iter().filter(|progress| matches!(progress, Progress::Loaded { .. })).count(), 137);
    assert_eq!(transport.simulator().with(|device| device.activity()), Activity::Running);
    // A transfer has 137 blocks. A block takes 62 · 70 us to the device, at least as long until its last byte is back, and at most 16 ms more for the timer.
    let taken = transport.now() - begin;
    assert!((Duration::from_millis(595)..Duration::from_millis(3500)).contains(&taken), "{taken:?}");
    // Running firmware is not loaded again.
    let again = ensure_loaded(&mut transport, &firmware, &BootOptions::DEFAULT, &mut |progress| assert_eq!(progress, Progress::Running));
    assert_eq!(again, Ok(false));
}

#[test]
fn a_deaf_boot_loader_and_a_leading_zero_are_no_obstacle() {
    let firmware = Firmware::new(image()).unwrap();
    for leading_zero in [false, true] {
        let mut transport = transport(SimulatorConfig { leading_zero, deaf_greetings: 17, ..switched_on() });
        let (outcome, seen) = load_into(&mut transport, &firmware);
        outcome.unwrap();
        assert_eq!(seen[1], Progress::Greeted(18));
    }
}

#[test]
fn fragments_are_put_together() {
    let faults = Faults { fragment: 0.5, ..Faults::NONE };
    let mut transport = transport(SimulatorConfig { faults, ..switched_on() });
    // Half of the packets hold 7 of 62 bytes on average, so an echo may take a second.
    let options = BootOptions { patience: Duration::from_secs(2), ..BootOptions::DEFAULT };
    load(&mut transport, &Firmware::new(image()).unwrap(), &options, &mut |_| {}).unwrap();
}

#[test]
fn a_wrong_echo_is_named_and_tried_again() {
    let faults = Faults { wrong_echo: Some(5000), ..Faults::NONE };
    let mut transport = transport(SimulatorConfig { faults, ..switched_on() });
    let (outcome, seen) = load_into(&mut transport, &Firmware::new(image()).unwrap());
    outcome.unwrap();
    let failures: Vec<_> = seen.iter().filter(|progress| matches!(progress, Progress::Failed(_))).collect();
    let sent = image()[5000];
    assert_eq!(failures, [&Progress::Failed(BootError::Echo { at: 5000, sent, found: sent ^ 0x20 })]);
    assert!(seen.contains(&Progress::Attempt(2)) && !seen.contains(&Progress::Attempt(3)));
}

#[test]
fn a_device_without_power_is_said_to_be_one() {
    let faults = Faults { mute: true, ..Faults::NONE };
    let mut transport = transport(SimulatorConfig { faults, ..switched_on() });
    let (outcome, seen) = load_into(&mut transport, &Firmware::new(image()).unwrap());
    assert_eq!(outcome, Err(BootError::NoBootLoader { greetings: 100 }));
    assert_eq!(seen.iter().filter(|progress| matches!(progress, Progress::Attempt(_))).count(), 3);
    assert!(outcome.unwrap_err().to_string().contains("power supply"));
}

#[test]
fn a_file_that_is_no_firmware_does_not_run() {
    let mut transport = transport(switched_on());
    let (outcome, _) = load_into(&mut transport, &Firmware::new(vec![0x55; 4000]).unwrap());
    assert_eq!(outcome, Err(BootError::NotRunning));
}

#[test]
fn lost_bytes_of_the_echo_are_counted() {
    let mut transport = transport(switched_on());
    let simulator = transport.simulator();
    let mut first = None;
    let outcome = load(&mut transport, &Firmware::new(image()).unwrap(), &BootOptions::DEFAULT, &mut |progress| {
        if progress == (Progress::Loaded { done: 620, of: 8492 }) {
            simulator.with(|device| device.set_faults(Faults { mute: true, ..Faults::NONE }));
        }
        if let Progress::Failed(error) = progress {
            first.get_or_insert(error);
        }
    });
    assert_eq!(first, Some(BootError::EchoStopped { back: 620, of: 8492 }));
    assert_eq!(outcome, Err(BootError::NoBootLoader { greetings: 100 }));
}

#[test]
fn an_unplugged_device_ends_it_at_once() {
    let mut transport = transport(switched_on());
    let simulator = transport.simulator();
    let mut attempts = 0;
    let outcome = load(&mut transport, &Firmware::new(image()).unwrap(), &BootOptions::DEFAULT, &mut |progress| match progress {
        Progress::Loaded { done: 1240, .. } => simulator.with(Simulator::unplug),
        Progress::Attempt(attempt) => attempts = attempt,
        Progress::Loaded { .. } | Progress::Greeted(_) | Progress::Failed(_) | Progress::Running => {}
    });
    assert_eq!((outcome, attempts), (Err(BootError::Transport(TransportError::Unplugged)), 1));
}

#[test]
fn a_broken_answer_does_not_spoil_the_next() {
    for seed in 0..20 {
        let faults = Faults { insert_to_host: 0.3, ..Faults::NONE };
        let mut transport = transport(SimulatorConfig { seed, faults, ..switched_on() });
        let simulator = transport.simulator();
        let mut greetings = 0;
        load(&mut transport, &Firmware::new(image()).unwrap(), &BootOptions::DEFAULT, &mut |progress| {
            if let Progress::Greeted(count) = progress {
                greetings = count;
                simulator.with(|device| device.set_faults(Faults::NONE));
            }
        })
        .unwrap();
        // Four bytes arrive unchanged with the probability 0.7⁴ = 0.24, so sixty greetings fail with less than 1e-7.
        assert!(greetings <= 60, "seed {seed}: {greetings}");
    }
}

#[test]
fn asking_whether_firmware_runs_does_not_lose_the_homing() {
    let config = SimulatorConfig { running: true, ..SimulatorConfig::default() };
    let mut transport = SimulatedTransport::in_virtual_time(Simulator::new(config, Waypoints::homing(Duration::ZERO)));
    let simulator = transport.simulator();
    for _ in 0..100 {
        // A look every 30 ms, while the hand moves the grip out and in.
        assert_eq!(is_loaded(&mut transport, &BootOptions::DEFAULT), Ok(true));
        let next = transport.now() + Duration::from_millis(30);
        transport.sleep_until(next);
    }
    simulator.with(|device| {
        assert_eq!(device.homed(), [true; 3]);
        assert_eq!(device.observed().largest_count, 0);
    });
}
