//! The programs with connections: they know their runtime by a small trait only.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use futures_util::future;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};

/// The octets of a question, and of its answer.
pub const SIZE: usize = 100;
/// Where servers listen.
pub const PORT: u16 = 7000;
/// The time between the begins of two clients: no listener has more at one instant than may wait there.
const OFFSET: Duration = Duration::from_micros(10);
/// The octets of one call of `write`.
const CHUNK: usize = 65_536;

/// What a program asks of its runtime, on one host.
pub trait Net: Clone + 'static {
    /// A connection.
    type Stream: AsyncRead + AsyncWrite + Unpin + 'static;
    /// What accepts them.
    type Listener: 'static;

    /// Listens at [`PORT`].
    fn listen(&self) -> impl Future<Output = io::Result<Self::Listener>>;
    /// Accepts a connection.
    fn accept(listener: &Self::Listener) -> impl Future<Output = io::Result<Self::Stream>>;
    /// Opens a connection.
    fn connect(server: SocketAddr) -> impl Future<Output = io::Result<Self::Stream>>;
    /// Waits.
    fn sleep(span: Duration) -> impl Future<Output = ()>;
    /// Starts a task on the host.
    fn spawn(&self, task: impl Future<Output = io::Result<()>> + 'static) -> impl Future<Output = io::Result<()>> + 'static;
}

/// Answers on every connection for ever.
///
/// # Errors
///
/// The errors of the listener.
pub async fn answer<N: Net>(net: N) -> io::Result<()> {
    let listener = net.listen().await?;
    loop {
        drop(net.spawn(serve(N::accept(&listener).await?)));
    }
}

/// Answers on a connection until it ends.
///
/// # Errors
///
/// What the connection gives, its end included.
pub async fn serve(mut stream: impl AsyncRead + AsyncWrite + Unpin) -> io::Result<()> {
    let mut question = [0; SIZE];
    loop {
        stream.read_exact(&mut question).await?;
        stream.write_all(&question).await?;
    }
}

/// Opens a connection and asks so often.
///
/// # Errors
///
/// The errors of the connection.
pub async fn ask<N: Net>(server: SocketAddr, questions: u32) -> io::Result<()> {
    asking(N::connect(server).await?, questions).await
}

/// Asks so often on a connection, each time when the answer is there.
///
/// # Errors
///
/// The errors of the connection.
pub async fn asking(mut stream: impl AsyncRead + AsyncWrite + Unpin, questions: u32) -> io::Result<()> {
    for number in 0..questions {
        let (question, mut answer) = ([number.to_le_bytes()[0]; SIZE], [0; SIZE]);
        stream.write_all(&question).await?;
        stream.read_exact(&mut answer).await?;
        assert_eq!(question, answer);
    }
    Ok(())
}

/// Asks a number of times on each of a number of connections.
///
/// # Errors
///
/// What a connection gives.
pub async fn crowd<N: Net>(net: N, server: SocketAddr, connections: u32, questions: u32) -> io::Result<()> {
    let client = |number| async move {
        N::sleep(OFFSET * number).await;
        ask::<N>(server, questions).await
    };
    future::try_join_all((0..connections).map(|number| net.spawn(client(number)))).await.map(drop)
}

/// Writes a number of octets, shuts the connection for writing, and waits until the other end is shut.
async fn write_and_shut(mut stream: impl AsyncRead + AsyncWrite + Unpin, octets: usize) -> io::Result<()> {
    let chunk = vec![7; CHUNK];
    let mut left = octets;
    while left > 0 {
        left -= stream.write(&chunk[..left.min(CHUNK)]).await?;
    }
    stream.shutdown().await?;
    stream.read(&mut [0]).await.map(drop)
}

/// Writes a number of octets on the first connection, and waits until the other end is shut.
///
/// # Errors
///
/// The errors of the connection.
pub async fn give<N: Net>(net: N, octets: usize) -> io::Result<()> {
    write_and_shut(N::accept(&net.listen().await?).await?, octets).await
}

/// Reads a number of octets.
///
/// # Errors
///
/// What the connection gives, and [`io::ErrorKind::UnexpectedEof`] if there are fewer.
pub async fn take(stream: &mut (impl AsyncRead + Unpin), octets: usize) -> io::Result<()> {
    let mut chunk = vec![0; CHUNK];
    let mut left = octets;
    while left > 0 {
        let most = left.min(CHUNK);
        match stream.read(&mut chunk[..most]).await? {
            0 => return Err(io::ErrorKind::UnexpectedEof.into()),
            count => left -= count,
        }
    }
    Ok(())
}

/// Takes connections for ever, and reads each until its other end is shut.
///
/// # Errors
///
/// The errors of the listener.
pub async fn swallow<N: Net>(net: N) -> io::Result<()> {
    let listener = net.listen().await?;
    loop {
        drop(net.spawn(take_all(N::accept(&listener).await?)));
    }
}

/// Reads until the other end is shut.
async fn take_all(mut stream: impl AsyncRead + AsyncWrite + Unpin) -> io::Result<()> {
    let mut chunk = vec![0; CHUNK];
    while stream.read(&mut chunk).await? > 0 {}
    Ok(())
}

/// Opens a connection, writes a number of octets, and waits until the other end has read them.
///
/// # Errors
///
/// The errors of the connection.
pub async fn feed<N: Net>(server: SocketAddr, octets: usize) -> io::Result<()> {
    write_and_shut(N::connect(server).await?, octets).await
}
