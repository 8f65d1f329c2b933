//! Sockets of this machine. No test asserts a time, because a machine may be slow.

use std::io::{Read as _, Write as _};
use std::net::{Ipv4Addr, TcpStream};
use std::time::Duration;

use cohaptic_device::{Device as _, GatedForce};
use cohaptic_units::Instant;

use super::*;
use crate::client::{ClientConfig, Phase, Snapshot};
use crate::protocol::{Format, Version};
use crate::service::{Fault, FaultKind, Service, ServiceConfig, SwayingHand};

const ANYWHERE: SocketAddr = SocketAddr::new(std::net::IpAddr::V4(Ipv4Addr::LOCALHOST), 0);
const STILL: SwayingHand = SwayingHand { amplitude: [0.0; 3], frequency: 0.0 };

fn serve(config: ServiceConfig) -> ServiceThread {
    ServiceThread::start(Service::new(config, STILL), ANYWHERE).unwrap()
}

fn device(address: SocketAddr, mut config: ClientConfig) -> Inverse3 {
    // A busy machine replies late. Only arming needs fresh readings here.
    config.limits.reading_age = Duration::from_secs(1);
    Inverse3::start(address, config, Duration::from_millis(1), || {}).unwrap()
}

/// Waits for a state, without a limit: a test that waits for ever fails by the limit of the test runner.
fn wait_for(device: &mut Inverse3, is_there: impl Fn(&Snapshot) -> bool) -> Snapshot {
    loop {
        device.hold(Instant::ZERO, Duration::ZERO, GatedForce::ZERO);
        if let Some(snapshot) = device.snapshot().filter(&is_there) {
            return snapshot;
        }
        std::thread::park_timeout(Duration::from_millis(1));
    }
}

#[test]
fn a_device_arms_over_sockets_and_reports_its_exchanges() {
    let service = serve(ServiceConfig::default());
    let mut device = device(service.address(), ClientConfig::DEFAULT);
    assert_eq!(device.description().motions, 3);
    let snapshot = wait_for(&mut device, |snapshot| snapshot.phase == Phase::Active);
    assert!(snapshot.reading.unwrap().0.position.iter().all(|part| part.abs() < 1e-9));
    assert!(device.read(Instant::ZERO).is_some());
    let summary = device.finish();
    assert_eq!((summary.device.as_deref(), summary.version), (Some("04C3"), Some(Version { major: 3, minor: 5 })));
    assert!(summary.report.readings > 0 && summary.report.p50 > Duration::ZERO && summary.report.connections == 1, "{summary:?}");
    assert_eq!((device.snapshot().unwrap().phase, device.is_running()), (Phase::Stopped, false));
    assert_eq!(service.with(|service| service.observed().largest_force), 0.0);
}

#[test]
fn a_device_comes_back_after_a_restart() {
    let restart = Fault::during(FaultKind::Restart, Instant::from_nanos(500_000_000), Duration::from_millis(100));
    let service = serve(ServiceConfig { faults: vec![restart], ..ServiceConfig::default() });
    let mut device = device(service.address(), ClientConfig::DEFAULT);
    wait_for(&mut device, |snapshot| snapshot.reading.is_some());
    wait_for(&mut device, |snapshot| snapshot.phase == Phase::Connecting);
    wait_for(&mut device, |snapshot| snapshot.phase == Phase::Active);
    assert!(device.finish().report.connections >= 2);
}

#[test]
fn an_emergency_brake_is_heard() {
    let brake = Fault::during(FaultKind::Brake, Instant::from_nanos(1_000_000_000), Duration::from_secs(3600));
    let service = serve(ServiceConfig { faults: vec![brake], ..ServiceConfig::default() });
    let mut device = device(service.address(), ClientConfig::DEFAULT);
    wait_for(&mut device, |snapshot| snapshot.phase == Phase::Braked);
    assert!(device.facts().summary().hears_events);
}

#[test]
fn a_service_without_presets_is_refused() {
    let service = serve(ServiceConfig { format: Format::V31, ..ServiceConfig::default() });
    let mut device = device(service.address(), ClientConfig::DEFAULT);
    let snapshot = wait_for(&mut device, |snapshot| matches!(snapshot.phase, Phase::Refused(_)));
    assert_eq!(snapshot.force, [0.0; 3]);
    assert!(device.finish().refusal.is_some());
}

#[test]
fn a_missing_service_is_waited_for() {
    let address = serve(ServiceConfig::default()).address();
    let mut device = device(address, ClientConfig::DEFAULT);
    wait_for(&mut device, |snapshot| snapshot.phase == Phase::Connecting);
    while device.facts().summary().error.is_none() {
        std::thread::park_timeout(Duration::from_millis(1));
    }
    assert_eq!(device.finish().report.connections, 0);
}

#[test]
fn addresses_of_other_machines_are_refused() {
    let elsewhere = "192.0.2.1:10001".parse().unwrap();
    let device = Inverse3::start(elsewhere, ClientConfig::DEFAULT, Duration::from_millis(1), || {});
    assert!(matches!(device, Err(StartError::Remote(address)) if address == elsewhere));
    let service = ServiceThread::start(Service::new(ServiceConfig::default(), STILL), "0.0.0.0:0".parse().unwrap());
    assert!(matches!(service, Err(StartError::Remote(_))));
    assert_eq!(events_of(SERVICE).unwrap().port(), 10020);
}

/// A program that says nothing, or nonsense, does not stop the service for others.
#[test]
fn strange_programs_are_dropped() {
    let service = serve(ServiceConfig::default());
    let mut silent = TcpStream::connect(service.address()).unwrap();
    let mut loud = TcpStream::connect(service.address()).unwrap();
    loud.write_all(&[0xFF; 4096]).unwrap();
    let mut device = device(service.address(), ClientConfig::DEFAULT);
    wait_for(&mut device, |snapshot| snapshot.reading.is_some());
    assert!(matches!(silent.read(&mut [0; 16]), Ok(0) | Err(_)));
    let mut old = TcpStream::connect(service.address()).unwrap();
    old.write_all(b"GET /version HTTP/1.1\r\nHost: localhost\r\n\r\n").unwrap();
    let mut answer = String::new();
    old.read_to_string(&mut answer).unwrap();
    assert!(answer.ends_with("{\"project_version\":\"3.5.0\"}"), "{answer}");
}
