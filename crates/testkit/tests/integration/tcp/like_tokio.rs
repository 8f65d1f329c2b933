//! One program on tokio's streams, over the loopback interface of this machine, and on virtual streams: all its results are equal.

use cohaptic_testkit::Testbed;

macro_rules! program {
    ($name:ident, $net:path) => {
        mod $name {
            use std::future::poll_fn;
            use std::io::{IoSlice, IoSliceMut};
            use std::pin::Pin;
            use std::time::Duration;

            use net::tcp::{OwnedReadHalf, OwnedWriteHalf, ReadHalf, ReuniteError, WriteHalf};
            use net::{TcpListener, TcpSocket, TcpStream};
            use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, Interest, ReadBuf};
            use $net as net;

            use crate::like_tokio::Log;

            async fn pair(listener: &TcpListener) -> (TcpStream, TcpStream) {
                let client = TcpStream::connect(listener.local_addr().unwrap()).await.unwrap();
                (client, listener.accept().await.unwrap().0)
            }

            fn are_as_tokios<T: AsyncRead + AsyncWrite + AsRef<TcpStream> + Send + Sync + Unpin>(_: &T) {}
            fn is_a_half<T: AsRef<TcpStream> + Send + Sync + Unpin>(_: &T) {}

            async fn listening(log: &mut Log) -> TcpListener {
                let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
                let address = listener.local_addr().unwrap();
                log.see("a free port is none", Ok(address.port() == 0));
                log.see("the address is taken", TcpListener::bind(address).await.map(drop));
                log.see("somebody else's address", TcpListener::bind("192.0.2.1:0").await.map(drop));
                log.see("no address", TcpListener::bind("nonsense").await.map(drop));
                log.see("time to live", listener.ttl());
                log.see("none", listener.set_ttl(0));
                log.see("too much", listener.set_ttl(256));
                log.see("another", listener.set_ttl(9));
                log.see("as said", listener.ttl());
                let gone = TcpListener::bind("127.0.0.1:0").await.unwrap().local_addr().unwrap();
                log.see("nobody listens", TcpStream::connect(gone).await.map(drop));
                log.see("closed ports are free", TcpListener::bind(gone).await.map(drop));
                listener
            }

            async fn data(log: &mut Log, listener: &TcpListener) {
                let (mut client, mut server) = pair(listener).await;
                are_as_tokios(&client);
                log.see("addresses", Ok(client.local_addr().unwrap() == server.peer_addr().unwrap()));
                log.see("no error", client.take_error().map(|error| error.is_none()));
                log.see("nothing has come", client.try_read(&mut [0; 4]));
                log.see("time to live of the listener", server.ttl());
                log.see("five", client.write(b"hello").await);
                log.see("it can be read", server.readable().await);
                let mut short = [0; 3];
                log.see("looked at", server.peek(&mut short).await);
                log.see("three", server.read(&mut short).await);
                log.see("which", Ok(short));
                let mut all = [0; 10];
                log.see("looked at by hand", poll_fn(|cx| server.poll_peek(cx, &mut ReadBuf::new(&mut all))).await);
                log.see("the rest", server.try_read(&mut all));
                log.see("two parts", client.try_write_vectored(&[IoSlice::new(b"ab"), IoSlice::new(b"cde")]));
                server.readable().await.unwrap();
                let (mut one, mut two) = ([0; 1], [0; 9]);
                log.see("in two other parts", server.try_read_vectored(&mut [IoSliceMut::new(&mut one), IoSliceMut::new(&mut two)]));
                log.see("which", Ok((one, two)));
                log.see("vectored", Ok(client.is_write_vectored()));
                log.see("and by the trait", client.write_vectored(&[IoSlice::new(b"12"), IoSlice::new(b"3")]).await);
                let mut room = Vec::with_capacity(8);
                server.readable().await.unwrap();
                log.see("into the room", server.try_read_buf(&mut room));
                log.see("writable", client.writable().await);
                log.see("ready", client.ready(Interest::READABLE | Interest::WRITABLE).await.map(|ready| (ready.is_readable(), ready.is_writable())));
                log.see("nothing to read", client.try_io(Interest::READABLE, || client.try_read(&mut [0; 1])));
                client.write_all(b"!").await.unwrap();
                log.see("by hand", server.async_io(Interest::READABLE, || server.try_read(&mut [0; 8])).await);
                log.see("ready by hand", poll_fn(|cx| client.poll_write_ready(cx)).await);
                log.see("flushed", client.flush().await);
                log.see("nothing to read into no space", client.try_read(&mut []));
                log.see("shut", client.shutdown().await);
                log.see("is not said", client.ready(Interest::WRITABLE).await.map(|ready| ready.is_write_closed()));
                log.see("shut again", client.shutdown().await);
                log.see("nothing more", client.write(b"x").await);
                log.see("the end", server.read(&mut short).await);
                log.see("again", server.read(&mut short).await);
                log.see("ready to read the end", poll_fn(|cx| server.poll_read_ready(cx)).await);
                log.see("closed", server.ready(Interest::READABLE).await.map(|ready| ready.is_readable()));
                log.see("the other way", server.write(b"bye").await);
                client.readable().await.unwrap();
                log.see("something to read into no space", client.read(&mut []).await);
                drop(server);
                let mut text = String::new();
                log.see("to the end", client.read_to_string(&mut text).await);
            }

            async fn options(log: &mut Log, listener: &TcpListener) {
                let (client, server) = pair(listener).await;
                log.see("no delay", client.nodelay());
                log.see("set", client.set_nodelay(true));
                log.see("as said", client.nodelay());
                #[cfg(target_os = "linux")]
                {
                    log.see("quick", client.set_quickack(true));
                    log.see("as said", client.quickack());
                }
                log.see("no lingering", client.linger());
                #[expect(deprecated, reason = "as tokio's")]
                #[allow(unfulfilled_lint_expectations, reason = "virtual streams never block")]
                let set = client.set_linger(Some(Duration::from_secs(3)));
                log.see("set", set);
                log.see("as said", client.linger());
                log.see("to zero", client.set_zero_linger());
                log.see("as said", client.linger());
                log.see("time to live", client.ttl());
                log.see("none", client.set_ttl(0));
                log.see("set", client.set_ttl(7));
                log.see("as said", client.ttl());
                drop(client);
                server.readable().await.unwrap();
                log.see("the other end is gone", server.peer_addr().map(drop));
                log.see("a reset", server.try_read(&mut [0; 1]));
                log.see("once", server.try_read(&mut [0; 1]));
                log.see("and for all", server.try_write(b"x"));
                let (client, server) = pair(listener).await;
                client.writable().await.unwrap();
                client.try_write(b"unread").unwrap();
                server.readable().await.unwrap();
                drop(server);
                client.readable().await.unwrap();
                log.see("it is told by itself", client.take_error().map(|error| error.map(|error| error.kind())));
                log.see("and then no more", client.try_read(&mut [0; 1]));
            }

            async fn halves(log: &mut Log, listener: &TcpListener) {
                let (mut client, mut server) = pair(listener).await;
                {
                    let (read, write): (ReadHalf<'_>, WriteHalf<'_>) = client.split();
                    (is_a_half(&read), is_a_half(&write));
                    write.writable().await.unwrap();
                    log.see("by half", write.try_write(b"half"));
                    log.see("nothing", read.try_read(&mut [0; 1]));
                    log.see("its peer", Ok(read.peer_addr().unwrap() == write.peer_addr().unwrap()));
                }
                let (other, _far) = pair(listener).await;
                let (read, write): (OwnedReadHalf, OwnedWriteHalf) = client.into_split();
                let (other_read, other_write) = other.into_split();
                let wrong = read.reunite(other_write).unwrap_err();
                log.see("not of one", Ok(wrong.to_string()));
                let ReuniteError(read, other_write) = wrong;
                drop((other_read, other_write));
                let client = write.reunite(read).unwrap();
                let (mut read, mut write) = client.into_split();
                log.see("ready", write.ready(Interest::WRITABLE).await.map(|ready| ready.is_writable()));
                log.see("written", Pin::new(&mut write).write_all(b" whole").await);
                log.see("shut", write.shutdown().await);
                write.forget();
                let mut text = String::new();
                server.read_to_string(&mut text).await.unwrap();
                log.see("all", Ok(text));
                server.write_all(b"back").await.unwrap();
                log.see("looked at", read.peek(&mut [0; 9]).await);
                log.see("local", Ok(read.local_addr().unwrap() == server.peer_addr().unwrap()));
                drop(server);
                let mut back = Vec::new();
                log.see("to the end", read.read_to_end(&mut back).await);
            }

            async fn sockets(log: &mut Log) {
                let socket = TcpSocket::new_v4().unwrap();
                log.see("not bound", socket.local_addr());
                log.see("no keep-alive", socket.keepalive());
                log.see("set", socket.set_keepalive(true));
                log.see("as said", socket.keepalive());
                log.see("not shared", socket.reuseaddr());
                log.see("set", socket.set_reuseaddr(true));
                log.see("as said", socket.reuseaddr());
                log.see("no delay", socket.set_nodelay(true));
                log.see("as said", socket.nodelay());
                log.see("a buffer", socket.set_recv_buffer_size(50_000));
                log.see("twice as large", socket.recv_buffer_size());
                log.see("the other", socket.set_send_buffer_size(60_000));
                log.see("twice as large", socket.send_buffer_size());
                log.see("least", socket.set_send_buffer_size(0).and_then(|()| socket.send_buffer_size()));
                log.see("lingering", socket.linger());
                log.see("zero", socket.set_zero_linger());
                log.see("as said", socket.linger());
                log.see("no error", socket.take_error().map(|error| error.is_none()));
                log.see("of the other version", socket.bind("[::1]:0".parse().unwrap()));
                log.see("bound", socket.bind("127.0.0.1:0".parse().unwrap()));
                log.see("once", socket.bind("127.0.0.1:0".parse().unwrap()));
                let address = socket.local_addr().unwrap();
                log.see("a port", Ok(address.port() == 0));
                let listener = socket.listen(5).unwrap();
                let other = TcpSocket::new_v4().unwrap();
                log.see("taken", other.bind(address));
                other.set_reuseaddr(true).unwrap();
                log.see("by a listener, even if shared", other.bind(address));
                log.see("bound elsewhere", other.bind("127.0.0.1:0".parse().unwrap()));
                let from = other.local_addr().unwrap();
                let client = other.connect(address).await.unwrap();
                let (server, peer) = listener.accept().await.unwrap();
                log.see("from there", Ok((client.local_addr().unwrap() == from, peer == from)));
                log.see("inherited", server.nodelay().and_then(|nodelay| Ok((nodelay, server.linger()?))));
                let six = TcpSocket::new_v6().unwrap();
                log.see("version 6", six.bind("[::1]:0".parse().unwrap()));
                let six = six.listen(1).unwrap();
                let client = TcpStream::connect(six.local_addr().unwrap()).await.unwrap();
                log.see("over it", Ok(client.peer_addr().unwrap() == six.local_addr().unwrap()));
            }

            pub(super) async fn run() -> Vec<String> {
                let mut log = Log::default();
                let listener = listening(&mut log).await;
                data(&mut log, &listener).await;
                options(&mut log, &listener).await;
                halves(&mut log, &listener).await;
                sockets(&mut log).await;
                log.0
            }
        }
    };
}

program!(on_tokio, tokio::net);
program!(on_a_test_bed, cohaptic_testkit::net);

#[test]
fn a_program_sees_the_same_on_virtual_streams_and_on_tokios() {
    let bed = || Testbed::new(["machine"]);
    let program = |bed: cohaptic_testkit::Bed| async move { bed.host("machine").spawn(on_a_test_bed::run()).await.unwrap() };
    let ours = bed().run_twice(program);
    assert_eq!(bed().on_tokio().run_twice(program), ours, "both runtimes");
    // On this machine IPv6 may be switched off.
    if !cfg!(target_os = "linux") || std::net::TcpListener::bind("[::1]:0").is_err() {
        return;
    }
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let theirs = runtime.block_on(async { tokio::time::timeout(std::time::Duration::from_secs(60), on_tokio::run()).await }).unwrap();
    let differing: Vec<_> = ours.iter().zip(&theirs).filter(|(ours, theirs)| ours != theirs).collect();
    // Kinds that have no name cannot be asked for: ours have one.
    let is_nameless = |ours: &str, theirs: &str| theirs.ends_with("Uncategorized") && !ours.ends_with(char::is_numeric);
    assert!(differing.iter().all(|(ours, theirs)| is_nameless(ours, theirs)), "{differing:#?}");
    assert_eq!(ours.len(), theirs.len());
}
