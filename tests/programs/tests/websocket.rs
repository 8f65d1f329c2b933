//! tokio-tungstenite: a WebSocket that echoes.

use cohaptic_testkit::Bed;
use futures_util::{SinkExt, StreamExt};
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::{accept_async, client_async};

use crate::{octets, over_a_bad_link};

#[test]
fn a_websocket_that_echoes() {
    let program = |bed: Bed| async move {
        let listener = bed.host("server").listen("0.0.0.0:80").unwrap();
        let serving = bed.host("server").spawn(async move {
            let mut socket = accept_async(listener.accept().await.unwrap().0).await.unwrap();
            while let Some(Ok(message)) = socket.next().await {
                if message.is_binary() {
                    socket.send(message).await.unwrap();
                }
            }
        });
        let stream = bed.host("client").connect("server:80").await.unwrap();
        let (mut socket, _) = client_async("ws://server/", stream).await.unwrap();
        for count in [1, 2000, 20_000] {
            socket.send(Message::binary(octets(count))).await.unwrap();
            assert_eq!(socket.next().await.unwrap().unwrap().into_data(), octets(count));
        }
        socket.close(None).await.unwrap();
        while let Some(Ok(_)) = socket.next().await {}
        serving.await.unwrap();
    };
    // Keys and masks are random.
    over_a_bad_link(|bed| bed.without_digests(), program);
    over_a_bad_link(|bed| bed.without_digests().on_tokio(), program);
}
