//! Misuse of the test kit ends with a message that says how to do it right.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use cohaptic_testkit::hit::{Hits, Verdict};
use cohaptic_testkit::{Bed, Testbed, UdpSocket, net, time};

fn bed() -> Testbed {
    Testbed::new(["a", "b"]).links("delay 1ms").seed(1)
}

/// Returns the message with which `act` panics.
fn complaint(act: impl FnOnce()) -> String {
    let payload = catch_unwind(AssertUnwindSafe(act)).expect_err("it gives up");
    payload.downcast_ref::<String>().cloned().or_else(|| payload.downcast_ref::<&str>().map(|text| (*text).to_owned())).unwrap()
}

fn says(act: impl FnOnce(), parts: &[&str]) {
    let text = complaint(act);
    for part in parts {
        assert!(text.contains(part), "no {part:?} in {text:?}");
    }
}

#[test]
fn a_task_that_spins_is_named() {
    for bed in [bed().patience(1000), bed().patience(1000).on_tokio()] {
        let spin = |bed: Bed| async move {
            time::sleep(Duration::from_millis(7)).await;
            drop(bed.host("b").spawn(async {
                loop {
                    time::yield_now().await;
                }
            }));
            time::sleep(Duration::from_secs(1)).await;
        };
        says(|| bed.run(spin), &["time stands still at 0.007 s", "host `b`", "misuse.rs:", "let the task wait for a socket or a `sleep`"]);
    }
}

#[test]
fn what_takes_no_time_does_not_let_it_pass() {
    let parts = ["time stands still at 0.002 s", "again and again without waiting", "let the task wait, for instance by `sleep(..).await`"];
    for bed in [bed().patience(1000), bed().patience(1000).on_tokio()] {
        for way in 0..5 {
            let spin = |bed: Bed| async move {
                time::sleep(Duration::from_millis(2)).await;
                let socket = bed.host("a").bind("0.0.0.0:0").unwrap();
                let later = bed.now() + Duration::from_millis(1);
                match way {
                    0 => while time::now() < later {},
                    1 => while bed.now() < later {},
                    2 => while socket.try_recv(&mut [0; 1]).is_err() {},
                    3 => loop {
                        socket.send_to(b"", "b:1").await.unwrap();
                    },
                    _ => loop {
                        time::sleep(Duration::ZERO).await;
                    },
                }
            };
            let text = complaint(|| bed.clone().run(spin));
            for part in parts {
                assert!(text.contains(part), "no {part:?} in {text:?}");
            }
            // The task is the program itself, and its sockets are of host `a`.
            assert!(text.contains(". The caller is the task that was spawned at crates/testkit/tests/integration/misuse.rs:"), "{text}");
            assert_eq!(text.ends_with(", which called the UDP socket 0.0.0.0:49152 of host `a` last"), way == 2 || way == 3, "{text}");
        }
    }
}

#[test]
fn a_task_that_tries_again_and_again_is_named_with_its_host() {
    for bed in [bed().patience(1000), bed().patience(1000).on_tokio()] {
        let spin = |bed: Bed| async move {
            bed.host("b").spawn(async {
                let socket = UdpSocket::bind("0.0.0.0:7").await.unwrap();
                while socket.try_recv(&mut [0; 1]).is_err() {}
            });
            time::sleep(Duration::from_secs(1)).await;
        };
        let parts = [
            "The caller is the task of host `b` that was spawned at crates/testkit/tests/integration/misuse.rs:",
            "which called the UDP socket 0.0.0.0:7 of host `b` last",
        ];
        says(|| bed.run(spin), &parts);
    }
}

#[test]
fn a_name_that_no_host_has_is_told_with_the_task_that_asks() {
    let asks = " asked for by the task of host `b` that was spawned at crates/testkit/tests/integration/misuse.rs:";
    for bed in [bed(), bed().on_tokio()] {
        let names = |bed: Bed| async move {
            let other = bed.clone();
            bed.host("b").spawn(async move { drop(other.host("c")) });
            time::sleep(Duration::from_secs(1)).await;
        };
        says(|| bed.clone().run(names), &["there is no host `c`; the hosts are a, b; the name was asked for by the task", asks]);
        let sends = |bed: Bed| async move {
            bed.host("b").spawn(async {
                let socket = UdpSocket::bind("0.0.0.0:7").await.unwrap();
                socket.send_to(b"x", "c:7").await.unwrap();
            });
            time::sleep(Duration::from_secs(1)).await;
        };
        says(|| bed.run(sends), &["there is no host `c`; the hosts are a, b; the name was asked for by the task", asks]);
    }
    // Of many hosts not all are named.
    let many = Testbed::new((0..100).map(|host| format!("host-{host}")));
    says(|| drop(many.link("host-0", "host-x", "")), &["there is no host `host-x`; the hosts are host-0, host-1, ", ", host-15 and 84 more"]);
}

#[test]
fn who_waits_for_what_never_comes_is_named() {
    for bed in [bed(), bed().on_tokio()] {
        let wait = |bed: Bed| async move {
            time::sleep(Duration::from_micros(1500)).await;
            let socket = bed.host("a").bind("0.0.0.0:1").unwrap();
            let task = bed.host("a").spawn(async move { socket.recv(&mut [0; 1]).await });
            task.await.unwrap().unwrap();
        };
        says(|| bed.run(wait), &["nothing will ever happen after ", "host `a`", "misuse.rs:", "Put a `timeout` around each wait"]);
    }
}

#[test]
fn test_beds_and_runtimes_are_not_nested() {
    says(
        || bed().run(|_| async { bed().run(|_| async {}) }),
        &["a test bed was started inside the run of another test bed", "Give both programs hosts of one test bed"],
    );
    let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
    says(
        || runtime.block_on(async { bed().on_tokio().run(|_| async {}) }),
        &["a test bed on tokio starts a runtime", "`#[test]` in place of `#[tokio::test]`"],
    );
    // After a failure the next one runs.
    bed().run(|_| async { time::sleep(Duration::from_secs(1)).await });
}

#[test]
fn outside_of_a_test_bed_nothing_can_be_bound_and_no_time_passes() {
    says(
        || drop(time::sleep(Duration::ZERO)),
        &["time passes only inside a running test bed: make the call within `Testbed::run`, on the thread of the run"],
    );
    let place = "at crates/testkit/tests/integration/misuse.rs:";
    let parts = ["`UdpSocket::bind` ", place, " was called outside of a test bed: make the call within `Testbed::run`, on the thread of the run"];
    says(|| drop(UdpSocket::bind("0.0.0.0:0")), &parts);
    says(|| drop(net::lookup_host("a:7")), &["`lookup_host` ", place, " was called outside of a test bed"]);
    let parts = ["`UdpSocket::bind` ", place, " was called by a task that belongs to no host", "`Host::spawn`, or bind with `Host::bind`"];
    for bed in [bed(), bed().on_tokio()] {
        says(|| bed.run(|_| async { drop(UdpSocket::bind("0.0.0.0:0").await) }), &parts);
    }
    // Tokio keeps the panics of its tasks to itself, and the run fails all the same.
    let of_tokio = |_| async {
        drop(tokio::spawn(async { drop(UdpSocket::bind("0.0.0.0:0").await) }));
        time::sleep(Duration::from_secs(1)).await;
    };
    says(|| bed().on_tokio().run(of_tokio), &parts);
    // A name that is wrong lets no time pass, however often it is looked up.
    let again = |bed: Bed| async move { while bed.host("a").bind("c:0").is_err() {} };
    says(|| bed().patience(1000).run(again), &["time stands still at 0 s"]);
    let error = bed().run(|bed| async move { bed.host("a").bind("c:0").unwrap_err().to_string() });
    assert!(error.starts_with("there is no host `c`; the hosts are a, b; the name was asked for by the task that was spawned at "), "{error}");
}

#[test]
fn a_test_bed_that_is_none_is_refused_where_it_is_said() {
    says(|| drop(Testbed::new(Vec::<String>::new())), &["the test bed has no hosts"]);
    says(|| drop(Testbed::new(["a", "a"])), &["two hosts have the name `a`"]);
    says(|| drop(Testbed::new(["a:b"])), &["`a:b` cannot be the name of a host"]);
    says(|| drop(Testbed::new(["10.0.0.1"])), &["`10.0.0.1` cannot be the name of a host"]);
    says(|| drop(bed().link("a", "c", "delay 1ms")), &["there is no host `c`; the hosts are a, b"]);
    says(|| drop(bed().link("a", "a", "delay 1ms")), &["host `a` has no link to itself"]);
    says(|| drop(bed().links("delay 24ms loss 250%")), &["this is not a link", "^^^^ expected a percentage from 0 to 100"]);
    says(|| drop(bed().hit("a", "c", "drop packet 1")), &["there is no host `c`; the hosts are a, b"]);
    says(|| drop(bed().hit("a", "a", "drop packet 1")), &["host `a` has no link to itself"]);
    says(
        || drop(bed().hit("a", "b", "drop third packet")),
        &["these words do not describe hits: 1:6: unknown word \"third\": expected `packet 3`", "^^^^^"],
    );
    says(|| drop(bed().on_packet("c", "b", |_| Verdict::Drop)), &["there is no host `c`"]);
    says(|| drop(bed().hits(&Hits::words("a -> x: drop packet 1"))), &["there is no host `x`"]);
    says(|| bed().run(|bed| async move { drop(bed.host("c")) }), &["there is no host `c`"]);
    says(|| bed().run(|bed| async move { assert_eq!(bed.link_stats("a", "a").offered(), 0) }), &["no link to itself"]);
    let spawned_on_the_dead = |bed: Bed| async move {
        bed.host("a").crash();
        drop(bed.host("a").spawn(async {}));
    };
    says(|| bed().run(spawned_on_the_dead), &["host `a` is down and cannot spawn a task; `Host::restart` brings it back"]);
}

#[test]
fn a_program_that_differs_is_shown_where() {
    use std::cell::Cell;
    for bed in [bed(), bed().on_tokio()] {
        let run = Cell::new(0);
        let program = |bed: Bed| {
            run.set(run.get() + 1);
            let extra = run.get();
            async move {
                let socket = bed.host("a").bind("0.0.0.0:0").unwrap();
                socket.send_to(b"same", "b:1").await.unwrap();
                time::sleep(Duration::from_micros(500 + extra)).await;
                socket.send_to(b"later", "b:1").await.unwrap();
                time::sleep(Duration::from_millis(5)).await;
            }
        };
        let parts = [
            "two runs of the program are not the same",
            "the runs differ from 0.000501 s on, at event 1:",
            "first : 0.000501 s  a -> b  packet 1 sent, 5 bytes",
            "COHAPTIC_TEST_SEED=1",
        ];
        says(|| bed.run_twice(program), &parts);
    }
}

#[test]
fn a_panic_of_any_task_is_the_tests() {
    for bed in [bed(), bed().on_tokio()] {
        let program = |bed: Bed| async move {
            drop(bed.host("b").spawn(async {
                time::sleep(Duration::from_millis(1)).await;
                panic!("from a task");
            }));
            time::sleep(Duration::from_secs(1)).await;
        };
        says(|| bed.run(program), &["from a task"]);
    }
}

#[test]
fn tokio_without_its_runtime_is_told_the_way_out() {
    let way_out = ["this test bed runs on the executor of the test kit", "call `Testbed::on_tokio` before `run`"];
    says(|| bed().run(|_| async { tokio::time::sleep(Duration::from_millis(1)).await }), &way_out);
    says(|| bed().run(|_| async { drop(tokio::time::interval(Duration::from_millis(1))) }), &way_out);
    says(|| bed().run(|_| async { drop(tokio::net::UdpSocket::bind("127.0.0.1:0").await) }), &way_out);
    let of_task = |bed: Bed| async move { bed.host("a").spawn(tokio::time::sleep(Duration::from_millis(1))).await.unwrap() };
    says(|| bed().run(of_task), &way_out);
}

#[test]
fn a_socket_of_the_real_tokio_is_told_the_way_out() {
    let way_out = ["an `AsyncFd` of the real tokio", "`cohaptic_testkit::net`", "`cohaptic tokio`"];
    let bind = async || drop(tokio::net::UdpSocket::bind("127.0.0.1:0").await);
    let connect = async || drop(tokio::net::TcpStream::connect("127.0.0.1:9").await);
    says(|| bed().on_tokio().run(move |_| bind()), &way_out);
    says(|| bed().on_tokio().run(move |bed| async move { bed.host("a").spawn(connect()).await.unwrap() }), &way_out);
    #[cfg(unix)]
    {
        let pair = async || drop(tokio::net::UnixStream::pair());
        says(|| bed().on_tokio().run(move |_| pair()), &way_out);
        #[allow(deprecated, reason = "newer versions of tokio deprecate the safe function")]
        let descriptor = async || drop(tokio::io::unix::AsyncFd::new(std::os::unix::net::UnixStream::pair().unwrap().0));
        says(
            || bed().on_tokio().run(move |_| descriptor()),
            &["Replace an `AsyncFd`, which waits for a descriptor of the system, by a socket or a channel"],
        );
    }
    // Tokio catches the panic of its own task, and the run fails all the same.
    let caught = |_| async move {
        let _ = tokio::task::spawn_local(bind()).await;
        time::sleep(Duration::from_secs(1)).await;
    };
    says(|| bed().on_tokio().run(caught), &way_out);
}

#[test]
fn outside_of_a_test_bed_tokio_says_what_it_says() {
    says(|| drop(tokio::time::sleep(Duration::ZERO)), &["there is no reactor running"]);
}
