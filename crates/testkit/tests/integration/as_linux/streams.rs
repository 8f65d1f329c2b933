//! Addresses and buffers of TCP.

use std::time::Duration;

use cohaptic_testkit::{Bed, TcpListener, TcpSocket, time};
use tokio::io::{AsyncReadExt, AsyncWriteExt};

use super::{R, beds, number, timed};

/// Returns a listener at `[::]:80` of host `b`, with or without `IPV6_V6ONLY`.
async fn listening(bed: &Bed, only_v6: bool) -> TcpListener {
    let listen = async {
        let socket = TcpSocket::new_v6().unwrap();
        socket.set_only_v6(only_v6).unwrap();
        assert_eq!(socket.only_v6().unwrap(), only_v6);
        socket.bind("[::]:80".parse().unwrap()).unwrap();
        socket.listen(8).unwrap()
    };
    bed.host("b").scope(listen).await
}

#[test]
fn a_listener_of_all_addresses_of_version_6_hears_version_4() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let (a, b) = (bed.host("a"), bed.host("b"));
            let listener = listening(&bed, false).await;
            let mut client = a.connect("10.0.0.2:80").await.unwrap();
            let (mut stream, peer) = listener.accept().await.unwrap();
            assert_eq!(peer.to_string(), "[::ffff:10.0.0.1]:49152");
            assert_eq!((stream.local_addr().unwrap().to_string(), stream.peer_addr().unwrap()), ("[::ffff:10.0.0.2]:80".into(), peer));
            assert_eq!(client.peer_addr().unwrap().to_string(), "10.0.0.2:80");
            client.write_all(b"four").await.unwrap();
            stream.read_exact(&mut [0; 4]).await.unwrap();
            assert_eq!(a.connect("[fd00::2]:80").await.unwrap().peer_addr().unwrap().to_string(), "[fd00::2]:80");
            for taken in ["0.0.0.0:80", "10.0.0.2:80", "127.0.0.1:80", "[::1]:80"] {
                assert_eq!(number(b.listen(taken)), Some(98), "{taken}");
            }
            drop(listener);
            assert_eq!(timed(&bed, a.connect("10.0.0.2:80")).await, (Some(111), R));
            // The other way round.
            let _listener = b.listen("10.0.0.2:81").unwrap();
            assert_eq!(number(b.listen("[::]:81")), Some(98));
            assert_eq!(b.listen("[::1]:81").unwrap().local_addr().unwrap().port(), 81);
            // A socket of version 6 reaches version 4.
            let mapped = a.connect("[::ffff:10.0.0.2]:81").await.unwrap();
            assert_eq!(mapped.peer_addr().unwrap().to_string(), "[::ffff:10.0.0.2]:81");
            assert!(mapped.local_addr().unwrap().to_string().starts_with("[::ffff:10.0.0.1]:"));
        });
    }
}

#[test]
fn a_listener_of_version_6_alone_leaves_version_4_to_others() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let _listener = listening(&bed, true).await;
            assert_eq!(timed(&bed, bed.host("a").connect("10.0.0.2:80")).await, (Some(111), R));
            bed.host("a").connect("[fd00::2]:80").await.unwrap();
            let four = bed.host("b").listen("0.0.0.0:80").unwrap();
            bed.host("a").connect("10.0.0.2:80").await.unwrap();
            assert_eq!(four.accept().await.unwrap().1.to_string().split(':').next(), Some("10.0.0.1"));
            let socket = bed.host("a").scope(async { TcpSocket::new_v6().unwrap() }).await;
            socket.set_only_v6(true).unwrap();
            assert_eq!(number(socket.connect("[::ffff:10.0.0.2]:80".parse().unwrap()).await), Some(101));
        });
    }
}

#[test]
fn nobody_answers_after_three_seconds_and_other_networks_are_unreachable() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let a = bed.host("a");
            for nobody in ["10.0.0.77:80", "10.200.1.1:80", "[fd00::77]:80", "[fd12:3456::1]:80", "[::ffff:10.0.0.77]:80"] {
                assert_eq!(timed(&bed, a.connect(nobody)).await, (Some(113), Duration::from_secs(3)), "{nobody}");
            }
            for other in ["192.0.2.1:80", "8.8.8.8:80", "[2001:db8::1]:80", "[fe80::1]:80", "255.255.255.255:80", "224.0.0.1:80"] {
                assert_eq!(timed(&bed, a.connect(other)).await, (Some(101), Duration::ZERO), "{other}");
            }
            // No port zero can be listened at.
            assert_eq!(timed(&bed, a.connect("10.0.0.2:0")).await, (Some(111), R));
            assert!(bed.connections().is_empty());
        });
    }
}

#[test]
fn loopback() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let a = bed.host("a");
            let (_wide, _narrow) = (a.listen("0.0.0.0:80").unwrap(), a.listen("127.0.0.1:81").unwrap());
            let stream = a.connect("127.0.0.5:80").await.unwrap();
            assert_eq!(
                (stream.local_addr().unwrap().ip().to_string(), stream.peer_addr().unwrap().to_string()),
                ("127.0.0.1".into(), "127.0.0.5:80".into())
            );
            assert_eq!(number(a.connect("127.0.0.5:81").await), Some(111));
            let bound = async |to: &str| {
                let socket = TcpSocket::new_v4().unwrap();
                socket.bind("127.0.0.1:0".parse().unwrap()).unwrap();
                socket.connect(to.parse().unwrap()).await
            };
            assert_eq!(number(a.scope(bound("10.0.0.2:80")).await), Some(22));
            // The own address is not elsewhere.
            assert_eq!(a.scope(bound("10.0.0.1:80")).await.unwrap().peer_addr().unwrap().to_string(), "10.0.0.1:80");
            let socket = a.scope(async { TcpSocket::new_v6().unwrap() }).await;
            socket.bind("[::1]:0".parse().unwrap()).unwrap();
            assert_eq!(number(socket.connect("[::ffff:127.0.0.1]:80".parse().unwrap()).await), Some(101));
        });
    }
}

#[test]
fn buffers_have_the_sizes_of_linux() {
    beds()[0].clone().run(|bed| async move {
        let socket = bed.host("a").scope(async { TcpSocket::new_v4().unwrap() }).await;
        for (asked, receive, send) in [(0, 2304, 4608), (1152, 2304, 4608), (1153, 2306, 4608), (10_000, 20_000, 20_000), (1 << 30, 425_984, 425_984)]
        {
            socket.set_recv_buffer_size(asked).unwrap();
            socket.set_send_buffer_size(asked).unwrap();
            assert_eq!((socket.recv_buffer_size().unwrap(), socket.send_buffer_size().unwrap()), (receive, send), "{asked}");
        }
        let socket = bed.host("a").bind("0.0.0.0:0").unwrap();
        assert_eq!((socket.recv_buffer_size().unwrap(), socket.send_buffer_size().unwrap()), (212_992, 212_992));
        for (asked, receive, send) in [(0, 2304, 4608), (10_000, 20_000, 20_000), (1 << 30, 425_984, 425_984)] {
            socket.set_recv_buffer_size(asked).unwrap();
            socket.set_send_buffer_size(asked).unwrap();
            assert_eq!((socket.recv_buffer_size().unwrap(), socket.send_buffer_size().unwrap()), (receive, send), "{asked}");
        }
    });
}

/// A read into no space waits as any other read, which the real tokio does too.
#[test]
fn a_read_into_no_space_waits_until_something_can_be_read() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let listener = bed.host("b").listen("0.0.0.0:80").unwrap();
            let mut client = bed.host("a").connect("b:80").await.unwrap();
            let (mut server, _) = listener.accept().await.unwrap();
            assert!(time::timeout(R, server.read(&mut [])).await.is_err());
            client.write_all(b"x").await.unwrap();
            assert_eq!(server.read(&mut []).await.unwrap(), 0);
            assert_eq!(server.read(&mut [0; 2]).await.unwrap(), 1);
            assert_eq!(server.write(&[]).await.unwrap(), 0);
            drop(client);
            assert_eq!(server.read(&mut []).await.unwrap(), 0);
        });
    }
}
