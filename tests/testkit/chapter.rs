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
