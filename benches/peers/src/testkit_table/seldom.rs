//! A program that mostly waits: a question now and then.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use super::program::{Datagrams, Runtime, SIZE};

/// Asks so often, and waits so long after each answer.
///
/// # Errors
///
/// What a socket gives.
pub async fn client<R: Runtime>(runtime: R, server: SocketAddr, wait: Duration, count: u32) -> io::Result<()> {
    let socket = runtime.bind().await?;
    for _ in 0..count {
        socket.send_to(&[0; SIZE], server).await?;
        socket.receive(&mut [0; SIZE]).await?;
        if !wait.is_zero() {
            runtime.sleep_until(runtime.now() + wait).await;
        }
    }
    Ok(())
}

/// Answers for ever.
///
/// # Errors
///
/// What a socket gives.
pub async fn server<R: Runtime>(runtime: R, client: SocketAddr) -> io::Result<()> {
    let socket = runtime.bind().await?;
    let mut buffer = [0; SIZE];
    loop {
        let len = socket.receive(&mut buffer).await?;
        socket.send_to(&buffer[..len], client).await?;
    }
}
