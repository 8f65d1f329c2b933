//! The blocks of docs/testing.md that need the feature `scenes`, as they stand there. The test kit's own tests see to it.

use cohaptic_testkit::harness::{Model, NoObserver, Simulation};
use cohaptic_testkit::proptest::prelude::*;
use cohaptic_testkit::strategies::scene::any_scene;
use cohaptic_testkit::{Instant, Testbed, check_scene, time};

#[test]
fn the_room_is_stable() {
    check_scene("testkit/room.toml");
}

#[test]
fn programs_meet_in_the_room() {
    Testbed::from_file("testkit/room.toml").run(|bed| async move {
        let left = bed.host("left").bind("0.0.0.0:0").unwrap();
        let right = bed.host("right").bind("0.0.0.0:7").unwrap();
        for (sent, arrives) in [(0, 24_000_000), (1_000_000_000, 1_005_000_000)] {
            time::sleep_until(Instant::from_nanos(sent)).await;
            left.send_to(b"hello", "right:7").await.unwrap();
            let (_, _, arrived) = right.recv_from_at(&mut [0; 5]).await.unwrap();
            assert_eq!(arrived, Instant::from_nanos(arrives));
        }
    });
}

#[test]
fn a_phone_in_a_car_asks_a_server_overseas() {
    let bed = Testbed::new(["phone", "server"]).access("phone", "lte-driving").links("transatlantic").hit("phone", "server", "drop packet 0");
    bed.run(|bed| async move {
        let server = bed.host("server").bind("0.0.0.0:7").unwrap();
        let phone = bed.host("phone").bind("0.0.0.0:0").unwrap();
        for question in [b"first", b"again"] {
            phone.send_to(question, "server:7").await.unwrap();
        }
        let (_, _, arrived) = server.recv_from_at(&mut [0; 5]).await.unwrap();
        // 42.4 ms to the network of the provider, 38 ms to the other side, and the time of both on the line of the phone.
        assert!(arrived > Instant::from_nanos(80_400_000));
        // The question that was hit has passed the uplink, and not the link behind it.
        let up = bed.access_stats("phone").unwrap().uplink;
        assert_eq!((up.delivered(), bed.link_stats("phone", "server").delivered()), (2, 1));
    });
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn what_is_left_out_of_a_model_changes_nothing(scene in any_scene()) {
        let scene = scene.read().unwrap();
        let [least, general] = [Model::Least, Model::General].map(|model| {
            let Ok(summary) = Simulation::new(&scene, model).run(&mut NoObserver);
            (summary.ending, summary.links)
        });
        assert_eq!(least, general);
    }
}
