//! Builders of tasks, which tokio has with `--cfg tokio_unstable` and its feature `tracing`: tasks keep their host and end with it, and time waits for blocking
//! work. `.ci/tokio-tests` runs this file.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use cohaptic_testkit::{Bed, Testbed};
use tokio::net::UdpSocket;
use tokio::runtime::Handle;
use tokio::task::{Builder, JoinSet, LocalSet};
use tokio::time::{Instant, sleep};

fn two() -> Testbed {
    Testbed::new(["client", "server"]).links("delay 5ms").on_tokio()
}

/// Sends a datagram to the client.
async fn send() {
    UdpSocket::bind("0.0.0.0:0").await.unwrap().send_to(b"where", "client:9").await.unwrap();
}

#[test]
fn tasks_keep_their_host() {
    two().run(async |bed: Bed| {
        let client = bed.host("client").bind("0.0.0.0:9").unwrap();
        let server = bed.host("server").spawn(async {
            let builder = || Builder::new().name("sender");
            builder().spawn(send()).unwrap().await.unwrap();
            builder().spawn_on(send(), &Handle::current()).unwrap().await.unwrap();
            builder().spawn_local(send()).unwrap().await.unwrap();
            let local = LocalSet::new();
            let within = builder().spawn_local_on(send(), &local).unwrap();
            local.run_until(async { within.await.unwrap() }).await;
            let handle = Handle::current();
            builder().spawn_blocking(move || handle.spawn(send())).unwrap().await.unwrap().await.unwrap();
            let mut set = JoinSet::new();
            set.build_task().name("sender").spawn(send()).unwrap();
            set.build_task().spawn_on(send(), &Handle::current()).unwrap();
            set.build_task().spawn_local(send()).unwrap();
            assert_eq!(set.join_all().await.len(), 3);
        });
        for _ in 0..8 {
            let (_, from) = client.recv_from(&mut [0; 10]).await.unwrap();
            assert_eq!(bed.owner(from.ip()).as_deref(), Some("server"));
        }
        server.await.unwrap();
    });
}

/// Counts the drops of a value.
struct Dropped(Arc<AtomicUsize>);

impl Drop for Dropped {
    fn drop(&mut self) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }
}

#[test]
fn tasks_end_when_their_host_crashes() {
    two().run(async |bed: Bed| {
        let dropped = Arc::new(AtomicUsize::new(0));
        let count = Arc::clone(&dropped);
        let kept = bed
            .host("server")
            .spawn(async move {
                let waits = || {
                    let value = Dropped(Arc::clone(&count));
                    async move {
                        sleep(Duration::from_secs(100)).await;
                        drop(value);
                    }
                };
                let mut set = JoinSet::new();
                set.build_task().spawn(waits()).unwrap();
                (Builder::new().spawn(waits()).unwrap(), Builder::new().spawn_local(waits()).unwrap(), set)
            })
            .await
            .unwrap();
        sleep(Duration::from_millis(10)).await;
        bed.host("server").crash();
        assert!(kept.0.await.unwrap_err().is_cancelled() && kept.1.await.unwrap_err().is_cancelled());
        sleep(Duration::from_millis(1)).await;
        assert_eq!(dropped.load(Ordering::Relaxed), 3);
    });
}

#[test]
fn time_waits_for_blocking_work() {
    two().run(async |bed: Bed| {
        let begin = Instant::now();
        let work = || std::thread::sleep(Duration::from_millis(20));
        let timer = tokio::spawn(sleep(Duration::from_millis(3)));
        bed.host("server")
            .spawn(async move {
                Builder::new().spawn_blocking(work).unwrap().await.unwrap();
                Builder::new().spawn_blocking_on(work, &Handle::current()).unwrap().await.unwrap();
                let mut set = JoinSet::new();
                set.build_task().spawn_blocking(work).unwrap();
                set.build_task().spawn_blocking_on(work, &Handle::current()).unwrap();
                assert_eq!(set.join_all().await.len(), 2);
            })
            .await
            .unwrap();
        assert_eq!(begin.elapsed(), Duration::ZERO);
        timer.await.unwrap();
        assert_eq!(begin.elapsed(), Duration::from_millis(3));
    });
}
