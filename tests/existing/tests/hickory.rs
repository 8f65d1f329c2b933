//! hickory: a resolver that asks a server of names over UDP, and again if the answer is lost.

use std::net::IpAddr;

use hickory_resolver::Resolver;
use hickory_resolver::config::{NameServerConfig, ResolverConfig};
use hickory_resolver::net::runtime::TokioRuntimeProvider;
use tokio::net::UdpSocket;

/// Answers questions for addresses of version 4 with 192.0.2.N, of which N is the length of the first part of the name.
async fn serve() {
    let socket = UdpSocket::bind("0.0.0.0:53").await.unwrap();
    let mut buffer = [0; 512];
    loop {
        let (_, from) = socket.recv_from(&mut buffer).await.unwrap();
        // The question ends after its name, which ends with a zero, its type, and its class.
        let name = buffer[12..].iter().position(|byte| *byte == 0).unwrap();
        let question = &buffer[12..12 + name + 1 + 4];
        // An answer without errors: one question, one record.
        let head = [&buffer[..2], &[0x81, 0x80, 0, 1, 0, 1, 0, 0, 0, 0]].concat();
        // The name stands 12 bytes after the beginning; type A, class IN, 60 s, four bytes.
        let record = [0xc0, 12, 0, 1, 0, 1, 0, 0, 0, 60, 0, 4, 192, 0, 2, question[0]];
        socket.send_to(&[&head, question, &record[..]].concat(), from).await.unwrap();
    }
}

#[test]
fn names_are_looked_up() {
    // The numbers of questions come from the system, so that the contents of packets differ.
    crate::over_lossy_links(
        |bed| bed.without_digests(),
        async |bed| {
            bed.host("server").spawn(serve());
            let server: IpAddr = bed.host("server").ip();
            let client = bed.host("client").spawn(async move {
                let config = ResolverConfig::from_parts(None, Vec::new(), vec![NameServerConfig::udp(server)]);
                let mut resolver = Resolver::builder_with_config(config, TokioRuntimeProvider::default());
                // Otherwise hickory draws the port of each question.
                resolver.options_mut().os_port_selection = true;
                resolver.options_mut().attempts = 5;
                let resolver = resolver.build().unwrap();
                for (name, last) in [("a.example.", 1), ("abcdef.example.", 6), ("abc.example.", 3)] {
                    let found = resolver.ipv4_lookup(name).await.unwrap();
                    let text = format!("{found:?}");
                    assert!(text.contains(&format!("192.0.2.{last}")), "{text}");
                }
            });
            client.await.unwrap();
        },
    );
}
