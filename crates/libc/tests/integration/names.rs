use std::net::{SocketAddr, ToSocketAddrs};

use cohaptic_testkit::{Bed, Testbed};

use crate::run;

fn look_up(name: &str) -> Vec<String> {
    (name, 80).to_socket_addrs().unwrap().map(|address: SocketAddr| address.to_string()).collect()
}

#[test]
fn names_are_those_of_the_hosts() {
    run(async |bed: Bed| {
        let client = bed.host("client").spawn(async {
            assert_eq!(look_up("server"), ["10.0.0.2:80", "[fd00::2]:80"]);
            assert_eq!(look_up("SERVER."), look_up("server"));
            assert_eq!(look_up("localhost"), ["[::1]:80", "127.0.0.1:80"]);
            assert_eq!(look_up("192.0.2.1"), ["192.0.2.1:80"]);
            assert!(("nobody", 80).to_socket_addrs().is_err());
            // A program that wants no search for names gets none.
            // SAFETY: hints of zeros are valid.
            let hints = libc::addrinfo { ai_flags: libc::AI_NUMERICHOST, ..unsafe { std::mem::zeroed() } };
            let mut list = std::ptr::null_mut();
            // SAFETY: the texts end with zeros, and there is a place for the list.
            assert_eq!(unsafe { libc::getaddrinfo(c"server".as_ptr(), c"80".as_ptr(), &raw const hints, &raw mut list) }, libc::EAI_NONAME);
        });
        client.await.unwrap();
    });
}

/// Work on another thread finds the hosts of its test bed, with their present addresses.
#[test]
fn a_thread_that_works_for_a_host_looks_names_up() {
    Testbed::new(["client", "server"]).run(async |bed: Bed| {
        let server = bed.host("server");
        let found = bed.host("client").spawn(async move {
            server.change_addresses();
            let host = cohaptic_sockets::host().unwrap();
            let work = std::thread::spawn(move || {
                let _on = cohaptic_sockets::on_host(host);
                look_up("server")
            });
            work.join().unwrap()
        });
        assert_eq!(found.await.unwrap(), ["10.0.0.3:80", "[fd00::3]:80"]);
    });
}

/// A name leads to the interface by which a host is reached now, also on another thread.
#[test]
fn a_thread_that_works_for_a_host_finds_the_uplink() {
    Testbed::new(["client", "phone"]).interfaces("phone", ["wifi", "lte"]).run(async |bed: Bed| {
        let phone = bed.host("phone");
        let found = bed.host("client").spawn(async move {
            let addresses = phone.uplink("lte");
            let host = cohaptic_sockets::host().unwrap();
            let work = std::thread::spawn(move || {
                let _on = cohaptic_sockets::on_host(host);
                look_up("phone")
            });
            (addresses, work.join().unwrap())
        });
        let (addresses, found) = found.await.unwrap();
        assert_eq!(found, [SocketAddr::from((addresses.v4, 80)).to_string(), SocketAddr::from((addresses.v6, 80)).to_string()]);
    });
}
