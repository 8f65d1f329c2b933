//! A run that does not end is given up.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use cohaptic_testkit::proptest::test_runner::{Config, RngAlgorithm, TestError, TestRng, TestRunner};
use cohaptic_testkit::strategies::any_network;
use cohaptic_testkit::{Bed, Testbed, UdpSocket, time};

fn complaint<F: Future<Output = ()> + 'static>(bed: Testbed, program: impl FnOnce(Bed) -> F) -> String {
    *catch_unwind(AssertUnwindSafe(|| bed.run(program))).expect_err("it is given up").downcast().unwrap()
}

fn silent() -> Testbed {
    Testbed::new(["client", "server"]).link("client", "server", "delay 5ms loss 100%")
}

/// Answers questions.
async fn answer() {
    let socket = UdpSocket::bind("0.0.0.0:7").await.unwrap();
    let mut question = [0; 4];
    while let Ok((_, from)) = socket.recv_from(&mut question).await {
        socket.send_to(&question, from).await.unwrap();
    }
}

/// Asks every 200 ms, until there is an answer to the last question.
async fn ask_for_ever() {
    let socket = UdpSocket::bind("0.0.0.0:0").await.unwrap();
    socket.connect("server:7").await.unwrap();
    for question in 0_u32.. {
        socket.send(&question.to_be_bytes()).await.unwrap();
        let again = time::now() + Duration::from_millis(200);
        let mut answer = [0; 4];
        while time::timeout(again - time::now(), socket.recv(&mut answer)).await.is_ok() {
            if answer == question.to_be_bytes() {
                return;
            }
        }
    }
}

async fn asks(bed: Bed) {
    bed.host("server").spawn(answer());
    bed.host("client").spawn(ask_for_ever()).await.unwrap();
}

#[test]
fn who_asks_for_ever_is_stopped_after_an_hour_with_the_network_and_who_waits_for_what_since_when() {
    for (bed, now) in [(silent(), "3600 s"), (silent().on_tokio(), "3600.")] {
        let text = complaint(bed, asks);
        // Questions leave every 200 ms from 0 s on. The server has begun to wait at 0 s.
        for part in [
            &*format!("the run goes on beyond its time limit of 3600s, at {now}"),
            "A program that tries again needs a last attempt",
            "`Testbed::time_limit` sets another limit. The network:\n  client -> server: delay 5ms loss 100%\nWho waits:\n",
            "\n  the task of host `server` that was spawned at crates/testkit/tests/integration/limits.rs:",
            " has waited since 0 s for a datagram at UDP 0.0.0.0:7\n",
            "\n  the task of host `client` that was spawned at crates/testkit/tests/integration/limits.rs:",
            " has waited since 3600 s for a datagram at UDP 0.0.0.0:49152, or 3600.2 s of the run\n",
            "  the task that was spawned at crates/testkit/tests/integration/limits.rs:",
            " has waited since 0 s for another task",
        ] {
            assert!(text.contains(part), "no {part:?} in {text}");
        }
    }
}

#[test]
fn both_limits_can_be_set() {
    let short = Duration::from_secs(2);
    let text = complaint(silent().time_limit(short), asks);
    assert!(text.starts_with("the run goes on beyond its time limit of 2s, at 2 s."), "{text}");
    let beats = |_| async {
        loop {
            time::sleep(Duration::from_micros(1)).await;
        }
    };
    for bed in [silent(), silent().on_tokio()] {
        let text = complaint(bed.step_limit(1000), beats);
        assert!(text.starts_with("the run goes on beyond its step limit of 1000 polls of tasks, at 0.00"), "{text}");
        assert!(text.contains("`Testbed::step_limit` sets another limit"), "{text}");
    }
    // A run that ends at the limit has ended.
    for bed in [silent(), silent().on_tokio()] {
        bed.time_limit(short).run(|_| time::sleep(short));
    }
    silent().time_limit(Duration::MAX).run(|_| time::sleep(Duration::from_secs(1_000_000)));
}

#[test]
fn tasks_of_tokio_alone_are_stopped_too() {
    let program = |_: Bed| async {
        tokio::spawn(async {
            loop {
                tokio::time::sleep(Duration::from_millis(200)).await;
            }
        })
        .await
        .unwrap()
    };
    let text = complaint(silent().on_tokio().time_limit(Duration::from_secs(60)), program);
    assert!(text.starts_with("the run goes on beyond its time limit of 60s, at 60."), "{text}");
}

#[test]
fn a_property_over_any_network_does_not_hang_with_a_program_that_tries_for_ever() {
    let config = Config { failure_persistence: None, ..Config::default() };
    let mut runner = TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha));
    let failed = runner.run(&any_network(2), |network| {
        Testbed::new(["client", "server"]).network(&network).run(asks);
        Ok(())
    });
    // A delay of more than 200 ms there and back is too long for a program that waits for the answer to its last question.
    let Err(TestError::Fail(why, network)) = failed else { panic!("{failed:?}") };
    assert!(why.message().starts_with("the run goes on beyond its time limit of 3600s"), "{why}");
    let delays: Vec<Duration> = network.links().map(|(_, _, link)| link.config().delay.mean()).collect();
    assert!(delays.iter().sum::<Duration>() >= Duration::from_millis(200), "{network}");
}
