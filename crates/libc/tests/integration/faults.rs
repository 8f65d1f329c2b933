use std::io::Read;
use std::net::{TcpListener, TcpStream, UdpSocket};

use cohaptic_testkit::{Bed, Testbed};

/// Runs a program on the host `alone`.
fn run<F: Future<Output = ()> + 'static>(program: impl FnOnce() -> F + 'static) {
    Testbed::new(["alone"]).run(async |bed: Bed| {
        let _ = bed.host("alone").spawn(program()).await;
    });
}

#[test]
#[should_panic(expected = "host `alone` makes the call `recvfrom` of the system, which would wait on a blocking socket")]
fn receiving_from_nobody() {
    run(async || drop(UdpSocket::bind("0.0.0.0:7").unwrap().recv_from(&mut [0; 1])));
}

/// The call fails, so that the program goes on to where the run can end.
#[test]
#[should_panic(expected = "host `alone` makes the call `accept` of the system")]
fn accepting_from_nobody() {
    run(async || {
        let error = TcpListener::bind("0.0.0.0:7").unwrap().accept().unwrap_err();
        assert_eq!(error.raw_os_error(), Some(libc::EDEADLK));
    });
}

#[test]
#[should_panic(expected = "host `alone` makes the call `connect` of the system")]
fn connecting() {
    run(async || drop(TcpStream::connect("10.0.0.9:8")));
}

#[test]
#[should_panic(expected = "host `alone` makes the call `poll` of the system, which would wait for a socket of the test bed")]
fn waiting_with_a_time_limit() {
    run(async || drop(TcpStream::connect_timeout(&"10.0.0.9:8".parse().unwrap(), std::time::Duration::from_secs(1))));
}

#[test]
#[should_panic(expected = "the call `bind` of the system was called by a task that belongs to no host")]
fn binding_on_no_host() {
    Testbed::new(["alone"]).run(async |_: Bed| drop(UdpSocket::bind("0.0.0.0:7")));
}

#[test]
#[should_panic(expected = "host `alone` makes the call `epoll_ctl` of the system")]
fn waiting_for_events_of_the_system() {
    run(async || {
        let socket = UdpSocket::bind("0.0.0.0:7").unwrap();
        // SAFETY: the event is valid, and the descriptors are open.
        unsafe {
            let poll = libc::epoll_create1(libc::EPOLL_CLOEXEC);
            let mut event = libc::epoll_event { events: libc::EPOLLIN as u32, u64: 0 };
            assert_eq!(libc::epoll_ctl(poll, libc::EPOLL_CTL_ADD, std::os::fd::AsRawFd::as_raw_fd(&socket), &raw mut event), -1);
            libc::close(poll);
        }
    });
}

/// A program reads files in a test bed, also while descriptors stand for sockets.
#[test]
fn files_are_those_of_the_system() {
    run(async || {
        let _socket = UdpSocket::bind("0.0.0.0:7").unwrap();
        let mut text = String::new();
        std::fs::File::open("/proc/self/cmdline").unwrap().read_to_string(&mut text).unwrap();
        assert!(text.contains("integration"));
    });
}

#[test]
#[should_panic(expected = "host `alone` makes the call `socket` of the system, on a thread for blocking work")]
fn a_socket_on_another_thread() {
    run(async || {
        let host = cohaptic_sockets::host().unwrap();
        let work = std::thread::spawn(move || {
            let _on = cohaptic_sockets::on_host(host);
            UdpSocket::bind("127.0.0.1:0").is_err()
        });
        assert!(work.join().unwrap());
    });
}
