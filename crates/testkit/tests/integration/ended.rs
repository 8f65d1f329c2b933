//! Sockets belong to their run. After the run, in another test bed and on another thread, all their methods return errors.

use std::fmt::Debug;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::pin::pin;
use std::sync::Arc;
use std::task::{Context, Wake, Waker};
use std::time::Duration;

use cohaptic_testkit::hit::Verdict;
use cohaptic_testkit::{Bed, Host, TcpListener, TcpSocket, TcpStream, Testbed, ToSocketAddrs, UdpSocket, time};

/// Sockets, listeners and streams that have outlived their run.
struct Left {
    udp: UdpSocket,
    listener: TcpListener,
    stream: TcpStream,
    socket: TcpSocket,
    host: Host,
    bed: Bed,
}

fn beds() -> [Testbed; 3] {
    let bed = || Testbed::new(["a", "b"]).links("delay 1ms");
    [bed(), bed().on_tokio(), bed().traced()]
}

async fn leave(bed: Bed) -> Left {
    let host = bed.host("a");
    let udp = host.bind("0.0.0.0:7").unwrap();
    udp.connect("b:7").await.unwrap();
    let listener = bed.host("b").listen("0.0.0.0:80").unwrap();
    let stream = host.connect("b:80").await.unwrap();
    let socket = host.scope(async { TcpSocket::new_v4().unwrap() }).await;
    Left { udp, listener, stream, socket, host, bed }
}

/// A run leaves nothing in memory, with each executor: laws live as long as the state of the run.
#[test]
fn the_state_of_a_run_is_dropped_with_the_run() {
    for bed in beds() {
        let of_law = Arc::new(());
        let held = Arc::downgrade(&of_law);
        let bed = bed.on_packet("a", "b", move |_| if Arc::strong_count(&of_law) > 0 { Verdict::Pass } else { Verdict::Drop });
        drop(bed.run(leave));
        assert_eq!(held.strong_count(), 0);
    }
}

/// Returns the output of a future that is ready at its first poll, as it must be.
fn now<F: Future>(future: F) -> F::Output {
    match pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        std::task::Poll::Ready(outcome) => outcome,
        std::task::Poll::Pending => panic!("it waits"),
    }
}

/// Calls every method of the sockets, and returns the errors. Each call must fail.
fn errors(left: &Left) -> Vec<io::Error> {
    let Left { udp, listener, stream, host, .. } = left;
    let mut errors = Vec::new();
    let mut buffer = [0; 10];
    let address = "10.0.0.2:7".parse().unwrap();
    fn failed<T: Debug>(what: &str, errors: &mut Vec<io::Error>, outcome: io::Result<T>) {
        errors.push(outcome.expect_err(what));
    }
    macro_rules! fails {
        ($($outcome:expr),* $(,)?) => {
            $(failed(stringify!($outcome), &mut errors, $outcome);)*
        };
    }
    fails!(
        udp.try_send(b"x"),
        udp.try_send_to(b"x", address),
        now(udp.send(b"x")),
        now(udp.send_to(b"x", "b:7")),
        now(udp.send_to(b"x", address)),
        udp.try_recv(&mut buffer),
        udp.try_peek(&mut buffer),
        now(udp.recv(&mut buffer)),
        now(udp.recv_from_at(&mut buffer)),
        now(udp.readable()),
        now(udp.writable()),
        now(udp.connect("b:7")),
        udp.local_addr(),
        udp.peer_addr(),
        udp.ttl(),
        udp.set_tos_v4(2),
        udp.set_broadcast(true),
        udp.take_error(),
        now(listener.accept()),
        listener.local_addr(),
        listener.set_ttl(7),
        stream.try_write(b"x"),
        stream.try_read(&mut buffer),
        stream.try_read_buf(&mut Vec::new()),
        now(stream.peek(&mut buffer)),
        now(stream.readable()),
        now(stream.writable()),
        now(std::future::poll_fn(|cx| stream.poll_write_ready(cx))),
        stream.local_addr(),
        stream.peer_addr(),
        stream.nodelay(),
        stream.set_nodelay(true),
        stream.set_linger(None),
        stream.take_error(),
        left.socket.bind("10.0.0.1:9".parse().unwrap()),
        left.socket.nodelay(),
        left.socket.set_nodelay(true),
        left.socket.local_addr(),
        host.bind("0.0.0.0:8"),
        host.listen("0.0.0.0:81"),
        now(host.connect("b:80")),
        (host, 7).to_socket_addr(),
    );
    errors
}

#[test]
fn after_the_run_all_that_sockets_are_asked_is_an_error_that_names_the_host() {
    for bed in beds() {
        let left = bed.run(leave);
        for error in errors(&left) {
            let text = error.to_string();
            assert_eq!(error.kind(), io::ErrorKind::ConnectionAborted, "{text}");
            assert!(
                text.contains(" of host `") && text.contains("` was used after the end of its run: make a new one on a host of the present run"),
                "{text}"
            );
        }
        let name = "b:7".to_socket_addr().unwrap_err().to_string();
        assert_eq!(
            name,
            "the name `b` of a host means something only inside a running test bed: make the call within `Testbed::run`, on the thread of the run"
        );
        // The value can still be looked at and dropped.
        assert!(format!("{:?} {:?} {:?} {:?} {:?}", left.udp, left.listener, left.stream, left.host, left.bed).contains("10.0.0.1:7"));
        drop(left);
    }
}

#[test]
fn in_another_test_bed_sockets_and_hosts_of_an_ended_one_are_refused() {
    for (bed, other) in beds().into_iter().zip(beds()) {
        let left = bed.run(leave);
        let spawned = catch_unwind(AssertUnwindSafe(|| {
            other.clone().run(|_| {
                let host = left.host.clone();
                async move { drop(host.spawn(async {})) }
            });
        }));
        let text = spawned.unwrap_err().downcast::<&str>().map_or_else(|text| *text.downcast::<String>().unwrap(), |text| (*text).to_owned());
        assert!(text.contains("host `a` belongs to the test bed of another run"), "{text}");
        let stats = other.run(|bed| async move {
            let _hears = bed.host("b").bind("0.0.0.0:7").unwrap();
            for error in errors(&left) {
                let text = error.to_string();
                assert_eq!(error.kind(), io::ErrorKind::ConnectionAborted, "{text}");
                assert!(text.contains("was used after the end of its run, in the run of another test bed: "), "{text}");
            }
            drop(left);
            time::sleep(Duration::from_millis(10)).await;
            bed.link_stats("a", "b")
        });
        // Nothing of them has come into the other run.
        assert_eq!(stats.offered(), 0);
    }
}

/// Returns the message of a run that fails.
fn complaint(act: impl FnOnce()) -> String {
    let payload = catch_unwind(AssertUnwindSafe(act)).expect_err("it fails");
    payload.downcast_ref::<String>().cloned().or_else(|| payload.downcast_ref::<&str>().map(|text| (*text).to_owned())).unwrap()
}

#[test]
fn a_socket_on_another_thread_fails_the_test_and_does_not_end_the_process() {
    for bed in beds() {
        // The outcome of the thread is thrown away, as is the socket, on that thread.
        let text = complaint(|| {
            bed.clone().run(|bed| async move {
                let socket = bed.host("b").bind("0.0.0.0:7").unwrap();
                let said = std::thread::spawn(move || socket.try_send_to(b"x", "10.0.0.1:7".parse().unwrap()).unwrap_err()).join().unwrap();
                assert_eq!(said.kind(), io::ErrorKind::Unsupported);
                // The socket was dropped there, so that its port is free when the task waits next.
                time::sleep(Duration::from_secs(1)).await;
            });
        });
        assert!(text.contains("a UDP socket of host `b` was used on another thread"), "{text}");
        assert!(text.contains("sockets of a test bed work only on the thread that runs the test bed"), "{text}");
        // A call without an error to return panics on that thread, and the run fails with the same words.
        let text = complaint(|| {
            bed.run(|bed| async move {
                let host = bed.host("b");
                assert!(std::thread::spawn(move || host.change_addresses()).join().is_err());
            });
        });
        assert!(text.contains("a test bed was used on another thread"), "{text}");
    }
}

#[test]
fn what_another_thread_drops_is_let_go_when_the_task_waits() {
    for bed in beds() {
        bed.run(|bed| async move {
            let udp = bed.host("b").bind("0.0.0.0:7").unwrap();
            let listener = bed.host("b").listen("0.0.0.0:80").unwrap();
            let stream = bed.host("a").connect("b:80").await.unwrap();
            let accepted = listener.accept().await.unwrap().0;
            let mut timer = Box::pin(time::sleep(Duration::from_secs(1)));
            assert!(timer.as_mut().poll(&mut Context::from_waker(Waker::noop())).is_pending());
            std::thread::spawn(move || drop((udp, listener, stream, timer))).join().unwrap();
            time::yield_now().await;
            bed.host("b").bind("0.0.0.0:7").unwrap();
            bed.host("b").listen("0.0.0.0:80").unwrap();
            accepted.readable().await.unwrap();
            assert_eq!(accepted.try_read(&mut [0; 1]).unwrap(), 0);
        });
    }
}

/// Waker that owns a socket, as the waker of an executor inside of a task owns what waits there.
struct Owner(#[expect(dead_code, reason = "it is only dropped")] UdpSocket);

impl Wake for Owner {
    fn wake(self: Arc<Self>) {}
}

#[test]
fn a_socket_that_the_state_drops_with_a_waker_is_let_go_when_the_task_waits() {
    for bed in beds() {
        bed.run(|bed| async move {
            let (a, b) = (bed.host("a").bind("0.0.0.0:7").unwrap(), bed.host("b").bind("0.0.0.0:7").unwrap());
            let owner = Waker::from(Arc::new(Owner(bed.host("b").bind("0.0.0.0:8").unwrap())));
            assert!(pin!(b.recv(&mut [0; 1])).poll(&mut Context::from_waker(&owner)).is_pending());
            drop(owner);
            bed.host("b").bind("0.0.0.0:8").unwrap_err();
            a.send_to(b"x", "b:7").await.unwrap();
            assert_eq!(b.recv(&mut [0; 1]).await.unwrap(), 1);
            // The state may keep the waker until another one takes its place.
            assert!(pin!(b.recv(&mut [0; 1])).poll(&mut Context::from_waker(Waker::noop())).is_pending());
            time::yield_now().await;
            bed.host("b").bind("0.0.0.0:8").unwrap();
        });
    }
}
