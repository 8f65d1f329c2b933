//! Sockets of tokio in a test bed.

use std::net::SocketAddr;
use std::time::Duration;

use cohaptic_testkit::{Bed, Testbed};
use tokio::io::{AsyncReadExt, AsyncWriteExt, Interest};
use tokio::net::{TcpListener, TcpSocket, TcpStream, UdpSocket, lookup_host};
use tokio::time::Instant;

fn two() -> Testbed {
    Testbed::new(["client", "server"]).links("delay 10ms").on_tokio()
}

#[test]
fn a_stream_and_its_halves() {
    two().run(async |bed: Bed| {
        bed.host("server").spawn(async {
            let listener = TcpListener::bind("0.0.0.0:7").await.unwrap();
            let (mut stream, peer) = listener.accept().await.unwrap();
            assert_eq!(stream.peer_addr().unwrap(), peer);
            let (mut read, mut write) = stream.split();
            tokio::io::copy(&mut read, &mut write).await.unwrap();
            write.shutdown().await.unwrap();
        });
        let client = bed.host("client").spawn(async {
            let begin = Instant::now();
            // The first address hears nobody, and the second is the server's.
            let nobody: SocketAddr = "10.0.0.2:8".parse().unwrap();
            let server = lookup_host("server:7").await.unwrap().next().unwrap();
            let stream = TcpStream::connect(&[nobody, server][..]).await.unwrap();
            assert_eq!(begin.elapsed(), Duration::from_millis(40));
            stream.set_nodelay(true).unwrap();
            assert!(stream.nodelay().unwrap());
            assert!(stream.ready(Interest::READABLE | Interest::WRITABLE).await.unwrap().is_writable());
            assert_eq!(stream.try_read(&mut [0]).unwrap_err().kind(), std::io::ErrorKind::WouldBlock);

            let (mut read, mut write) = stream.into_split();
            let writer = tokio::spawn(async move {
                write.write_all(&[7; 100_000]).await.unwrap();
                // Dropping the half ends the stream for the reader.
            });
            let mut got = vec![0; 10];
            read.readable().await.unwrap();
            assert_eq!(read.peek(&mut got).await.unwrap(), 10);
            got.clear();
            assert!(read.try_read_buf(&mut got).unwrap() > 0);
            read.read_to_end(&mut got).await.unwrap();
            assert_eq!(got, vec![7; 100_000]);
            writer.await.unwrap();
        });
        client.await.unwrap();
    });
}

#[test]
fn sockets_have_options() {
    two().run(async |bed: Bed| {
        bed.host("server").spawn(async {
            let socket = TcpSocket::new_v4().unwrap();
            socket.set_reuseaddr(true).unwrap();
            assert!(socket.reuseaddr().unwrap() && !socket.keepalive().unwrap());
            socket.set_send_buffer_size(10_000).unwrap();
            // As with Linux, twice what was asked for.
            assert_eq!(socket.send_buffer_size().unwrap(), 20_000);
            socket.bind("0.0.0.0:7".parse().unwrap()).unwrap();
            let listener = socket.listen(4).unwrap();
            assert_eq!(listener.local_addr().unwrap().port(), 7);
            let (mut stream, _) = listener.accept().await.unwrap();
            stream.write_all(b"hello").await.unwrap();
        });
        let client = bed.host("client").spawn(async {
            let mut stream = TcpSocket::new_v4().unwrap().connect("10.0.0.2:7".parse().unwrap()).await.unwrap();
            let mut said = String::new();
            stream.read_to_string(&mut said).await.unwrap();
            assert_eq!(said, "hello");
        });
        client.await.unwrap();
    });
}

#[test]
fn datagrams() {
    two().run(async |bed: Bed| {
        bed.host("server").spawn(async {
            let socket = UdpSocket::bind(("0.0.0.0", 7)).await.unwrap();
            let mut buffer = Vec::with_capacity(100);
            let (_, from) = socket.recv_buf_from(&mut buffer).await.unwrap();
            socket.send_to(&buffer, from).await.unwrap();
        });
        let client = bed.host("client").spawn(async {
            let socket = UdpSocket::bind("0.0.0.0:0").await.unwrap();
            socket.connect("server:7").await.unwrap();
            assert_eq!(socket.peer_addr().unwrap(), "10.0.0.2:7".parse().unwrap());
            socket.send(b"echo").await.unwrap();
            assert_eq!(socket.try_recv(&mut [0; 10]).unwrap_err().kind(), std::io::ErrorKind::WouldBlock);
            assert!(socket.ready(Interest::READABLE).await.unwrap().is_readable());
            let mut buffer = [0; 10];
            assert_eq!(socket.peek_from(&mut buffer).await.unwrap(), (4, "10.0.0.2:7".parse().unwrap()));
            assert_eq!(socket.recv(&mut buffer[..2]).await.unwrap(), 2);
            assert_eq!(&buffer[..4], b"echo");
            socket.set_ttl(9).unwrap();
            assert_eq!(socket.ttl().unwrap(), 9);
        });
        client.await.unwrap();
    });
}
