//! The test bed as a package `tokio` that stands in for tokio sees it: through the traits of `cohaptic-sockets`.

use std::future::poll_fn;
use std::io::{IoSlice, IoSliceMut};
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

use cohaptic_sockets::{Call, DatagramOption, Datagrams, Flag, Interface, Membership, Number, Socket, Stop, Stream, Version};
use cohaptic_testkit::tcp::TcpConfig;
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
            poll_fn(|cx| socket.poll_receive(cx, false, &mut |datagram| said = datagram.bytes.to_vec())).await.unwrap();
            assert_eq!(said, b"answer");
        });
        let (_, from) = server.recv_from(&mut [0; 8]).await.unwrap();
        server.send_to(b"answer", from).await.unwrap();
        time::sleep(Duration::from_secs(1)).await;
    });
}

fn datagrams(at: &str) -> Box<dyn Datagrams> {
    here().bind(Call::here("UdpSocket::bind"), address(at)).unwrap()
}

fn socket(version: Version) -> Box<dyn Socket> {
    here().socket(Call::here("TcpSocket::new"), version).unwrap()
}

/// Each option has a value other than its default, so that an option that is not set would be seen.
#[test]
fn each_option_is_set() {
    two().run(|bed| async move {
        let all = bed.host("client").spawn(async {
            for (version, at) in [(Version::Four, "0.0.0.0:0"), (Version::Six, "[::]:0")] {
                let socket = datagrams(at);
                let options = [
                    (DatagramOption::Broadcast, 1),
                    (DatagramOption::Ttl, 7),
                    (DatagramOption::TypeOfService, 8),
                    (DatagramOption::TrafficClass, 16),
                    (DatagramOption::MulticastTtl, 9),
                    (DatagramOption::MulticastLoop4, 0),
                    (DatagramOption::MulticastInterface4, Ipv4Addr::LOCALHOST.to_bits()),
                ];
                let of_six = [(DatagramOption::MulticastHops, 9), (DatagramOption::MulticastLoop6, 0), (DatagramOption::MulticastInterface6, 2)];
                if version == Version::Four {
                    for (option, value) in of_six {
                        assert!(socket.option(option).is_err() && socket.set_option(option, value).is_err(), "{option:?}");
                    }
                }
                for (option, value) in options.into_iter().chain(of_six.into_iter().filter(|_| version == Version::Six)) {
                    assert_ne!(socket.option(option).unwrap(), value, "{option:?}");
                    socket.set_option(option, value).unwrap();
                    assert_eq!(socket.option(option).unwrap(), value, "{option:?}");
                }
                let (four, six) = (Ipv4Addr::new(224, 0, 0, 1), Ipv6Addr::new(0xff02, 0, 0, 0, 0, 0, 0, 1));
                let groups = [(four.into(), Interface::Address(Ipv4Addr::UNSPECIFIED)), (six.into(), Interface::Number(0))];
                for (group, interface) in groups {
                    for membership in [Membership::Join { group, interface }, Membership::Leave { group, interface }] {
                        let has_groups = group.is_ipv4() || version == Version::Six;
                        assert_eq!(socket.change_membership(membership).is_ok(), has_groups, "{membership:?}");
                        // The second time it is an error, as with Linux.
                        assert!(socket.change_membership(membership).is_err(), "{membership:?}");
                    }
                }
                socket.select_interface(Version::Four, Interface::Number(2)).unwrap();
                assert_eq!(socket.option(DatagramOption::MulticastInterface4).unwrap(), 0, "a number is no address");
                assert!(socket.select_interface(Version::Four, Interface::Number(3)).is_err());

                let socket = self::socket(version);
                for flag in [Flag::KeepAlive, Flag::ReuseAddress, Flag::ReusePort, Flag::NoDelay] {
                    assert!(!socket.flag(flag).unwrap(), "{flag:?}");
                    socket.set_flag(flag, true).unwrap();
                    assert!(socket.flag(flag).unwrap(), "{flag:?}");
                }
                // As with Linux, buffers are twice as large as asked for.
                for (number, asked, value) in
                    [(Number::SendBuffer, 10_000, 20_000), (Number::ReceiveBuffer, 10_000, 20_000), (Number::TypeOfService, 8, 8)]
                {
                    socket.set_number(number, asked).unwrap();
                    assert_eq!(socket.number(number).unwrap(), value, "{number:?}");
                }
                socket.bind(address(at)).unwrap();
                assert_eq!(socket.local_addr().unwrap().is_ipv6(), version == Version::Six);
            }
        });
        all.await.unwrap();
    });
}

/// A listener with the backlog 1 lets two connections wait to be accepted, and drops the SYN of the third, which comes again after a second.
#[test]
fn the_backlog_and_the_constants_of_tcp_are_those_of_the_test() {
    two().tcp(TcpConfig { ttl: 9, ..TcpConfig::default() }).run(|bed| async move {
        let server = bed.host("server").spawn(async {
            let socket = socket(Version::Four);
            socket.bind(address("0.0.0.0:7")).unwrap();
            let listener = socket.listen(1).unwrap();
            time::sleep(Duration::from_millis(500)).await;
            for _ in 0..3 {
                poll_fn(|cx| listener.poll_accept(cx)).await.unwrap();
            }
        });
        let client = bed.host("client").spawn(async {
            let (mut took, mut streams) = (Vec::new(), Vec::new());
            for _ in 0..3 {
                let begin = time::now();
                let stream = here().connect(Call::here("TcpStream::connect"), address("10.0.0.2:7")).await.unwrap();
                assert_eq!(stream.ttl().unwrap(), 9);
                stream.shut_down().unwrap();
                // As with Linux, that writing has ended is told when both directions have.
                assert!(!stream.ready().unwrap().write_closed);
                took.push((time::now() - begin).as_millis());
                streams.push(stream);
            }
            time::sleep(Duration::from_secs(2)).await;
            assert!(streams.iter().all(|stream| stream.ready().unwrap().write_closed));
            took
        });
        let took = client.await.unwrap();
        assert_eq!(took, [20, 20, 1020]);
        server.await.unwrap();
    });
}

#[test]
fn a_datagram_that_is_looked_at_stays() {
    two().run(|bed| async move {
        let both = bed.host("client").spawn(async {
            let socket = datagrams("127.0.0.1:0");
            socket.send(b"itself", Some(socket.local_addr().unwrap())).unwrap();
            for peek in [true, true, false] {
                let mut said = Vec::new();
                socket.try_receive(peek, &mut |datagram| said = datagram.bytes.to_vec()).unwrap();
                assert_eq!(said, b"itself");
            }
            assert_eq!(socket.try_receive(false, &mut |_| ()).unwrap_err().kind(), std::io::ErrorKind::WouldBlock);
        });
        both.await.unwrap();
    });
}

/// Test beds and hosts can be entered inside each other, and each is left for the one before.
#[test]
fn guards_bring_back_what_was_before() {
    two().run(|bed| async move {
        let outer = here();
        drop(cohaptic_sockets::enter(here()));
        assert!(Arc::ptr_eq(&outer, &here()));
        let host = bed.host("client").spawn(async { cohaptic_sockets::host().unwrap() }).await.unwrap();
        let elsewhere = std::thread::spawn(move || {
            let guard = cohaptic_sockets::on_host(host);
            let is_there = cohaptic_sockets::host().is_some();
            drop(guard);
            (is_there, cohaptic_sockets::host().is_none())
        });
        assert_eq!(elsewhere.join().unwrap(), (true, true));
    });
}

/// Task of another executor that counts how often the task was stopped.
struct Counted {
    stopped: Arc<AtomicU32>,
    is_over: bool,
}

impl Stop for Counted {
    fn stop(&self) {
        self.stopped.fetch_add(1, Ordering::Relaxed);
    }

    fn is_over(&self) -> bool {
        self.is_over
    }
}

/// Keeps a task of another executor for both hosts, and returns how often each was stopped.
async fn keep(bed: &Bed) -> [Arc<AtomicU32>; 2] {
    let stopped: [Arc<AtomicU32>; 2] = Default::default();
    for (name, counter) in ["client", "server"].into_iter().zip(&stopped) {
        let counted = Counted { stopped: Arc::clone(counter), is_over: false };
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
fn tasks_that_are_over_are_forgotten_and_no_others() {
    two().run(|bed| async move {
        let (stopped, over): (Arc<AtomicU32>, Arc<AtomicU32>) = Default::default();
        let (count, kept) = (Arc::clone(&stopped), Arc::clone(&over));
        bed.host("server")
            .spawn(async move {
                let host = cohaptic_sockets::host().unwrap();
                for _ in 0..100 {
                    host.keep(Box::new(Counted { stopped: Arc::clone(&count), is_over: false }));
                }
                for _ in 0..10_000 {
                    host.keep(Box::new(Counted { stopped: Arc::clone(&kept), is_over: true }));
                }
            })
            .await
            .unwrap();
        // The array doubles, so that at most as many are kept as live, and twice these again.
        assert!(Arc::strong_count(&over) < 400, "{}", Arc::strong_count(&over));
        bed.host("server").crash();
        assert_eq!(stopped.load(Ordering::Relaxed), 100);
        assert_eq!(Arc::strong_count(&over), 1);
    });
}

/// Listens for a signal, and returns how often it came by the end of the run of 10 ms.
async fn count_signals(number: i32) -> u32 {
    let mut signals = cohaptic_sockets::host().unwrap().listen_for(number);
    let mut count = 0;
    while time::timeout(Duration::from_millis(10), poll_fn(|cx| signals.poll_receive(cx))).await.is_ok() {
        count += 1;
    }
    count
}

#[test]
fn a_signal_comes_to_the_program_that_listens() {
    two().run(|bed| async move {
        let (client, server) = (bed.host("client"), bed.host("server"));
        let counts =
            [client.spawn(count_signals(15)), client.spawn(count_signals(15)), client.spawn(count_signals(2)), server.spawn(count_signals(15))];
        time::sleep(Duration::from_millis(1)).await;
        client.signal(15);
        time::sleep(Duration::from_millis(1)).await;
        // Signals that come before the program asks are one.
        client.signal(15);
        client.signal(15);
        let mut found = Vec::new();
        for count in counts {
            found.push(count.await.unwrap());
        }
        assert_eq!(found, [2, 2, 0, 0]);
        // The program handles the signal also when nobody waits for it any more.
        client.signal(15);
        assert!(client.spawn(async { time::now() }).await.is_ok());
    });
}

#[test]
fn a_signal_that_no_program_handles_kills_it_as_with_linux() {
    two().run(|bed| async move {
        let server = bed.host("server");
        for (number, lives) in [(28, true), (15, false), (17, true), (2, false), (18, true), (23, true), (1, false)] {
            let task = server.spawn(time::sleep(Duration::from_millis(1)));
            server.signal(number);
            assert_eq!(task.await.is_ok(), lives, "{number}");
            server.restart();
        }
        // A program that starts anew handles no signal of the one before.
        drop(server.spawn(async { cohaptic_sockets::host().unwrap().listen_for(15) }).await.unwrap());
        server.crash();
        server.restart();
        let task = server.spawn(std::future::pending::<()>());
        server.signal(15);
        assert!(task.await.is_err());
    });
}

#[test]
#[should_panic(expected = "host `server` cannot get the signal 9: expected 1 to 8")]
fn a_signal_that_no_program_can_receive_is_refused() {
    two().run(|bed| async move { bed.host("server").signal(9) });
}

#[test]
#[should_panic(expected = "`TcpStream::connect` at")]
fn a_socket_on_no_host_is_refused_with_the_place_of_the_call() {
    two().run(|_| async { drop(here().connect(Call::here("TcpStream::connect"), address("10.0.0.2:7")).await) });
}

#[test]
#[expect(clippy::disallowed_methods, reason = "other threads take real time")]
fn time_waits_for_work_on_another_thread() {
    Testbed::new(["client", "server"]).links("delay 500us").on_tokio().run(|bed| async move {
        bed.host("server").spawn(echo_once());
        let hold = here().hold();
        let (sender, receiver) = tokio::sync::oneshot::channel();
        // A packet is under way, and arrives within the millisecond, where not tokio moves the clock but the test bed.
        let client = bed.host("client").spawn(async {
            here().connect(Call::here("TcpStream::connect"), address("10.0.0.2:7")).await.unwrap();
            time::now().as_nanos()
        });
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
        assert_eq!(client.await.unwrap(), 1_000_000);
    });
}
