//! tokio-tungstenite: a client that looks a host up by its name, and a server.

use futures_util::{SinkExt, StreamExt};
use tokio::net::TcpListener;
use tokio_tungstenite::tungstenite::Message;

#[test]
fn messages_come_back() {
    // The client draws its key and its masks from the system, so that the contents of packets differ.
    crate::over_lossy_links(
        |bed| bed.without_digests(),
        async |bed| {
            bed.host("server").spawn(async {
                let listener = TcpListener::bind("0.0.0.0:9001").await.unwrap();
                loop {
                    let (stream, _) = listener.accept().await.unwrap();
                    tokio::spawn(async move {
                        let (mut write, mut read) = tokio_tungstenite::accept_async(stream).await.unwrap().split();
                        while let Some(Ok(message)) = read.next().await {
                            if message.is_text() {
                                write.send(message).await.unwrap();
                            }
                        }
                    });
                }
            });
            let client = bed.host("client").spawn(async {
                let (mut stream, _) = tokio_tungstenite::connect_async("ws://server:9001/").await.unwrap();
                for number in 0..20 {
                    let message = Message::text(format!("message {number} {}", "x".repeat(3000)));
                    stream.send(message.clone()).await.unwrap();
                    assert_eq!(stream.next().await.unwrap().unwrap(), message);
                }
                stream.close(None).await.unwrap();
            });
            client.await.unwrap();
        },
    );
}
