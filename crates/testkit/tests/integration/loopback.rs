//! Runtimes whose loopback is a link, as the package `tokio` that stands in for tokio uses them. The tokio of these tests is the real one, and sockets are those
//! of the test kit.

use std::panic::{UnwindSafe, catch_unwind};
use std::time::Duration;

use cohaptic_testkit::loopback::Loopback;
use cohaptic_testkit::{TcpListener, TcpStream, UdpSocket};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::runtime::Runtime;
use tokio::time::Instant;

fn runtime(words: &str) -> (Loopback, Runtime) {
    let loopback = Loopback::new(words);
    let mut builder = tokio::runtime::Builder::new_current_thread();
    loopback.prepare(&mut builder);
    (loopback, builder.build().unwrap())
}

/// Runs a program on a runtime of its own.
fn run<F: Future>(words: &str, program: F) -> F::Output {
    let (loopback, runtime) = runtime(words);
    loopback.block_on(program, |run| runtime.block_on(run))
}

async fn serve(listener: TcpListener) {
    while let Ok((mut stream, _)) = listener.accept().await {
        tokio::spawn(async move {
            let (mut read, mut write) = stream.split();
            tokio::io::copy(&mut read, &mut write).await
        });
    }
}

/// Exchanges `rounds` messages of one byte over one connection to `host`, and returns how long this takes.
async fn echo(host: &str, rounds: u8) -> Duration {
    let listener = TcpListener::bind((host, 0)).await.unwrap();
    let port = listener.local_addr().unwrap().port();
    tokio::spawn(serve(listener));
    let begin = Instant::now();
    let mut stream = TcpStream::connect((host, port)).await.unwrap();
    for round in 0..rounds {
        stream.write_all(&[round]).await.unwrap();
        assert_eq!(stream.read_u8().await.unwrap(), round);
    }
    begin.elapsed()
}

/// The handshake and each message take a round trip, which crosses the loopback twice.
#[test]
fn each_crossing_takes_the_delay() {
    for host in ["127.0.0.1", "localhost", "127.0.0.7", "::1", "10.0.0.1"] {
        assert_eq!(run("delay 20ms", echo(host, 3)), Duration::from_millis(4 * 40), "{host}");
    }
    assert_eq!(run("delay 0ms", echo("127.0.0.1", 3)), Duration::ZERO);
}

#[test]
fn datagrams_cross_it_as_well() {
    run("delay 2500us", async {
        let [one, other] = [UdpSocket::bind("127.0.0.1:0").await.unwrap(), UdpSocket::bind("0.0.0.0:0").await.unwrap()];
        let begin = Instant::now();
        one.send_to(b"there", ("127.0.0.1", other.local_addr().unwrap().port())).await.unwrap();
        let (_, from) = other.recv_from(&mut [0; 5]).await.unwrap();
        other.send_to(b"back", from).await.unwrap();
        one.recv(&mut [0; 4]).await.unwrap();
        assert_eq!(begin.elapsed(), Duration::from_millis(5));
        // The news that nobody hears takes a round trip.
        one.connect("127.0.0.1:9").await.unwrap();
        one.send(b"nobody").await.unwrap();
        assert_eq!(one.recv(&mut [0; 4]).await.unwrap_err().kind(), std::io::ErrorKind::ConnectionRefused);
        assert_eq!(begin.elapsed(), Duration::from_millis(10));
    });
}

/// A broadcast comes back to the sockets of the host, once.
#[test]
fn a_broadcast_crosses_it_once() {
    run("delay 1ms", async {
        let socket = UdpSocket::bind("0.0.0.0:7").await.unwrap();
        socket.set_broadcast(true).unwrap();
        let begin = Instant::now();
        socket.send_to(b"all", "255.255.255.255:7").await.unwrap();
        socket.recv(&mut [0; 3]).await.unwrap();
        assert_eq!(begin.elapsed(), Duration::from_millis(1));
        assert!(tokio::time::timeout(Duration::from_secs(1), socket.recv(&mut [0; 3])).await.is_err());
    });
}

/// The loopback is one link, as with `tc qdisc add dev lo`: both directions share its rate.
#[test]
fn both_directions_share_the_rate() {
    run("rate 8mbit", async {
        let [one, other] = [UdpSocket::bind("127.0.0.1:0").await.unwrap(), UdpSocket::bind("127.0.0.1:0").await.unwrap()];
        let begin = Instant::now();
        one.send_to(&[0; 1000], other.local_addr().unwrap()).await.unwrap();
        other.send_to(&[0; 1000], one.local_addr().unwrap()).await.unwrap();
        one.recv(&mut [0; 1000]).await.unwrap();
        // 1000 bytes take 1 ms, and the second datagram leaves after the first.
        assert_eq!(begin.elapsed(), Duration::from_millis(2));
    });
}

#[test]
fn losses_repeat() {
    let lossy = || run("delay 20ms loss 20%", echo("127.0.0.1", 20));
    let took = lossy();
    assert!(took > Duration::from_millis(21 * 40), "{took:?}");
    assert_eq!(took, lossy());
}

/// A runtime has one time. Tasks that were started before a program run beside the program.
#[test]
fn programs_of_one_runtime_follow_each_other() {
    let (loopback, runtime) = runtime("delay 300us");
    let before = runtime.spawn(echo("127.0.0.1", 1));
    let begin = loopback.block_on(async { Instant::now() }, |run| runtime.block_on(run));
    let after = loopback.block_on(
        async {
            assert_eq!(before.await.unwrap(), Duration::from_micros(1200));
            tokio::time::sleep(Duration::from_millis(5)).await;
            echo("127.0.0.1", 1).await;
            Instant::now()
        },
        |run| runtime.block_on(run),
    );
    // Tokio's timers count whole milliseconds, from the beginning of the runtime: 1.2 ms + 5 ms end after 7 ms.
    assert_eq!(after - begin, Duration::from_micros(8200));
}

/// The program may borrow, and need not be `Send`.
#[test]
fn a_program_may_borrow() {
    let mut count = 0;
    run("delay 1ms", async {
        tokio::time::sleep(Duration::from_secs(1)).await;
        count += 1;
    });
    assert_eq!(count, 1);
}

/// Returns the message of the failure.
fn message<T>(program: impl FnOnce() -> T + UnwindSafe) -> String {
    let panic = catch_unwind(program).map(|_| "no failure").unwrap_err();
    panic.downcast_ref::<String>().unwrap().clone()
}

/// The clock of tokio jumps far ahead before the test bed notices, and the message names the last instant at which something happened.
#[test]
fn a_program_that_waits_for_ever_is_ended() {
    let waits = |before| {
        message(move || {
            run("delay 1ms", async move {
                tokio::time::sleep(before).await;
                std::future::pending::<()>().await;
            });
        })
    };
    for (before, expected) in [(0, "after 0 s: no packet"), (1500, "after 1.5 s: no packet")] {
        let text = waits(Duration::from_millis(before));
        assert!(text.contains(expected) && text.contains("Who waits:\n  nobody waits for a socket of the test bed. Another thread"), "{text}");
    }
}

#[test]
fn the_limit_of_time_names_its_variable() {
    let program = async || {
        tokio::time::sleep(Duration::from_secs(7200)).await;
    };
    let text = message(move || run("delay 1ms", program()));
    assert!(text.contains("beyond its time limit of 3600s, at ") && text.contains("the variable COHAPTIC_TEST_LIMIT sets another limit"), "{text}");
}

#[test]
fn other_words_are_refused_with_their_place() {
    let refused = |words: &'static str| message(move || Loopback::new(words));
    let text = refused("delay 20ms loss 1");
    for part in [
        "COHAPTIC_TEST_LOOPBACK cannot be the loopback of the runtime of tokio at",
        "loopback.rs:",
        "^",
        "expected words of tc-netem such as `delay 20ms loss 1%`, or no variable",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert!(refused("bad").contains("bad"));
}
