//! Unix sockets and pipes, through the traits of `cohaptic-sockets`. Numbers and errors are those that Linux 6.18 gave to the same calls.

use std::future::poll_fn;
use std::io::{self, IoSlice, IoSliceMut};
use std::net::Shutdown;
use std::pin::pin;
use std::sync::Arc;
use std::task::Poll;
use std::time::Duration;

use cohaptic_sockets::{ByteStream, Call, Ready, UnixDatagrams, UnixListener, UnixName, UnixStream};
use cohaptic_testkit::{Bed, Testbed, time};

fn here() -> Arc<dyn cohaptic_sockets::Bed> {
    cohaptic_sockets::bed().expect("a test bed runs on this thread")
}

fn call() -> Call {
    Call::here("a function of the test")
}

fn path(path: &str) -> UnixName {
    UnixName::Path(path.into())
}

fn two() -> Testbed {
    Testbed::new(["a", "b"]).links("delay 10ms loss 50%")
}

/// Runs a program on host `a`, on both runtimes.
fn on_a<F: Future<Output = ()> + 'static>(program: impl Fn() -> F + Copy + 'static) {
    for bed in [two(), two().on_tokio()] {
        bed.run(move |bed| async move { bed.host("a").spawn(program()).await.unwrap() });
    }
}

fn listen(name: &UnixName, backlog: u32) -> io::Result<Box<dyn UnixListener>> {
    let socket = here().unix_socket(call())?;
    socket.bind(name)?;
    socket.listen(backlog)
}

fn connect(name: &UnixName) -> io::Result<Box<dyn UnixStream>> {
    here().unix_socket(call())?.connect(name)
}

async fn accept(listener: &dyn UnixListener) -> (Box<dyn UnixStream>, UnixName) {
    poll_fn(|cx| listener.poll_accept(cx)).await.unwrap()
}

fn bound(name: &UnixName) -> io::Result<Box<dyn UnixDatagrams>> {
    let socket = here().unix_datagrams(call())?;
    socket.bind(name)?;
    Ok(socket)
}

fn read(stream: &(impl ByteStream + ?Sized)) -> io::Result<Vec<u8>> {
    let mut buffer = [0; 100];
    stream.try_read(&mut [IoSliceMut::new(&mut buffer)]).map(|count| buffer[..count].to_vec())
}

fn write(stream: &(impl ByteStream + ?Sized), bytes: &[u8]) -> io::Result<usize> {
    stream.try_write(&[IoSlice::new(bytes)])
}

async fn readable(stream: &(impl ByteStream + ?Sized)) {
    poll_fn(|cx| stream.poll_readable(cx)).await.unwrap();
}

/// Polls two futures until both are over.
async fn both<A, B>(one: impl Future<Output = A>, other: impl Future<Output = B>) -> (A, B) {
    let (mut one, mut other) = (pin!(one), pin!(other));
    let (mut first, mut second) = (None, None);
    poll_fn(|cx| {
        if first.is_none()
            && let Poll::Ready(outcome) = one.as_mut().poll(cx)
        {
            first = Some(outcome);
        }
        if second.is_none()
            && let Poll::Ready(outcome) = other.as_mut().poll(cx)
        {
            second = Some(outcome);
        }
        if first.is_some() && second.is_some() { Poll::Ready(()) } else { Poll::Pending }
    })
    .await;
    (first.unwrap(), second.unwrap())
}

/// Returns the number of an error.
#[track_caller]
fn number<T>(outcome: io::Result<T>) -> i32 {
    outcome.err().expect("the call fails").raw_os_error().expect("the error has a number")
}

#[track_caller]
fn blocks<T>(outcome: io::Result<T>) {
    assert_eq!(outcome.err().expect("the call would block").kind(), io::ErrorKind::WouldBlock);
}

#[test]
fn bytes_arrive_at_the_same_instant_and_touch_no_link() {
    let (took, record) = two().run_recorded(|bed: Bed| async move {
        bed.host("a").spawn(async {
            let listener = listen(&path("/run/echo"), 8).unwrap();
            let (stream, _) = accept(&*listener).await;
            readable(&*stream).await;
            let said = read(&*stream).unwrap();
            assert_eq!(write(&*stream, &said).unwrap(), said.len());
        });
        let client = bed.host("a").spawn(async {
            time::sleep(Duration::from_secs(1)).await;
            let stream = connect(&path("/run/echo")).unwrap();
            write(&*stream, b"hello").unwrap();
            readable(&*stream).await;
            assert_eq!(read(&*stream).unwrap(), b"hello");
            readable(&*stream).await;
            assert_eq!(read(&*stream).unwrap(), b"");
            time::now()
        });
        client.await.unwrap()
    });
    assert_eq!(took.as_nanos(), 1_000_000_000);
    assert!(record.trace().events().is_empty(), "{:?}", record.trace().events());
}

#[test]
fn each_host_has_its_own_names() {
    two().run(|bed: Bed| async move {
        let (a, b) = (bed.host("a"), bed.host("b"));
        let of_a = a.spawn(async { listen(&path("/run/x"), 8).unwrap() }).await.unwrap();
        b.spawn(async { assert_eq!(number(connect(&path("/run/x"))), 2) }).await.unwrap();
        let of_b = b.spawn(async { listen(&path("/run/x"), 8).unwrap() }).await.unwrap();
        b.spawn(async { connect(&path("/run/x")).unwrap() }).await.unwrap();
        accept(&*of_b).await;
        let waits = poll_fn(|cx| Poll::Ready(of_a.poll_accept(cx).is_pending())).await;
        assert!(waits, "host a has a connection of host b");
    });
}

#[test]
fn names_are_taken_missing_and_left_behind() {
    on_a(async || {
        let (name, other) = (path("/run/x"), UnixName::Abstract(b"x".to_vec()));
        assert_eq!((number(connect(&name)), number(connect(&other))), (2, 111));
        let (listener, of_abstract) = (listen(&name, 8).unwrap(), listen(&other, 8).unwrap());
        assert_eq!((number(listen(&name, 8)), number(bound(&name)), number(listen(&other, 8))), (98, 98, 98));
        assert_eq!((listener.local_name().unwrap(), of_abstract.local_name().unwrap()), (name.clone(), other.clone()));
        let stream = connect(&name).unwrap();
        assert_eq!((stream.local_name().unwrap(), stream.peer_name().unwrap()), (UnixName::Unnamed, name.clone()));
        let (accepted, peer) = accept(&*listener).await;
        assert_eq!((accepted.local_name().unwrap(), accepted.peer_name().unwrap(), peer), (name.clone(), UnixName::Unnamed, UnixName::Unnamed));
        // A path stays when its socket is gone, an abstract name does not.
        drop((listener, of_abstract));
        assert_eq!((number(connect(&name)), number(connect(&other))), (111, 111));
        let _again = listen(&name, 8).unwrap();
        // A client may have a name of its own, which ends with its stream.
        let socket = here().unix_socket(call()).unwrap();
        socket.bind(&path("/run/client")).unwrap();
        assert_eq!(number(socket.bind(&path("/run/other"))), 22);
        assert_eq!(number(connect(&path("/run/client"))), 111);
        let stream = socket.connect(&name).unwrap();
        assert_eq!(number(listen(&path("/run/client"), 8)), 98);
        drop(stream);
        assert_eq!(number(here().unix_socket(call()).unwrap().listen(8)), 22);
        drop(listen(&path("/run/client"), 8).unwrap());
        let datagrams = bound(&path("/run/datagrams")).unwrap();
        assert_eq!((number(connect(&path("/run/datagrams"))), number(datagrams.connect(&name))), (91, 91));
    });
}

#[test]
fn the_backlog_holds_one_more_and_is_reset_with_its_listener() {
    on_a(async || {
        let listener = listen(&path("/run/x"), 2).unwrap();
        let waiting: Vec<_> = (0..3).map(|_| connect(&path("/run/x")).unwrap()).collect();
        assert_eq!(number(connect(&path("/run/x"))), 11);
        write(&*waiting[0], b"early").unwrap();
        drop(listener);
        for stream in &waiting {
            assert_eq!((number(read(&**stream)), read(&**stream).unwrap(), number(write(&**stream, b"x"))), (104, Vec::new(), 32));
        }
    });
}

#[test]
fn ends_close_as_with_linux() {
    on_a(async || {
        let pair = || here().unix_pair(call()).unwrap();
        // A clean end.
        let [one, other] = pair();
        write(&*other, b"hi").unwrap();
        drop(other);
        assert_eq!(one.ready().unwrap(), Ready { readable: true, writable: true, read_closed: true, write_closed: true });
        assert_eq!((number(write(&*one, b"x")), read(&*one).unwrap(), read(&*one).unwrap()), (32, b"hi".to_vec(), Vec::new()));
        // The other end has not read everything.
        let [one, other] = pair();
        write(&*one, b"unread").unwrap();
        write(&*other, b"yo").unwrap();
        drop(other);
        assert_eq!((read(&*one).unwrap(), number(read(&*one)), read(&*one).unwrap()), (b"yo".to_vec(), 104, Vec::new()));
        let [one, other] = pair();
        write(&*one, b"unread").unwrap();
        drop(other);
        assert_eq!(one.take_error().unwrap().and_then(|error| error.raw_os_error()), Some(104));
        assert_eq!(read(&*one).unwrap(), b"");
        // Half a connection.
        let [one, other] = pair();
        write(&*one, b"q").unwrap();
        one.shut_down().unwrap();
        assert_eq!((read(&*other).unwrap(), read(&*other).unwrap(), number(write(&*one, b"x"))), (b"q".to_vec(), Vec::new(), 32));
        assert_eq!(one.ready().unwrap(), Ready { writable: true, ..Ready::default() });
        assert_eq!(other.ready().unwrap(), Ready { readable: true, writable: true, read_closed: true, write_closed: false });
        assert_eq!((write(&*other, b"back").unwrap(), read(&*one).unwrap()), (4, b"back".to_vec()));
        other.shut_down().unwrap();
        let over = Ready { readable: true, writable: true, read_closed: true, write_closed: true };
        assert_eq!((one.ready().unwrap(), other.ready().unwrap()), (over, over));
    });
}

#[test]
fn a_writer_waits_until_a_quarter_of_the_buffer_is_full() {
    on_a(async || {
        let [one, other] = here().unix_pair(call()).unwrap();
        let mut written = 0;
        while let Ok(count) = write(&*one, &[7; 4096]) {
            written += count;
        }
        assert_eq!(written, 180_224);
        let mut read = 0;
        while !one.ready().unwrap().writable {
            let mut buffer = [0; 4096];
            read += other.try_read(&mut [IoSliceMut::new(&mut buffer)]).unwrap();
        }
        assert_eq!(read, 34 * 4096);
        // A task that writes more than fits goes on as the other one reads.
        let writer = async {
            let (mut left, bytes) = (1_000_000_usize, [7; 50_000]);
            while left > 0 {
                left -= poll_fn(|cx| one.poll_write(cx, &[IoSlice::new(&bytes[..left.min(50_000)])])).await.unwrap();
            }
            one.shut_down().unwrap();
        };
        let reader = async {
            let (mut count, mut buffer) = (read, [0; 3000]);
            loop {
                match poll_fn(|cx| other.poll_read(cx, &mut buffer)).await.unwrap() {
                    0 => return count,
                    more => count += more,
                }
            }
        };
        let ((), count) = both(writer, reader).await;
        assert_eq!(count, written + 1_000_000);
    });
}

#[test]
fn pipes_hold_sixteen_pages() {
    on_a(async || {
        let [sender, receiver] = here().pipe(call()).unwrap();
        assert_eq!(write(&*sender, &[7; 100_000]).unwrap(), 65_536);
        blocks(write(&*sender, b"x"));
        assert!(receiver.ready().unwrap().readable && !sender.ready().unwrap().writable);
        receiver.try_read(&mut [IoSliceMut::new(&mut [0; 4095])]).unwrap();
        assert!(!sender.ready().unwrap().writable);
        receiver.try_read(&mut [IoSliceMut::new(&mut [0; 1])]).unwrap();
        assert!(sender.ready().unwrap().writable);
        assert_eq!((number(read(&*sender)), number(write(&*receiver, b"x"))), (107, 107));
        drop(receiver);
        assert_eq!(number(write(&*sender, b"x")), 32);
        assert!(sender.ready().unwrap().write_closed);
        let [sender, receiver] = here().pipe(call()).unwrap();
        write(&*sender, b"last").unwrap();
        drop(sender);
        assert_eq!((read(&*receiver).unwrap(), read(&*receiver).unwrap()), (b"last".to_vec(), Vec::new()));
    });
}

#[test]
fn datagrams_keep_their_boundaries_and_their_errors() {
    on_a(async || {
        let receive = |socket: &dyn UnixDatagrams, len: usize| {
            let mut buffer = vec![0; len];
            socket.receive(None, &mut buffer).map(|(count, from)| (buffer[..count].to_vec(), from))
        };
        let (server, name) = (bound(&path("/run/log")).unwrap(), path("/run/log"));
        let client = bound(&path("/run/client")).unwrap();
        for message in [&b""[..], b"abcdef", b"second"] {
            assert_eq!(client.send(None, message, Some(&name)).unwrap(), message.len());
        }
        assert!(server.ready(None).unwrap().readable);
        assert_eq!(receive(&*server, 9).unwrap(), (Vec::new(), path("/run/client")));
        assert_eq!(receive(&*server, 3).unwrap(), (b"abc".to_vec(), path("/run/client")));
        assert_eq!(receive(&*server, 9).unwrap(), (b"second".to_vec(), path("/run/client")));
        blocks(receive(&*server, 9));

        let socket = here().unix_datagrams(call()).unwrap();
        assert_eq!(number(socket.send(None, b"x", None)), 107);
        assert_eq!(number(socket.send(None, b"x", Some(&path("/run/nobody")))), 2);
        assert_eq!(number(socket.send(None, b"x", Some(&UnixName::Abstract(b"nobody".to_vec())))), 111);
        assert_eq!(number(socket.send(None, &[0; 212_961], Some(&name))), 90);
        assert_eq!(socket.send(None, &[0; 212_960], Some(&name)).unwrap(), 212_960);
        // The server now takes datagrams of the client alone.
        server.connect(&path("/run/client")).unwrap();
        assert_eq!(server.peer_name().unwrap(), path("/run/client"));
        assert_eq!((number(socket.send(None, b"x", Some(&name))), number(socket.connect(&name))), (1, 1));
        drop(client);
        assert_eq!((number(server.send(None, b"x", None)), number(server.send(None, b"x", None))), (111, 107));

        let [one, other] = here().unix_datagram_pair(call()).unwrap();
        other.shut_down(Shutdown::Write).unwrap();
        assert_eq!(number(other.send(None, b"x", None)), 32);
        one.send(None, b"x", None).unwrap();
        assert_eq!(receive(&*other, 9).unwrap(), (b"x".to_vec(), UnixName::Unnamed));
        other.shut_down(Shutdown::Read).unwrap();
        assert_eq!((number(one.send(None, b"x", None)), receive(&*other, 9).unwrap()), (32, (Vec::new(), UnixName::Unnamed)));
    });
}

#[test]
fn senders_of_datagrams_wait_for_room() {
    on_a(async || {
        let send = async |socket: &dyn UnixDatagrams, to: Option<&UnixName>| {
            poll_fn(|cx| match socket.send(Some(cx.waker()), b"x", to) {
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => Poll::Pending,
                outcome => Poll::Ready(outcome),
            })
            .await
            .unwrap()
        };
        // Eleven datagrams wait at a socket that is not connected to their sender.
        let (server, name) = (bound(&path("/run/log")).unwrap(), path("/run/log"));
        let client = here().unix_datagrams(call()).unwrap();
        let sent = (0..).take_while(|_| client.send(None, b"x", Some(&name)).is_ok()).count();
        assert_eq!(sent, 11);
        client.connect(&name).unwrap();
        assert!(!client.ready(None).unwrap().writable);
        let later = async {
            time::sleep(Duration::from_millis(7)).await;
            server.receive(None, &mut [0; 9]).unwrap();
        };
        let (count, ()) = both(send(&*client, Some(&name)), later).await;
        assert_eq!((count, time::now().as_nanos()), (1, 7_000_000));
        // Between two connected sockets the memory of the sender decides.
        let [one, other] = here().unix_datagram_pair(call()).unwrap();
        let sent = (0..).take_while(|_| one.send(None, b"x", None).is_ok()).count();
        assert_eq!(sent, 278);
        for _ in 0..208 {
            other.receive(None, &mut [0; 9]).unwrap();
        }
        assert!(!one.ready(None).unwrap().writable);
        other.receive(None, &mut [0; 9]).unwrap();
        assert!(one.ready(None).unwrap().writable);
    });
}

#[test]
fn a_crash_ends_the_sockets_of_its_host() {
    two().on_tokio().run(|bed: Bed| async move {
        let a = bed.host("a");
        let (listener, [one, other], datagrams) = a
            .spawn(async {
                let made = (listen(&path("/run/x"), 8).unwrap(), here().unix_pair(call()).unwrap(), bound(&path("/run/d")).unwrap());
                let [one, _] = &made.1;
                write(&**one, b"lost").unwrap();
                made
            })
            .await
            .unwrap();
        a.crash();
        let text = read(&*other).unwrap_err();
        assert_eq!(text.kind(), io::ErrorKind::ConnectionAborted);
        assert!(text.to_string().starts_with("host `a` crashed at 0 s, and this socket (the Unix stream"), "{text}");
        for error in [write(&*one, b"x").unwrap_err(), listener.local_name().unwrap_err(), datagrams.local_name().unwrap_err()] {
            assert!(error.to_string().contains("after `Host::restart`, bind a new one"), "{error}");
        }
        a.restart();
        // The paths are left, and free.
        let (kept, _again) = a.spawn(async { (number(connect(&path("/run/x"))), listen(&path("/run/x"), 8).unwrap()) }).await.unwrap();
        assert_eq!(kept, 111);
        // The dead listener does not take the name of the new one with it.
        drop(listener);
        a.spawn(async { connect(&path("/run/x")).unwrap() }).await.unwrap();
    });
}

#[test]
fn a_task_that_waits_for_ever_is_told_with_its_socket() {
    let panicked = std::panic::catch_unwind(|| {
        two().run(|bed: Bed| async move {
            let waits = bed.host("a").spawn(async {
                let listener = listen(&path("/run/x"), 8).unwrap();
                accept(&*listener).await;
            });
            waits.await.unwrap();
        });
    });
    let text = *panicked.unwrap_err().downcast::<String>().unwrap();
    assert!(text.contains("a connection at the Unix listener `/run/x`"), "{text}");
}

#[test]
fn a_socket_needs_a_host_and_its_own_thread() {
    let panicked = std::panic::catch_unwind(|| two().run(|_| async { drop(here().unix_pair(call())) }));
    let text = *panicked.unwrap_err().downcast::<String>().unwrap();
    assert!(text.contains("was called by a task that belongs to no host"), "{text}");
    let [one, _other] = two().run(|bed: Bed| async move { bed.host("a").spawn(async { here().unix_pair(call()).unwrap() }).await.unwrap() });
    let error = write(&*one, b"x").unwrap_err().to_string();
    assert!(error.starts_with("a Unix socket or a pipe of host `a` was used after the end of its run"), "{error}");
}

#[test]
fn a_task_that_tries_again_and_again_is_noticed() {
    let again = |attempt: fn(&dyn UnixStream, &dyn UnixDatagrams)| {
        let panicked = std::panic::catch_unwind(|| {
            two().patience(1000).run(move |bed: Bed| async move {
                let tries = bed.host("a").spawn(async move {
                    let ([stream, _other], [datagrams, _peer]) = (here().unix_pair(call()).unwrap(), here().unix_datagram_pair(call()).unwrap());
                    for _ in 0..100_000 {
                        attempt(&*stream, &*datagrams);
                    }
                });
                tries.await.unwrap();
            });
        });
        let text = *panicked.unwrap_err().downcast::<String>().unwrap();
        assert!(text.starts_with("time stands still at 0 s"), "{text}");
    };
    again(|stream, _| blocks(read(stream)));
    again(|stream, _| drop(write(stream, b"")));
    again(|_, datagrams| blocks(datagrams.receive(None, &mut [0; 9])));
}
