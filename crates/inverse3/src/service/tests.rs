use super::*;
use crate::protocol::{Reply, Version};

const ID: &str = "04C3";

fn at(milliseconds: u64) -> Instant {
    Instant::from_nanos(1_000_000 * milliseconds)
}

fn still(_: Instant, _: Triple, _: Triple) -> Triple {
    [0.0; 3]
}

fn service(faults: Vec<Fault>) -> Service {
    Service::new(ServiceConfig { faults, ..ServiceConfig::default() }, still)
}

fn force(force: Triple) -> String {
    Request { device: Some(ID.to_owned()), force: Some(force), centred: false, full: false }.write(Format::V35)
}

/// Returns the text frames due until `now`.
fn texts(service: &mut Service, now: Instant) -> Vec<String> {
    let mut found = Vec::new();
    while let Some(transmit) = service.poll_transmit(now) {
        if let Frame::Text(text) = transmit.frame {
            found.push(text);
        }
    }
    found
}

/// Returns the replies to a message at 50 ms, with this fault at that time.
fn answer(kind: FaultKind) -> Vec<String> {
    let mut service = service(vec![Fault::during(kind, at(40), Duration::from_millis(20))]);
    let session = service.connect(at(0)).unwrap();
    assert_eq!(texts(&mut service, at(1)).len(), 1);
    service.receive(at(50), session, &force([0.0; 3]));
    texts(&mut service, at(69))
}

#[test]
fn the_inventory_comes_first_and_then_one_reply_for_each_message() {
    let mut service = service(Vec::new());
    let session = service.connect(at(0)).unwrap();
    assert_eq!(service.poll_transmit(at(0)), None);
    assert_eq!(service.poll_timeout(), Some(Instant::from_nanos(200_000)));
    let inventory = Reply::read(&texts(&mut service, at(1))[0]).unwrap();
    assert_eq!((inventory.session, inventory.devices[0].id.as_str()), (Some(1), ID));
    assert!(inventory.devices[0].config.as_ref().unwrap().is_straight());
    assert!(texts(&mut service, at(1000)).is_empty());
    service.receive(at(1000), session, &force([0.0, 0.0, 0.5]));
    service.receive(at(1000), session, "{}");
    service.receive(at(1000), session, "no message");
    let replies = texts(&mut service, at(1001));
    assert_eq!(replies.len(), 3);
    let device = &Reply::read(&replies[0]).unwrap().devices[0];
    assert_eq!((device.config.is_none(), device.status.is_ready()), (true, true));
    assert_eq!(device.state.unwrap().force, Some([0.0, 0.0, 0.5]));
    assert_eq!((service.observed().messages, service.observed().unreadable, service.observed().forces), (3, 1, 1));
    assert_eq!(Version::of_response(service.version()), Some(Version { major: 3, minor: 5 }));
}

#[test]
fn a_preset_moves_the_origin_into_the_middle() {
    let mut service = service(Vec::new());
    let session = service.connect(at(0)).unwrap();
    let place = |text: &str| Reply::read(text).unwrap().devices.remove(0);
    let inventory = place(&texts(&mut service, at(1))[0]);
    assert_ne!(inventory.state.unwrap().position, [0.0; 3]);
    let first = Request { device: Some(ID.to_owned()), force: None, centred: true, full: true };
    service.receive(at(1), session, &first.write(Format::V35));
    let reply = place(&texts(&mut service, at(2))[0]);
    assert_eq!(reply.config.unwrap().preset.as_deref(), Some(crate::protocol::PRESET));
    assert_eq!(reply.state.unwrap().position, [0.0; 3]);
    // A service of 3.1 has neither presets nor `vector`.
    let mut old = Service::new(ServiceConfig { format: Format::V31, ..ServiceConfig::default() }, still);
    let session = old.connect(at(0)).unwrap();
    old.receive(at(1), session, &first.write(Format::V35));
    old.receive(at(1), session, &force([0.0, 1.0, 0.0]));
    let reply = place(texts(&mut old, at(2)).last().unwrap());
    assert_eq!((reply.config, reply.state.unwrap().force, old.motor_force()), (None, None, [0.0; 3]));
    old.receive(at(3), session, &force([0.0, 1.0, 0.0]).replace("vector", "values"));
    assert_eq!(old.motor_force(), [0.0, 0.0, -1.0]);
}

#[test]
fn a_force_moves_the_grip_until_the_device_idles() {
    let mut service = service(Vec::new());
    let session = service.connect(at(0)).unwrap();
    // Up: Haply's Z is the scene's y.
    service.receive(at(0), session, &force([0.0, 0.0, 0.5]));
    service.advance(at(100));
    assert_eq!(service.motor_force(), [0.0, 0.5, 0.0]);
    let [x, y, z] = service.position();
    assert!(y > 0.005 && x == 0.0 && z == 0.0, "{y}");
    service.advance(at(300));
    assert_eq!((service.motor_force(), service.observed().idled), ([0.0; 3], 1));
    // With m/b = 20 ms the grip comes to rest.
    let rest = service.position()[1];
    service.advance(at(600));
    assert!((service.position()[1] - rest).abs() < 1e-6);
    // A force for another device has no effect.
    service.receive(at(600), session, &force([1.0; 3]).replace(ID, "1234"));
    assert_eq!(service.motor_force(), [0.0; 3]);
}

#[test]
fn each_fault_has_its_effect_on_replies() {
    use FaultKind as K;
    let device = |kind| Reply::read(&answer(kind)[0]).unwrap().devices.remove(0);
    assert!(answer(K::Missing).is_empty());
    assert_eq!(answer(K::Doubled).len(), 2);
    assert!(answer(K::Split).len() == 2 && answer(K::Split).iter().all(|text| Reply::read(text).is_err()));
    assert!(Reply::read(&answer(K::Split).concat()).is_ok());
    assert!(Reply::read(&answer(K::Malformed)[0]).is_err());
    assert!(device(K::FieldMissing).state.is_err());
    assert!(Reply::read(&answer(K::Gone)[0]).unwrap().devices.is_empty());
    assert_eq!(device(K::Renamed).id, OTHER);
    assert!(!device(K::NotReady).status.is_ready());
    assert_eq!(device(K::Jumping).state.unwrap().position[0], 0.05);
    assert!(device(K::Transformed).state.unwrap().is_transformed);
    assert!(!device(K::Stall).state.unwrap().is_transformed);
    assert!(answer(K::Restart).is_empty());
    let mut late = service(vec![Fault { kind: K::Late, when: When::Chance(1.0) }]);
    let session = late.connect(at(0)).unwrap();
    late.receive(at(50), session, "{}");
    // The inventory came before; the reply takes 20 ms longer than 0.2 ms.
    assert_eq!([texts(&mut late, at(70)).len(), texts(&mut late, at(71)).len()], [1, 1]);
}

#[test]
fn faults_end_and_begin_again() {
    use FaultKind as K;
    let during = |kind, from| Fault::during(kind, at(from), Duration::from_millis(10));
    let mut service = service(vec![during(K::Restart, 10), during(K::Gone, 30), during(K::Brake, 50), during(K::Stall, 70), during(K::Turned, 90)]);
    let session = service.connect(at(0)).unwrap();
    let closed = |service: &mut Service, now| {
        let mut found = false;
        while let Some(transmit) = service.poll_transmit(now) {
            found |= transmit.frame == Frame::Close && transmit.session == session;
        }
        found
    };
    assert!(!closed(&mut service, at(9)) && closed(&mut service, at(10)));
    assert_eq!([service.connect(at(19)), service.connect(at(20))], [None, Some(2)]);
    service.receive(at(45), 2, &force([1.0, 0.0, 0.0]));
    assert_eq!(service.motor_force(), [1.0, 0.0, 0.0]);
    service.advance(at(55));
    assert_eq!(service.motor_force(), [0.0; 3]);
    service.advance(at(100));
    let events: Vec<Event> = core::iter::from_fn(|| service.poll_event()).collect();
    let id = || ID.to_owned();
    assert_eq!(events, [Event::Disconnected(id()), Event::Braked(id()), Event::Released(id()), Event::Stalled(id())]);
    assert_eq!(service.poll_timeout().unwrap(), at(20) + Duration::from_micros(200));
}

#[test]
fn chance_is_the_same_with_the_same_seed() {
    let run = |seed| {
        let faults = vec![Fault { kind: FaultKind::Missing, when: When::Chance(0.3) }, Fault { kind: FaultKind::Doubled, when: When::Chance(0.2) }];
        let mut service = Service::new(ServiceConfig { seed, faults, ..ServiceConfig::default() }, still);
        let session = service.connect(at(0)).unwrap();
        (1..200)
            .map(|ms| {
                service.receive(at(ms), session, "{}");
                texts(&mut service, at(ms + 1)).len()
            })
            .collect::<Vec<_>>()
    };
    assert_eq!(run(1), run(1));
    assert_ne!(run(1), run(2));
    assert!(run(1).contains(&0) && run(1).contains(&2));
}

#[test]
fn a_frozen_position_stays_while_the_grip_moves() {
    let freeze = Fault::during(FaultKind::Frozen, at(50), Duration::from_millis(50));
    let mut service =
        Service::new(ServiceConfig { faults: vec![freeze], ..ServiceConfig::default() }, |_: Instant, _: Triple, _: Triple| [0.5, 0.0, 0.0]);
    let session = service.connect(at(0)).unwrap();
    let mut x = |ms| {
        service.receive(at(ms), session, "{}");
        let text = texts(&mut service, at(ms + 1)).pop().unwrap();
        (Reply::read(&text).unwrap().devices[0].state.unwrap().position[0], service.position()[0])
    };
    let ((shown, _), (later, moved), (thawed, true_later)) = (x(50), x(80), x(110));
    assert_eq!(shown, later);
    assert!(moved > later + 0.002 && (thawed - true_later).abs() < 1e-3, "{moved} {later} {thawed}");
}
