//! A shop and its kitchen, which talk through Redis.

use std::time::Duration;

use futures_util::StreamExt;
use redis::{AsyncCommands, AsyncConnectionConfig, Client, RedisResult};

/// Publishes an order, and publishes it again on a new connection if no answer comes within half a second.
///
/// # Errors
///
/// The errors of Redis, other than that no answer comes in time.
pub async fn order(redis: &Client, order: &str) -> RedisResult<()> {
    let config = AsyncConnectionConfig::new().set_response_timeout(Some(Duration::from_millis(500)));
    loop {
        let published = async {
            let mut connection = redis.get_multiplexed_async_connection_with_config(&config).await?;
            connection.publish("orders", order).await
        };
        match published.await {
            Err(error) if error.is_timeout() => {}
            outcome => return outcome,
        }
    }
}

/// Calls `cook` for each order.
///
/// # Errors
///
/// The errors of Redis, and an error if an order is not text.
pub async fn kitchen(redis: &Client, mut cook: impl FnMut(String)) -> RedisResult<()> {
    let mut subscription = redis.get_async_pubsub().await?;
    subscription.subscribe("orders").await?;
    let mut orders = subscription.on_message();
    while let Some(order) = orders.next().await {
        cook(order.get_payload()?);
    }
    Ok(())
}
