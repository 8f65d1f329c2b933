//! Messages about wrong use of the test kit, each of which stands in messages.txt.

use std::time::Duration;

use cohaptic_testkit::{Instant, Testbed, UdpSocket, time};

use super::message_of;

const MESSAGES: &str = include_str!("messages.txt");

/// Fails unless a message stands in the file.
fn assert_shown(message: &str) {
    assert!(MESSAGES.contains(message), "messages.txt does not have:\n{message}");
}

fn pair() -> Testbed {
    Testbed::new(["client", "server"])
}

/// Fails unless the file has the beginning of a message, up to `rest`, where the message names a place in a file.
fn assert_begin_shown(message: &str, rest: &str) {
    let (begin, _) = message.split_once(rest).unwrap_or_else(|| panic!("{message}"));
    assert_shown(begin);
}

#[test]
fn a_socket_after_the_crash_of_its_host() {
    pair().run(|bed| async move {
        let socket = bed.host("server").bind("0.0.0.0:7").unwrap();
        time::sleep(Duration::from_secs(1)).await;
        bed.host("server").crash();
        assert_shown(&socket.recv(&mut [0]).await.unwrap_err().to_string());
    });
}

#[test]
fn test_beds_and_runtimes_inside_others() {
    assert_shown(&message_of(|| pair().run(|_| async { pair().run(|_| async {}) })));
    let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
    assert_shown(&message_of(|| runtime.block_on(async { pair().on_tokio().run(|_| async {}) })));
}

#[test]
fn tasks_that_never_wait() {
    let message = message_of(|| {
        pair().run(|_| async {
            loop {
                time::yield_now().await;
            }
        })
    });
    assert_begin_shown(&message, ", the last of them the task");
    let message = message_of(|| pair().patience(1000).run(|_| async { while time::now() < Instant::from_nanos(1) {} }));
    assert_begin_shown(&message, ". The caller is the task");
}

#[test]
fn more_bytes_than_the_limit() {
    let message = message_of(|| {
        pair().links("delay 1000s").byte_limit(1 << 20).run(|bed| async move {
            let socket = bed.host("client").bind("0.0.0.0:0").unwrap();
            loop {
                socket.send_to(&[0; 1000], "server:7").await.unwrap();
            }
        });
    });
    let (begin, end) = (message.find(", used by").unwrap(), message.find(": the test bed holds").unwrap());
    assert_shown(&format!("{}…{}", &message[..begin], &message[end..]));
}

#[test]
fn sockets_after_their_run_and_on_another_thread() {
    let socket = pair().run(|bed| async move { bed.host("server").bind("0.0.0.0:7").unwrap() });
    assert_shown(&socket.try_send(b"hello").unwrap_err().to_string());
    let message = message_of(|| {
        pair().run(|bed| async move {
            let socket = bed.host("server").bind("0.0.0.0:7").unwrap();
            drop(std::thread::spawn(move || socket.try_send(b"hello")).join());
        });
    });
    assert_shown(&message);
}

#[test]
fn multicast() {
    pair().run(|bed| async move {
        let socket = bed.host("client").bind("[::]:0").unwrap();
        assert_shown(&socket.join_multicast_v6(&"ff3e:20:2001:db8::1".parse().unwrap(), 0).unwrap_err().to_string());
        assert_shown(&socket.send_to(b"hello", "[ff3e:20:2001:db8::1]:5353").await.unwrap_err().to_string());
    });
}

#[test]
fn waits_that_never_end() {
    let message = message_of(|| {
        pair().links("delay 24ms").run(|bed| async move {
            let (client, server) = (bed.host("client").bind("0.0.0.0:0").unwrap(), bed.host("server").bind("0.0.0.0:7").unwrap());
            client.send_to(b"hello", "server:7").await.unwrap();
            server.recv(&mut [0; 10]).await.unwrap();
            server.recv(&mut [0; 10]).await.unwrap();
        })
    });
    assert_begin_shown(&message, ":\n");
}

#[test]
fn sockets_without_a_host_and_programs_that_never_end() {
    let after_place = |message: &str| message.split_once(" was called ").map(|(_, rest)| format!("…was called {rest}")).unwrap();
    assert_shown(&after_place(&message_of(|| pair().run(|_| async { drop(UdpSocket::bind("0.0.0.0:7").await) }))));
    assert_shown(&after_place(&message_of(|| drop(UdpSocket::bind("0.0.0.0:7")))));
    let message = message_of(|| {
        pair().link("client", "server", "delay 5ms loss 100%").run(|_| async {
            loop {
                time::sleep(Duration::from_millis(200)).await;
            }
        })
    });
    assert_begin_shown(&message, "\n");
    // The example of the page.
    let (network, _) = message.split_once("\n  the task").unwrap();
    super::assert_shown(network);
}

#[test]
fn names_that_nobody_has_and_what_works_inside_a_run_only() {
    assert_begin_shown(&message_of(|| pair().run(|bed| async move { drop(bed.host("sever")) })), "; the name was asked for by");
    let outside = || {
        let _ = time::now();
    };
    assert_shown(&message_of(outside));
}
