//! Connections of hosts that crash, come back, are killed and move.

use std::io::ErrorKind;
use std::time::Duration;

use cohaptic_testkit::tcp::Keepalive;
use cohaptic_testkit::{TcpListener, time};
use tokio::io::{AsyncReadExt, AsyncWriteExt};

use crate::tcp::ends::pair;
use crate::tcp::{DAY, R, beds, millis};

#[test]
fn a_crash_is_silent_and_the_sockets_of_the_host_say_so() {
    for bed in beds() {
        bed.time_limit(DAY).run_twice(|bed| async move {
            let (mut client, mut server, listener) = pair(&bed).await;
            bed.host("b").crash();
            assert!(time::timeout(Duration::from_secs(10_000), client.read(&mut [0; 1])).await.is_err(), "nobody tells it");
            let error = server.read(&mut [0; 1]).await.unwrap_err();
            let text = "host `b` crashed at 0.5 s, and this socket (10.0.0.2:80) with it; after `Host::restart`, bind a new one";
            assert_eq!((error.kind(), error.to_string()), (ErrorKind::ConnectionAborted, text.into()));
            assert_eq!(server.write(b"x").await.unwrap_err().kind(), ErrorKind::ConnectionAborted);
            assert_eq!(listener.accept().await.unwrap_err().kind(), ErrorKind::ConnectionAborted);
            assert_eq!(bed.host("b").listen("0.0.0.0:80").unwrap_err().kind(), ErrorKind::NetworkDown);
            assert_eq!(bed.host("b").connect("a:1").await.unwrap_err().kind(), ErrorKind::NetworkDown);
        });
    }
}

#[test]
fn keep_alive_finds_a_crash() {
    for bed in beds() {
        bed.time_limit(DAY).run_twice(|bed| async move {
            let (mut client, _server, _listener) = pair(&bed).await;
            client.set_keepalive_times(Some(Keepalive::default())).unwrap();
            bed.host("b").crash();
            assert_eq!(client.read(&mut [0; 1]).await.unwrap_err().kind(), ErrorKind::TimedOut);
            assert_eq!(bed.now(), millis(500 + (7200 + 9 * 75) * 1000));
        });
    }
}

#[test]
fn a_host_that_is_back_resets_old_connections() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let (mut client, server, listener) = pair(&bed).await;
            drop((server, listener));
            let (mut client, _server, _listener) = {
                drop(client);
                let listener = bed.host("b").listen("0.0.0.0:81").unwrap();
                client = bed.host("a").connect("b:81").await.unwrap();
                let server = listener.accept().await.unwrap().0;
                (client, server, listener)
            };
            bed.host("b").crash();
            time::sleep(Duration::from_secs(5)).await;
            bed.host("b").restart();
            let written = bed.now();
            client.write_all(b"x").await.unwrap();
            assert_eq!(client.read(&mut [0; 1]).await.unwrap_err().kind(), ErrorKind::ConnectionReset);
            assert_eq!(bed.now() - written, R);
        });
    }
}

/// Echo server, which sends back all octets.
async fn echo() {
    let listener = TcpListener::bind("0.0.0.0:7").await.unwrap();
    loop {
        let (mut stream, _) = listener.accept().await.unwrap();
        let mut buffer = [0; 100];
        while let Ok(count @ 1..) = stream.read(&mut buffer).await {
            stream.write_all(&buffer[..count]).await.unwrap();
        }
    }
}

#[test]
fn a_program_that_is_killed_closes_its_streams_and_begins_anew() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            bed.host("b").start(echo);
            time::yield_now().await;
            let mut client = bed.host("a").connect("b:7").await.unwrap();
            client.write_all(b"hello").await.unwrap();
            client.read_exact(&mut [0; 5]).await.unwrap();
            let killed = bed.now();
            bed.host("b").kill();
            assert_eq!(client.read(&mut [0; 1]).await.unwrap(), 0, "a FIN, as when it is dropped");
            assert_eq!(bed.now() - killed, R / 2);
            assert_eq!(bed.host("a").connect("b:7").await.unwrap_err().kind(), ErrorKind::ConnectionRefused, "the kernel answers");
            bed.host("b").restart();
            time::yield_now().await;
            let mut client = bed.host("a").connect("b:7").await.unwrap();
            client.write_all(b"again").await.unwrap();
            client.read_exact(&mut [0; 5]).await.unwrap();
        });
    }
}

#[test]
fn what_others_hold_of_a_killed_program_is_closed_too() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let (mut client, mut server, listener) = pair(&bed).await;
            client.write_all(b"unread").await.unwrap();
            time::sleep(R).await;
            bed.host("b").kill();
            assert_eq!(client.read(&mut [0; 1]).await.unwrap_err().kind(), ErrorKind::ConnectionReset);
            let error = server.read(&mut [0; 1]).await.unwrap_err();
            assert!(error.to_string().starts_with("the program of host `b` was killed at 0.6 s"), "{error}");
            assert_eq!(listener.local_addr().unwrap_err().kind(), ErrorKind::ConnectionAborted);
            let _again = bed.host("b").listen("0.0.0.0:80").unwrap();
        });
    }
}

#[test]
fn connections_of_old_addresses_are_silent_both_ways() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let (mut client, mut server, _listener) = pair(&bed).await;
            bed.host("a").change_addresses();
            client.write_all(b"from an old address").await.unwrap();
            server.write_all(b"to an old address").await.unwrap();
            assert_eq!(server.read(&mut [0; 1]).await.unwrap_err().kind(), ErrorKind::TimedOut);
            assert_eq!(client.read(&mut [0; 1]).await.unwrap_err().kind(), ErrorKind::TimedOut);
            assert_eq!(bed.now(), millis(500 + 993_600));
            bed.host("a").connect("b:80").await.unwrap();
        });
    }
}
