//! Relays that would send to themselves.

use std::net::UdpSocket;

use cohaptic_realtime::udp::EndpointConfig;
use cohaptic_relay::{ConfigError, Form, Limits, Proxy, Relay, RelayConfig, RelayError};

use super::{link, mesh};

/// A relay that sends to a port of its own is refused under every name of the port, even if another program already holds the port.
#[test]
fn a_relay_to_itself_is_refused() {
    let holder = UdpSocket::bind("127.0.0.1:0").unwrap();
    let taken = holder.local_addr().unwrap().port();
    let refused = |config: RelayConfig| match Relay::bind(config, EndpointConfig::default()) {
        Err(RelayError::Config(ConfigError::ToItself { to, port })) => (to, port),
        other => panic!("{other:?}"),
    };
    for (listen, to) in [("127.0.0.1", "127.0.0.1"), ("0.0.0.0", "127.0.0.1"), ("127.0.0.1", "0.0.0.0"), ("[::]", "[::1]")] {
        let [listen, to] = [listen, to].map(|ip| format!("{ip}:{taken}").parse().unwrap());
        let proxy = Proxy { listen, to, forth: link(&[]), back: link(&[]), most_clients: 1 };
        let config = RelayConfig { seed: 0, form: Form::Proxy(proxy), limits: Limits::default(), changes: Vec::new() };
        assert_eq!(refused(config), (to, listen));
    }
    // In a mesh, a program's address must not be the port standing for another program.
    let [left, right] = ["127.0.0.1:7001", "127.0.0.1:7002"].map(|text| text.parse().unwrap());
    let programs = [("left", left, None), ("right", right, Some(left))];
    assert_eq!(refused(mesh(&programs, link(&[]), &[])), (left, left));
}
