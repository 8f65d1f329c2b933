//! A program with tests of its own that know of no test bed. `loopback.rs` runs these tests again on a loopback that is a link, and reads how long each took.

use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::runtime::{Builder, Runtime};
use tokio::task::LocalSet;
use tokio::time::Instant;

/// Sends a byte over TCP at `host` and back, `rounds` times.
async fn echo(host: &str, rounds: u8) {
    let listener = TcpListener::bind((host, 0)).await.unwrap();
    let port = listener.local_addr().unwrap().port();
    tokio::spawn(async move {
        let (mut stream, _) = listener.accept().await.unwrap();
        let (mut read, mut write) = stream.split();
        tokio::io::copy(&mut read, &mut write).await.unwrap();
    });
    let mut stream = TcpStream::connect((host, port)).await.unwrap();
    for round in 0..rounds {
        stream.write_all(&[round]).await.unwrap();
        assert_eq!(stream.read_u8().await.unwrap(), round);
    }
}

/// Prints how long `program` takes by the clock of tokio.
async fn timed(name: &str, program: impl Future<Output = ()>) {
    let begin = Instant::now();
    program.await;
    println!("{name} took {} ns", begin.elapsed().as_nanos());
}

#[tokio::test]
async fn over_an_address() {
    timed("address", echo("127.0.0.1", 1)).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn over_a_name() {
    timed("name", echo("localhost", 1)).await;
}

/// The span is taken by the clock of the standard library.
#[tokio::test]
async fn by_the_clock_of_the_standard_library() {
    let begin = std::time::Instant::now();
    tokio::time::sleep(Duration::from_millis(100)).await;
    println!("the clock says {} ns", begin.elapsed().as_nanos());
}

#[test]
fn by_a_runtime() {
    Runtime::new().unwrap().block_on(timed("runtime", echo("127.0.0.1", 1)));
}

#[test]
fn by_a_set_of_local_tasks() {
    let runtime = Builder::new_current_thread().enable_all().build().unwrap();
    let program = async { tokio::task::spawn_local(timed("set", echo("127.0.0.1", 1))).await.unwrap() };
    LocalSet::new().block_on(&runtime, program);
}

#[tokio::main]
async fn program() {
    timed("main", echo("127.0.0.1", 1)).await;
}

#[test]
fn by_the_main_function() {
    program();
}

#[tokio::test]
async fn many_messages() {
    timed("many", echo("127.0.0.1", 30)).await;
}

/// Chances of `select!` as bits.
#[tokio::test]
async fn chances() {
    let mut drawn = 0_u64;
    for _ in 0..64 {
        drawn = drawn << 1 | tokio::select! { () = std::future::ready(()) => 0, () = std::future::ready(()) => 1 };
    }
    println!("chances took {drawn} ns");
}

#[tokio::test]
async fn work_on_another_thread() {
    let work = tokio::task::spawn_blocking(|| std::thread::sleep(Duration::from_millis(20)));
    timed("work", async { work.await.unwrap() }).await;
}
