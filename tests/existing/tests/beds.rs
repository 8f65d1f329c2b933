//! Outside of a test bed, and the packages of the workspace.

use std::process::Command;

use cohaptic_testkit::Testbed;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};

/// Outside of a test bed sockets are real, also in a process in which test beds have run.
#[tokio::test]
async fn sockets_are_real_outside_of_a_test_bed() {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    let server = tokio::spawn(async move {
        let (stream, _) = listener.accept().await.unwrap();
        let (mut read, mut write) = stream.into_split();
        tokio::io::copy(&mut read, &mut write).await.unwrap();
    });
    // The kernel answers: a socket of the standard library hears the same server.
    tokio::task::spawn_blocking(move || drop(std::net::TcpStream::connect(address).unwrap())).await.unwrap();
    server.await.unwrap();

    let listener = TcpListener::bind("localhost:0").await.unwrap();
    let (mut client, server) = tokio::join!(async { TcpStream::connect(listener.local_addr().unwrap()).await.unwrap() }, listener.accept());
    server.unwrap().0.write_all(b"real").await.unwrap();
    let mut said = String::new();
    client.read_to_string(&mut said).await.unwrap();
    assert_eq!(said, "real");
    std::thread::spawn(|| Testbed::new(["host"]).on_tokio().run(async |_| ())).join().unwrap();
    assert!(TcpListener::bind("127.0.0.1:0").await.is_ok());
}

/// `select!` begins at random, and in a test bed the random numbers come from its seed.
#[test]
fn select_repeats_with_the_seed() {
    let drawn = |seed| {
        Testbed::new(["host"]).seed(seed).on_tokio().run(async |_| {
            let mut drawn = 0_u64;
            for _ in 0..64 {
                drawn = drawn << 1 | tokio::select! { () = std::future::ready(()) => 0, () = std::future::ready(()) => 1 };
            }
            drawn
        })
    };
    assert_eq!(drawn(1), drawn(1));
    assert_ne!(drawn(1), drawn(2));
}

#[test]
fn the_workspace_has_one_tokio() {
    let tree = Command::new(env!("CARGO")).args(["tree", "--offline", "--prefix", "none", "--edges", "all"]).output().unwrap();
    assert!(tree.status.success(), "{}", String::from_utf8_lossy(&tree.stderr));
    let tree = String::from_utf8(tree.stdout).unwrap();
    let mut tokios: Vec<&str> = tree.lines().filter(|line| line.starts_with("tokio v")).map(|line| line.trim_end_matches(" (*)")).collect();
    tokios.sort_unstable();
    tokios.dedup();
    assert_eq!(tokios.len(), 1, "{tokios:?}");
    assert!(tokios[0].contains("target/cohaptic/tokio"), "{tokios:?}");
    assert!(tree.contains("mini-redis v"));
}
