//! Refused calls of TCP, whose errors are those of UDP for the same fault.

use std::io::{self, ErrorKind};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::pin::Pin;

use cohaptic_testkit::tcp::TcpConfig;
use cohaptic_testkit::{Bed, TcpListener, TcpSocket, TcpStream, Testbed, time};

use crate::tcp::beds;

/// Returns the kind and the message of the error of `outcome`.
fn said<T>(outcome: io::Result<T>) -> String {
    let error = outcome.map(drop).unwrap_err();
    format!("{:?}: {error}", error.kind())
}

/// Linux tells `tcp_rmem[1]` of a socket whose buffer grows, and twice the size that was set.
#[test]
fn a_socket_tells_the_size_of_its_receive_buffer() {
    for bed in beds() {
        let socket =
            bed.run_twice(|bed| async move { bed.host("a").scope(async { TcpSocket::new_v4().unwrap().recv_buffer_size().unwrap() }).await });
        assert_eq!(socket, 131_072);
    }
}

#[test]
fn bad_input_is_an_error_that_says_what_is_wrong() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let (a, b) = (bed.host("a"), bed.host("b"));
            let udp = a.bind("0.0.0.0:0").unwrap();
            for to in ["192.0.2.1:5", "c:5", "nonsense"] {
                assert_eq!(said(a.connect(to).await), said(udp.send_to(b"x", to).await), "{to}");
            }
            assert_eq!(said(a.listen((b.ip(), 80))), said(a.bind((b.ip(), 80))));
            let of_other = a
                .scope(async {
                    let socket = TcpSocket::new_v4().unwrap();
                    said(socket.connect("[fd00::2]:5".parse().unwrap()).await)
                })
                .await;
            assert!(of_other.starts_with("Uncategorized"), "{of_other}");
        });
    }
}

#[test]
fn a_task_that_lives_on_no_host_is_told_the_way_out() {
    for bed in beds() {
        bed.run(|bed| async move {
            let _listener = bed.host("b").listen("0.0.0.0:80").unwrap();
            let stream = bed.host("a").scope(TcpStream::connect("b:80")).await.unwrap();
            assert_eq!(stream.local_addr().unwrap().ip(), bed.host("a").ip());
        });
    }
    let told = |program: fn() -> Pin<Box<dyn Future<Output = ()>>>, parts: &[&str]| {
        for bed in beds() {
            let panic = catch_unwind(AssertUnwindSafe(|| bed.run(|_| program()))).unwrap_err();
            let text = panic.downcast_ref::<String>().unwrap();
            assert!(parts.iter().all(|part| text.contains(part)) && text.contains(" at crates/testkit/tests/integration/tcp/limits.rs:"), "{text}");
        }
    };
    // A program that tries again swallows an error.
    told(
        || Box::pin(async { while TcpStream::connect("b:80").await.is_err() {} }),
        &["`TcpStream::connect` at ", "no host", "`Host::scope`", "`Host::connect`", "`Connector`"],
    );
    told(|| Box::pin(async { drop(TcpListener::bind("0.0.0.0:80").await) }), &["`TcpListener::bind` at ", "listen with `Host::listen`"]);
    told(|| Box::pin(async { drop(TcpSocket::new_v4()) }), &["`TcpSocket::new_v4` at ", "wrap the call in `Host::scope`"]);
}

#[test]
fn outside_of_a_run_nothing_is_opened_and_the_place_is_told() {
    for act in [|| drop(TcpStream::connect("b:80")), || drop(TcpListener::bind("0.0.0.0:80")), || drop(TcpSocket::new_v6())] {
        let panic = catch_unwind(act).unwrap_err();
        let text = panic.downcast_ref::<String>().unwrap();
        assert!(
            text.contains(" at crates/testkit/tests/integration/tcp/limits.rs:")
                && text.ends_with(" was called outside of a test bed: make the call within `Testbed::run`, on the thread of the run"),
            "{text}"
        );
    }
}

#[test]
fn constants_that_cannot_be_are_refused_where_they_are_said() {
    let text = |act: &dyn Fn()| *catch_unwind(AssertUnwindSafe(act)).unwrap_err().downcast::<String>().unwrap();
    let bad = TcpConfig { mtu: 5, ..TcpConfig::default() };
    assert_eq!(text(&|| drop(Testbed::new(["a"]).tcp(bad.clone()))), "these constants of TCP are not valid: the MTU 5 is below 128 bytes");
    assert!(text(&|| drop(Testbed::new(["a"]).tcp_of("b", TcpConfig::default()))).contains("there is no host `b`"));
}

#[test]
fn all_dynamic_ports_can_be_used_at_once_and_one_more_is_refused() {
    let bed = Testbed::new(["a", "b"]);
    bed.run(|bed| async move {
        let listener = bed.host("b").listen("0.0.0.0:80").unwrap();
        let mut streams = Vec::new();
        for _ in 0..16_384 {
            streams.push((bed.host("a").connect("b:80").await.unwrap(), listener.accept().await.unwrap()));
        }
        let error = bed.host("a").connect("10.0.0.2:80").await.unwrap_err();
        assert_eq!(error.kind(), ErrorKind::AddrNotAvailable);
        assert!(error.to_string().starts_with("all 16384 dynamic ports of host `a` are taken; "), "{error}");
        // Another peer is another connection.
        let _other = bed.host("b").listen("0.0.0.0:81").unwrap();
        bed.host("a").connect("b:81").await.unwrap();
    });
}

#[test]
fn a_loop_that_reads_the_end_again_and_again_is_found() {
    for bed in beds() {
        let program = |bed: Bed| async move {
            let listener = bed.host("b").listen("0.0.0.0:80").unwrap();
            let client = bed.host("a").connect("b:80").await.unwrap();
            drop(listener.accept().await.unwrap());
            time::sleep(crate::tcp::R).await;
            while client.try_read(&mut [0; 8]).is_ok() {}
        };
        let panic = catch_unwind(AssertUnwindSafe(|| bed.patience(1000).run(program))).unwrap_err();
        assert!(panic.downcast_ref::<String>().unwrap().contains("time stands still at 0.25 s"), "{panic:?}");
    }
}
