//! Calls that a test bed refuses, with a sentence that says what to do.

use cohaptic_testkit::{Bed, Testbed};
use tokio::net::{TcpListener, TcpSocket, TcpStream, UdpSocket};

fn on_one_host<F: Future<Output = ()> + 'static>(program: impl FnOnce() -> F + 'static) {
    Testbed::new(["host"]).on_tokio().run(|bed: Bed| async move {
        bed.host("host").spawn(program()).await.unwrap();
    });
}

#[test]
#[should_panic(expected = "builds a runtime of tokio inside a test bed")]
fn a_further_runtime() {
    on_one_host(async || drop(tokio::runtime::Builder::new_multi_thread().build()));
}

#[test]
#[should_panic(expected = "tests/refused.rs")]
fn a_further_runtime_by_its_short_name() {
    on_one_host(async || drop(tokio::runtime::Runtime::new()));
}

#[test]
#[should_panic(expected = "builds a runtime of tokio inside a test bed")]
fn a_further_runtime_of_one_thread() {
    on_one_host(async || drop(tokio::runtime::LocalRuntime::new()));
}

#[test]
#[should_panic(expected = "starts the process \"true\" in a test bed")]
fn a_process() {
    on_one_host(async || drop(tokio::process::Command::new("true").arg("now").spawn()));
}

#[test]
#[should_panic(expected = "by `Host::spawn`, or run the processes outside of tests, over `cohaptic relay`")]
fn a_process_whose_output_is_wanted() {
    on_one_host(async || drop(tokio::process::Command::new("true").output().await));
}

#[tokio::test]
async fn a_process_outside_of_a_test_bed_is_started() {
    let mut command = tokio::process::Command::new("sh");
    let output = command.args(["-c", "echo $A"]).env("A", "said").output().await.unwrap();
    assert_eq!(output.stdout, b"said\n");
    assert!(command.arg("more").stdout(std::process::Stdio::null()).status().await.unwrap().success());
}

#[test]
#[should_panic(expected = "`UdpSocket::bind` at tests/refused.rs:")]
fn a_socket_on_no_host() {
    Testbed::new(["host"]).on_tokio().run(async |_: Bed| drop(UdpSocket::bind("0.0.0.0:0").await));
}

#[test]
fn real_sockets_that_are_bound() {
    // Made before the run, the sockets belong to the system.
    let datagrams = std::net::UdpSocket::bind("127.0.0.1:0").unwrap();
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let client = std::net::TcpStream::connect(listener.local_addr().unwrap()).unwrap();
    on_one_host(async move || {
        let real = datagrams;
        real.set_nonblocking(true).unwrap();
        let error = UdpSocket::from_std(real).unwrap_err().to_string();
        assert!(error.contains("`UdpSocket::from_std` in a test bed") && error.contains("the functions of `tokio::net`"), "{error}");
        let real = listener;
        client.set_nonblocking(true).unwrap();
        let error = TcpStream::from_std(client.try_clone().unwrap()).unwrap_err().to_string();
        assert!(error.contains("`TcpStream::from_std` in a test bed"), "{error}");
        let error = TcpSocket::from_std_stream(client).connect("127.0.0.1:9".parse().unwrap()).await.unwrap_err().to_string();
        assert!(error.contains("`TcpSocket::from_std_stream` in a test bed") && error.contains("bind it afterwards"), "{error}");
        assert!(TcpListener::from_std(real).is_err());
    });
}

#[test]
fn a_socket_on_a_thread_for_blocking_work() {
    on_one_host(async || {
        let handle = tokio::runtime::Handle::current();
        let error = tokio::task::spawn_blocking(move || handle.block_on(UdpSocket::bind("0.0.0.0:0"))).await.unwrap().unwrap_err();
        assert!(error.to_string().contains("Make the socket in a task"), "{error}");
    });
}
