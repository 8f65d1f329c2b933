//! Handshakes of connections, successful and failed.

use std::io::ErrorKind;
use std::time::Duration;

use cohaptic_testkit::hit::Verdict;
use cohaptic_testkit::tcp::{Flags, State, TcpConfig};
use cohaptic_testkit::{Bed, Instant, TcpSocket, TcpStream, Testbed, time};
use tokio::io::AsyncReadExt;

use crate::tcp::{R, beds, millis};

#[test]
fn connect_takes_a_round_trip_and_accept_half_of_one_more() {
    let bed = Testbed::new(["a", "b"]).links("delay 1234567ns");
    for bed in [bed.clone(), bed.on_tokio()] {
        let took = bed.run_twice(|bed| async move {
            let listener = bed.host("b").listen("0.0.0.0:80").unwrap();
            let accepted = bed.host("b").spawn(async move {
                let (stream, peer) = listener.accept().await.unwrap();
                assert_eq!((stream.local_addr().unwrap(), peer), ("10.0.0.2:80".parse().unwrap(), "10.0.0.1:49152".parse().unwrap()));
                (time::now(), stream)
            });
            let stream = bed.host("a").connect("b:80").await.unwrap();
            let connected = time::now();
            assert_eq!((stream.peer_addr().unwrap(), stream.info().state), ("10.0.0.2:80".parse().unwrap(), State::Established));
            (connected, accepted.await.unwrap().0)
        });
        assert_eq!(took, (Instant::from_nanos(2_469_134), Instant::from_nanos(3_703_701)));
    }
}

/// Connects from host `a`. Returns the outcome and its instant.
async fn connecting(bed: &Bed, to: &str) -> (Result<(), ErrorKind>, Instant) {
    let outcome = bed.host("a").connect(to).await;
    (outcome.map(drop).map_err(|error| error.kind()), bed.now())
}

#[test]
fn no_listener_refuses_after_a_round_trip() {
    for bed in beds() {
        let seen = bed.run_twice(|bed| async move { connecting(&bed, "10.0.0.2:80").await });
        assert_eq!(seen, (Err(ErrorKind::ConnectionRefused), millis(100)));
    }
}

#[test]
fn a_box_that_drops_syns_with_ecn_costs_a_second_and_the_marks() {
    let config = TcpConfig { ecn: true, ..TcpConfig::default() };
    for bed in beds() {
        let is_asking = |flags: Flags| flags.has(Flags::SYN | Flags::ECE);
        let bed = bed.tcp(config.clone()).on_packet("a", "b", move |packet| match packet.tcp() {
            Some(segment) if is_asking(segment.flags) => Verdict::Drop,
            _ => Verdict::Pass,
        });
        let seen = bed.run_twice(|bed| async move {
            let _listener = bed.host("b").listen("0.0.0.0:80").unwrap();
            connecting(&bed, "b:80").await
        });
        assert_eq!(seen, (Ok(()), millis(1100)));
    }
}

/// Returns the instants at which SYNs left, from the trace \[s\].
fn syns(bed: &Bed) -> Vec<u64> {
    let trace = bed.trace();
    let is_syn = |event: &&cohaptic_testkit::TraceEvent| trace.words(event).to_string().contains(" is SYN 49152 > 80");
    trace.events().iter().filter(is_syn).map(|event| event.at.as_nanos() / 1_000_000_000).collect()
}

#[test]
fn a_host_that_is_down_or_a_way_that_is_cut_is_given_up_after_131_seconds() {
    for way in ["down", "cut", "loss 100%"] {
        for bed in beds() {
            let (seen, syns) = bed.run_twice(move |bed| async move {
                match way {
                    "down" => bed.host("b").crash(),
                    "cut" => bed.cut("a", "b"),
                    words => bed.set_link("a", "b", words),
                }
                (connecting(&bed, "10.0.0.2:80").await, syns(&bed))
            });
            assert_eq!(seen, (Err(ErrorKind::TimedOut), millis(131_000)), "{way}");
            assert_eq!(syns, [0, 1, 2, 3, 4, 5, 7, 11, 19, 35, 67], "{way}");
        }
    }
}

#[test]
fn linear_repetitions_are_set_on_one_host() {
    let config = TcpConfig { linear_syn_retries: 1, syn_retries: 3, ..TcpConfig::default() };
    let bed = Testbed::new(["a", "b"]).tcp_of("a", config).seed(1);
    let syns = bed.run_twice(|bed| async move {
        bed.host("b").crash();
        let _ = bed.host("a").connect("b:80").await;
        syns(&bed)
    });
    assert_eq!(syns, [0, 1, 2, 4, 8]);
}

#[test]
fn a_syn_that_is_lost_n_times_costs_n_seconds_and_doubles_from_the_sixth_time_on() {
    for (lost, seconds) in [(0, 0), (1, 1), (2, 2), (5, 5), (6, 7), (7, 11)] {
        let took = beds()[0].clone().run_twice(move |bed| async move {
            let _listener = bed.host("b").listen("0.0.0.0:80").unwrap();
            if lost > 0 {
                bed.cut("a", "b");
            }
            let other = bed.clone();
            drop(bed.spawn(async move {
                // The next SYN is a second away at least.
                time::sleep((Duration::from_secs(seconds)).saturating_sub(Duration::from_millis(500))).await;
                other.mend("a", "b");
            }));
            connecting(&bed, "b:80").await
        });
        assert_eq!(took, (Ok(()), millis(seconds * 1000 + 100)), "{lost}");
    }
}

#[test]
fn an_address_that_nobody_has_is_given_up_after_three_seconds() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            assert_eq!(connecting(&bed, "10.0.0.77:80").await, (Err(ErrorKind::HostUnreachable), millis(3000)));
            bed.host("b").change_addresses();
            assert_eq!(connecting(&bed, "10.0.0.2:80").await, (Err(ErrorKind::HostUnreachable), millis(6000)));
        });
    }
}

#[test]
fn beyond_the_backlog_and_one_syns_are_dropped_without_a_word() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let make = async || {
                let socket = TcpSocket::new_v4().unwrap();
                socket.bind("0.0.0.0:80".parse().unwrap()).unwrap();
                socket.listen(2).unwrap()
            };
            let listener = bed.host("b").scope(make()).await;
            let mut streams = Vec::new();
            for _ in 0..3 {
                streams.push(bed.host("a").connect("b:80").await.unwrap());
            }
            let waiting = bed.host("a").spawn(async { TcpStream::connect("b:80").await.map(|stream| (time::now(), stream)) });
            // The fourth is repeated after 1 s, dropped again, and after 2 s.
            time::sleep(Duration::from_secs(2)).await;
            listener.accept().await.unwrap();
            let (connected, _stream) = waiting.await.unwrap().unwrap();
            assert_eq!(connected, millis(300 + 2000 + 100));
            let lost =
                bed.trace().events().iter().filter(|event| bed.trace().words(event).to_string().contains("the listener's queue is full")).count();
            assert_eq!(lost, 2);
        });
    }
}

#[test]
fn a_connection_that_was_reset_while_it_waited_is_accepted_and_fails() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let listener = bed.host("b").listen("0.0.0.0:80").unwrap();
            let stream = bed.host("a").connect("b:80").await.unwrap();
            stream.set_zero_linger().unwrap();
            drop(stream);
            time::sleep(R).await;
            let (mut stream, peer) = listener.accept().await.unwrap();
            assert_eq!(peer.to_string(), "10.0.0.1:49152");
            assert_eq!(stream.peer_addr().unwrap_err().kind(), ErrorKind::NotConnected);
            assert_eq!(stream.read(&mut [0; 1]).await.unwrap_err().kind(), ErrorKind::ConnectionReset);
            assert_eq!(stream.read(&mut [0; 1]).await.unwrap(), 0);
        });
    }
}

#[test]
fn a_listener_that_is_dropped_resets_those_that_wait() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let listener = bed.host("b").listen("0.0.0.0:80").unwrap();
            let mut stream = bed.host("a").connect("b:80").await.unwrap();
            time::sleep(R).await;
            let half_open = bed.host("a").spawn(async { TcpStream::connect("b:80").await.unwrap().read(&mut [0; 1]).await });
            time::sleep(R / 2 + Duration::from_millis(1)).await;
            drop(listener);
            assert_eq!(stream.read(&mut [0; 1]).await.unwrap_err().kind(), ErrorKind::ConnectionReset);
            assert_eq!(bed.now(), millis(301));
            // Its handshake was answered before; what follows finds nobody.
            assert_eq!(half_open.await.unwrap().unwrap_err().kind(), ErrorKind::ConnectionReset);
            assert_eq!(bed.now(), millis(400));
            assert_eq!(connecting(&bed, "b:80").await.0, Err(ErrorKind::ConnectionRefused));
            assert_eq!(bed.connections(), []);
        });
    }
}

#[test]
fn both_may_open_at_once() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let open = |to: &'static str| async move {
                let socket = TcpSocket::new_v4().unwrap();
                socket.bind("0.0.0.0:5000".parse().unwrap()).unwrap();
                let stream = socket.connect(to.parse().unwrap()).await.unwrap();
                (time::now(), stream)
            };
            let (a, b) = (bed.host("a").spawn(open("10.0.0.2:5000")), bed.host("b").spawn(open("10.0.0.1:5000")));
            let ((at_a, a), (at_b, b)) = (a.await.unwrap(), b.await.unwrap());
            assert_eq!((at_a, at_b), (millis(100), millis(100)));
            assert_eq!((a.try_write(b"hello").unwrap(), b.try_write(b"hi").unwrap()), (5, 2));
            time::sleep(R).await;
            assert_eq!((a.try_read(&mut [0; 9]).unwrap(), b.try_read(&mut [0; 9]).unwrap()), (2, 5));
        });
    }
}

#[test]
fn version_6_and_loopback() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let six = bed.host("b").listen("[::]:80").unwrap();
            let stream = bed.host("a").connect("[b]:80").await.unwrap();
            assert_eq!((stream.local_addr().unwrap().to_string(), stream.info().segment_size), ("[fd00::1]:49152".into(), 1428));
            assert_eq!(six.accept().await.unwrap().1.to_string(), "[fd00::1]:49152");
            // Within a host no time passes.
            let four = bed.host("a").listen("127.0.0.1:80").unwrap();
            let before = bed.now();
            let mut stream = bed.host("a").connect("127.0.0.1:80").await.unwrap();
            let mut other = four.accept().await.unwrap().0;
            let write = bed.host("a").spawn(async move { super::send_all(&mut stream, 1_000_000).await });
            super::read_all(&mut other, 1_000_000).await;
            write.await.unwrap();
            assert_eq!(bed.now(), before);
            assert_eq!(connecting(&bed, "10.0.0.1:80").await, (Err(ErrorKind::ConnectionRefused), before), "that address has no listener");
        });
    }
}
