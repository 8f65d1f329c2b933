//! The test bed as a package `tokio` that stands in for tokio sees it: through the traits of `cohaptic-sockets`.

use std::future::poll_fn;
use std::io::{IoSlice, IoSliceMut};
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

use cohaptic_sockets::{Call, DatagramOption, Stop, Stream};
use cohaptic_testkit::{Bed, Testbed, time};

fn address(text: &str) -> SocketAddr {
    text.parse().unwrap()
}

fn here() -> Arc<dyn cohaptic_sockets::Bed> {
    cohaptic_sockets::bed().expect("a test bed runs on this thread")
}

fn two() -> Testbed {
    Testbed::new(["client", "server"]).links("delay 10ms")
}

async fn read(stream: &dyn Stream) -> Vec<u8> {
    let mut buffer = [0; 100];
    let count = poll_fn(|cx| stream.poll_read(cx, &mut buffer)).await.unwrap();
    buffer[..count].to_vec()
}

async fn echo_once() {
    let listener = here().listen(Call::here("TcpListener::bind"), address("0.0.0.0:7")).unwrap();
    let (stream, _) = poll_fn(|cx| listener.poll_accept(cx)).await.unwrap();
    let said = read(&*stream).await;
    poll_fn(|cx| stream.poll_write(cx, &[IoSlice::new(&said)])).await.unwrap();
}

#[test]
fn a_test_bed_is_registered_while_it_runs() {
    assert!(!cohaptic_sockets::is_in_bed());
    for bed in [two(), two().on_tokio()] {
        bed.run(|_| async { assert!(cohaptic_sockets::is_in_bed()) });
        assert!(cohaptic_sockets::bed().is_none());
    }
    // Also if the run fails.
    let failed = std::panic::catch_unwind(|| two().run(|_| async { panic!("the program fails") }));
    assert!(failed.is_err() && !cohaptic_sockets::is_in_bed());
}

#[test]
fn a_stream_takes_the_round_trips_of_tcp() {
    two().run(|bed| async move {
        bed.host("server").spawn(echo_once());
        let client = bed.host("client").spawn(async {
            let to = here().look_up_text("server:7").unwrap();
            assert_eq!(to, here().look_up("server", 7).unwrap());
            let stream = here().connect(Call::here("TcpStream::connect"), to[0]).await.unwrap();
            assert!(stream.ready().unwrap().writable && !stream.ready().unwrap().readable);
            assert_eq!(stream.try_read(&mut [IoSliceMut::new(&mut [0])]).unwrap_err().kind(), std::io::ErrorKind::WouldBlock);
            assert_eq!(stream.try_write(&[IoSlice::new(b"hel"), IoSlice::new(b"lo")]).unwrap(), 5);
            assert_eq!(read(&*stream).await, b"hello");
            assert_eq!(read(&*stream).await, b"");
            assert!(stream.ready().unwrap().read_closed);
            time::now()
        });
        // The handshake, and the question with its answer: a round trip of 20 ms each.
        assert_eq!(client.await.unwrap().as_nanos(), 40_000_000);
    });
}

#[test]
fn datagrams_and_options_arrive() {
    two().run(|bed| async move {
        let server = bed.host("server").bind("0.0.0.0:7").unwrap();
        bed.host("client").spawn(async {
            let socket = here().bind(Call::here("UdpSocket::bind"), address("0.0.0.0:0")).unwrap();
            socket.set_option(DatagramOption::Ttl, 7).unwrap();
            assert_eq!(socket.option(DatagramOption::Ttl).unwrap(), 7);
            socket.send(b"question", Some(here().look_up("server", 7).unwrap()[0])).unwrap();
            let mut said = Vec::new();
            poll_fn(|cx| socket.poll_receive(cx, false, &mut |bytes, _| said = bytes.to_vec())).await.unwrap();
            assert_eq!(said, b"answer");
        });
        let (_, from) = server.recv_from(&mut [0; 8]).await.unwrap();
        server.send_to(b"answer", from).await.unwrap();
        time::sleep(Duration::from_secs(1)).await;
    });
}

/// Task of another executor that counts how often the task was stopped.
struct Counted(Arc<AtomicU32>);

impl Stop for Counted {
    fn stop(&self) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }

    fn is_over(&self) -> bool {
        false
    }
}

/// Keeps a task of another executor for both hosts, and returns how often each was stopped.
async fn keep(bed: &Bed) -> [Arc<AtomicU32>; 2] {
    let stopped: [Arc<AtomicU32>; 2] = Default::default();
    for (name, counter) in ["client", "server"].into_iter().zip(&stopped) {
        let counted = Counted(Arc::clone(counter));
        bed.host(name).spawn(async move { cohaptic_sockets::host().unwrap().keep(Box::new(counted)) }).await.unwrap();
    }
    stopped
}

#[test]
fn tasks_of_other_executors_end_with_their_host() {
    two().run(|bed| async move {
        assert!(cohaptic_sockets::host().is_none());
        let stopped = keep(&bed).await;
        let counts = || stopped.each_ref().map(|count| count.load(Ordering::Relaxed));
        bed.host("server").crash();
        assert_eq!(counts(), [0, 1]);
        bed.host("client").kill();
        assert_eq!(counts(), [1, 1]);
        // A task is stopped once.
        bed.host("server").restart();
        bed.host("server").crash();
        assert_eq!(counts(), [1, 1]);
    });
}

#[test]
#[should_panic(expected = "`TcpStream::connect` at")]
fn a_socket_on_no_host_is_refused_with_the_place_of_the_call() {
    two().run(|_| async { drop(here().connect(Call::here("TcpStream::connect"), address("10.0.0.2:7")).await) });
}

#[test]
#[expect(clippy::disallowed_methods, reason = "other threads take real time")]
fn time_waits_for_work_on_another_thread() {
    two().on_tokio().run(|bed| async move {
        bed.host("server").spawn(echo_once());
        let hold = here().hold();
        let (sender, receiver) = tokio::sync::oneshot::channel();
        // A packet is under way, and arrives after 10 ms.
        let client = bed.host("client").spawn(async { here().connect(Call::here("TcpStream::connect"), address("10.0.0.2:7")).await.map(drop) });
        tokio::task::yield_now().await;
        std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(50));
            sender.send(()).unwrap();
        });
        // Tokio itself lets time pass only while no function of `spawn_blocking` runs.
        let blocking = tokio::task::spawn_blocking(|| std::thread::sleep(Duration::from_millis(100)));
        receiver.await.unwrap();
        assert_eq!(bed.now().as_nanos(), 0);
        drop(hold);
        blocking.await.unwrap();
        client.await.unwrap().unwrap();
        assert_eq!(bed.now().as_nanos(), 20_000_000);
    });
}
