//! A shop that takes orders over WebSockets, and its client.

use std::time::Duration;

use futures_util::{SinkExt, StreamExt};
use tokio::net::TcpListener;
use tokio::time::timeout;
use tokio_tungstenite::tungstenite::{Error, Message};
use tokio_tungstenite::{accept_async, connect_async};

/// Calls `take` for each order that comes.
pub async fn serve(listener: TcpListener, take: impl Fn(&str) + Clone + Send + 'static) {
    while let Ok((stream, _)) = listener.accept().await {
        let take = take.clone();
        tokio::spawn(async move {
            let mut stream = accept_async(stream).await?;
            while let Some(Ok(Message::Text(order))) = stream.next().await {
                take(&order);
                stream.send(Message::text("taken")).await?;
            }
            Ok::<(), Error>(())
        });
    }
}

/// Orders, and orders again on a new connection if no answer comes within half a second.
///
/// # Errors
///
/// If no connection can be opened, or the connection ends.
pub async fn order(url: &str, order: &str) -> Result<(), Error> {
    loop {
        let (mut stream, _) = connect_async(url).await?;
        stream.send(Message::text(order)).await?;
        if timeout(Duration::from_millis(500), stream.next()).await.is_ok() {
            return Ok(());
        }
    }
}
