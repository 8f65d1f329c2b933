//! Ends of connections.

use std::io::ErrorKind;
use std::time::Duration;

use cohaptic_testkit::tcp::State;
use cohaptic_testkit::{Bed, TcpListener, TcpStream, time};
use tokio::io::{AsyncReadExt, AsyncWriteExt};

use crate::tcp::{R, beds, millis, octets, read_all, send_all};

/// Connects the hosts, and waits until 500 ms. Returns the client's stream, the server's stream, and the listener.
pub(super) async fn pair(bed: &Bed) -> (TcpStream, TcpStream, TcpListener) {
    let listener = bed.host("b").listen("0.0.0.0:80").unwrap();
    let client = bed.host("a").connect("b:80").await.unwrap();
    let (server, _) = listener.accept().await.unwrap();
    time::sleep_until(millis(500)).await;
    (client, server, listener)
}

#[test]
fn a_half_that_is_shut_ends_behind_the_data_and_the_other_goes_on() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let (mut client, mut server, _listener) = pair(&bed).await;
            send_all(&mut client, 5000).await;
            assert_eq!(client.write(b"x").await.unwrap_err().kind(), ErrorKind::BrokenPipe);
            read_all(&mut server, 5000).await;
            assert_eq!((bed.now(), server.read(&mut [0; 1]).await.unwrap()), (millis(550), 0));
            let writing = bed.host("b").spawn(async move { send_all(&mut server, 100_000).await });
            read_all(&mut client, 100_000).await;
            writing.await.unwrap();
        });
    }
}

#[test]
fn a_write_half_that_is_dropped_shuts_and_one_that_is_forgotten_does_not() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let (client, mut server, _listener) = pair(&bed).await;
            let (read, write) = client.into_split();
            write.forget();
            drop(read);
            let (mut client, mut other) = {
                let client = bed.host("a").connect("b:80").await.unwrap();
                (client, _listener.accept().await.unwrap().0)
            };
            assert_eq!(server.read(&mut [0; 1]).await.unwrap(), 0, "dropped as a whole");
            let (mut read, mut write) = client.split();
            write.write_all(b"borrowed").await.unwrap();
            other.write_all(b"answer").await.unwrap();
            read.read_exact(&mut [0; 6]).await.unwrap();
            let (read, write) = client.into_split();
            let client = write.reunite(read).unwrap();
            let (mut read, write) = client.into_split();
            drop(write);
            let mut text = String::new();
            other.read_to_string(&mut text).await.unwrap();
            assert_eq!(text, "borrowed");
            send_all(&mut other, 10).await;
            read_all(&mut read, 10).await;
        });
    }
}

#[test]
fn a_stream_that_is_dropped_sends_on_and_answers_later_data_by_a_reset() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let (client, mut server, _listener) = pair(&bed).await;
            assert_eq!(client.try_write(&octets(40_000)).unwrap(), 40_000);
            drop(client);
            assert_eq!(bed.connections().len(), 2, "the data is on its way still");
            read_all(&mut server, 40_000).await;
            assert_eq!(server.write(b"later").await.unwrap(), 5);
            time::sleep(R).await;
            // After the FIN, the reset shows when it writes.
            assert_eq!(server.read(&mut [0; 1]).await.unwrap(), 0);
            assert_eq!(server.write(b"x").await.unwrap_err().kind(), ErrorKind::BrokenPipe);
            assert_eq!(bed.connections(), []);
        });
    }
}

#[test]
fn a_stream_that_is_dropped_with_unread_data_or_without_lingering_resets() {
    for lingers in [true, false] {
        for bed in beds() {
            bed.run_twice(move |bed| async move {
                let (mut client, server, _listener) = pair(&bed).await;
                client.write_all(b"unread").await.unwrap();
                time::sleep(R).await;
                if !lingers {
                    server.try_read(&mut [0; 6]).unwrap();
                    server.set_zero_linger().unwrap();
                    assert_eq!(server.linger().unwrap(), Some(Duration::ZERO));
                }
                drop(server);
                assert_eq!(client.read(&mut [0; 1]).await.unwrap_err().kind(), ErrorKind::ConnectionReset);
                assert_eq!(bed.now(), millis(650));
                assert_eq!(client.read(&mut [0; 1]).await.unwrap(), 0);
                assert_eq!(client.write(b"x").await.unwrap_err().kind(), ErrorKind::BrokenPipe);
            });
        }
    }
}

#[test]
fn what_came_before_a_reset_is_read_first_and_the_error_is_told_once() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let (mut client, mut server, _listener) = pair(&bed).await;
            server.write_all(&octets(100)).await.unwrap();
            time::sleep(R).await;
            server.set_zero_linger().unwrap();
            drop(server);
            time::sleep(R).await;
            let mut read = [0; 200];
            assert_eq!((client.peek(&mut read).await.unwrap(), client.read(&mut read).await.unwrap()), (100, 100));
            assert_eq!(client.write(b"x").await.unwrap_err().kind(), ErrorKind::ConnectionReset, "whatever is called first");
            assert_eq!((client.read(&mut read).await.unwrap(), client.take_error().unwrap().map(|error| error.kind())), (0, None));
        });
    }
}

#[test]
fn data_that_nobody_answers_is_repeated_and_given_up_after_993_6_seconds() {
    for bed in beds() {
        let sent = bed.run_twice(|bed| async move {
            let (mut client, _server, _listener) = pair(&bed).await;
            bed.cut("a", "b");
            client.write_all(b"x").await.unwrap();
            assert_eq!(client.read(&mut [0; 1]).await.unwrap_err().kind(), ErrorKind::TimedOut);
            assert_eq!(bed.now(), millis(500 + 993_600));
            let trace = bed.trace();
            let data = trace.events().iter().filter(|event| trace.words(event).to_string().contains("49152 > 80, sequence 1, 1 octets"));
            data.map(|event| event.at.as_nanos() / 1_000_000 - 500).collect::<Vec<_>>()
        });
        assert_eq!(sent[..6], [0, 300, 600, 1200, 2400, 4800]);
    }
}

#[test]
fn a_user_timeout_gives_up_earlier() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let (mut client, _server, _listener) = pair(&bed).await;
            client.set_user_timeout(Some(Duration::from_secs(10))).unwrap();
            bed.cut("a", "b");
            client.write_all(b"x").await.unwrap();
            assert_eq!(client.read(&mut [0; 1]).await.unwrap_err().kind(), ErrorKind::TimedOut);
            // Ten seconds after the first timeout.
            assert_eq!(bed.now(), millis(500 + 600 + 10_000));
        });
    }
}

#[test]
fn time_wait_keeps_no_port_from_being_bound_and_is_no_event() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let (client, server, listener) = pair(&bed).await;
            drop(server);
            time::sleep(R).await;
            drop(client);
            time::sleep(R).await;
            let state = |bed: &Bed| bed.connections().iter().map(|end| (end.host.clone(), end.info.state)).collect::<Vec<_>>();
            assert_eq!(state(&bed), [("b".into(), State::TimeWait)]);
            let taken = bed.host("b").listen("10.0.0.2:80").unwrap_err();
            assert_eq!(taken.kind(), ErrorKind::AddrInUse);
            drop(listener);
            let listener = bed.host("b").listen("0.0.0.0:80").unwrap();
            time::sleep(Duration::from_secs(61)).await;
            let _client = bed.host("a").connect("b:80").await.unwrap();
            let _server = listener.accept().await.unwrap();
            assert_eq!(state(&bed), [("a".into(), State::Established), ("b".into(), State::Established)]);
        });
    }
}
