//! Tasks of tokio keep the host on which they were started, however they were started, and end with the host.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use cohaptic_testkit::{Bed, Testbed};
use tokio::net::UdpSocket;
use tokio::runtime::Handle;
use tokio::task::{JoinSet, LocalSet};
use tokio::time::{Instant, sleep};

fn two() -> Testbed {
    Testbed::new(["client", "server"]).links("delay 5ms").on_tokio()
}

/// Returns the address of a socket that the present task makes.
async fn own_address() -> String {
    let socket = UdpSocket::bind("0.0.0.0:0").await.unwrap();
    // The address of the interface is known once the socket is connected.
    socket.connect("client:9").await.unwrap();
    socket.send(b"where").await.unwrap();
    "sent".to_owned()
}

/// Receives what the tasks send, and checks that all of it comes from the server.
async fn all_come_from_the_server(bed: &Bed, number: usize) {
    let client = bed.host("client").bind("0.0.0.0:9").unwrap();
    for _ in 0..number {
        let (_, from) = client.recv_from(&mut [0; 10]).await.unwrap();
        assert_eq!(bed.owner(from.ip()).as_deref(), Some("server"));
    }
}

#[test]
fn each_way_to_start_a_task_keeps_the_host() {
    two().run(async |bed: Bed| {
        let server = bed.host("server").spawn(async {
            tokio::spawn(own_address()).await.unwrap();
            tokio::task::spawn_local(own_address()).await.unwrap();
            Handle::current().spawn(own_address()).await.unwrap();
            // A task of a task, and a task that a thread for blocking work starts.
            tokio::spawn(async { tokio::spawn(own_address()).await.unwrap() }).await.unwrap();
            let handle = Handle::current();
            tokio::task::spawn_blocking(move || handle.spawn(own_address())).await.unwrap().await.unwrap();

            let mut set = JoinSet::new();
            set.spawn(own_address());
            set.spawn_on(own_address(), &Handle::current());
            set.spawn_local(own_address());
            set.extend([own_address()]);
            assert_eq!(set.join_all().await.len(), 4);
            let local = LocalSet::new();
            let within = local.spawn_local(own_address());
            local.run_until(async { within.await.unwrap() }).await;
        });
        all_come_from_the_server(&bed, 10).await;
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
        let handles = bed
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
                set.spawn(waits());
                ([tokio::spawn(waits()), tokio::task::spawn_local(waits())], set)
            })
            .await
            .unwrap();
        sleep(Duration::from_millis(10)).await;
        assert_eq!(dropped.load(Ordering::Relaxed), 0);
        bed.host("server").crash();
        let (handles, mut set) = handles;
        for handle in handles {
            assert!(handle.await.unwrap_err().is_cancelled());
        }
        assert!(set.join_next().await.unwrap().unwrap_err().is_cancelled());
        assert_eq!(dropped.load(Ordering::Relaxed), 3);
        assert_eq!(bed.now().as_nanos(), 10_000_000);
    });
}

#[test]
fn other_hosts_keep_their_tasks() {
    two().run(async |bed: Bed| {
        let (handle,) = bed.host("client").spawn(async { (tokio::spawn(async { 7 }),) }).await.unwrap();
        bed.host("server").crash();
        assert_eq!(handle.await.unwrap(), 7);
    });
}

#[test]
fn virtual_time_waits_for_blocking_work() {
    two().run(async |bed: Bed| {
        let begin = Instant::now();
        let sleeper = tokio::spawn(sleep(Duration::from_millis(3)));
        let work = || std::thread::sleep(Duration::from_millis(30));
        bed.host("server").spawn(async move { tokio::task::spawn_blocking(work).await.unwrap() }).await.unwrap();
        let mut set = JoinSet::new();
        set.spawn_blocking(work);
        set.join_next().await.unwrap().unwrap();
        assert_eq!(begin.elapsed(), Duration::ZERO);
        sleeper.await.unwrap();
        assert_eq!(begin.elapsed(), Duration::from_millis(3));
    });
}

/// The time of packets waits for blocking work as well, whichever function starts the work.
#[test]
fn packets_wait_for_blocking_work() {
    fn work() {
        std::thread::sleep(Duration::from_millis(20));
    }
    type Way = fn() -> std::pin::Pin<Box<dyn Future<Output = ()>>>;
    let ways: [Way; 4] = [
        || Box::pin(async { tokio::task::spawn_blocking(work).await.unwrap() }),
        || Box::pin(async { Handle::current().spawn_blocking(work).await.unwrap() }),
        || {
            Box::pin(async {
                let mut set = JoinSet::new();
                set.spawn_blocking(work);
                set.join_next().await.unwrap().unwrap();
            })
        },
        || {
            Box::pin(async {
                let mut set = JoinSet::new();
                set.spawn_blocking_on(work, &Handle::current());
                set.join_next().await.unwrap().unwrap();
            })
        },
    ];
    for way in ways {
        // Within a millisecond not tokio moves the clock but the test bed.
        two().links("delay 500us").run(async move |bed: Bed| {
            let client = bed.host("client").bind("0.0.0.0:9").unwrap();
            bed.host("server").spawn(async move {
                own_address().await;
                way().await;
            });
            let begin = Instant::now();
            tokio::task::yield_now().await;
            bed.host("client").spawn(async move { way().await }).await.unwrap();
            assert_eq!(begin.elapsed(), Duration::ZERO);
            client.recv(&mut [0; 10]).await.unwrap();
            assert_eq!(begin.elapsed(), Duration::from_micros(500));
        });
    }
}

/// Starts a task, and counts it when it is over, when the value is dropped.
struct Tells(Arc<AtomicUsize>);

impl Drop for Tells {
    fn drop(&mut self) {
        let told = Arc::clone(&self.0);
        tokio::spawn(async move {
            own_address().await;
            told.fetch_add(1, Ordering::Relaxed);
        });
    }
}

/// A future that is over, or that is aborted, is dropped on its host: a task that its destructor starts lives there.
#[test]
fn futures_are_dropped_on_their_host() {
    two().run(async |bed: Bed| {
        let told = Arc::new(AtomicUsize::new(0));
        let (one, other) = (Tells(Arc::clone(&told)), Tells(Arc::clone(&told)));
        bed.host("server")
            .spawn(async move {
                let ends = tokio::spawn(async move {
                    let _kept = one;
                    tokio::task::yield_now().await;
                });
                ends.await.unwrap();
                let waits = tokio::spawn(async move {
                    sleep(Duration::from_secs(100)).await;
                    drop(other);
                });
                tokio::task::yield_now().await;
                waits.abort();
            })
            .await
            .unwrap();
        all_come_from_the_server(&bed, 2).await;
        assert_eq!(told.load(Ordering::Relaxed), 2);
    });
}

/// A test bed moves its time itself.
#[test]
fn pause_and_resume_do_nothing() {
    two().run(async |_: Bed| {
        let begin = Instant::now();
        tokio::time::pause();
        sleep(Duration::from_secs(1)).await;
        tokio::time::resume();
        tokio::time::resume();
        sleep(Duration::from_secs(1)).await;
        assert_eq!(begin.elapsed(), Duration::from_secs(2));
    });
}

#[test]
fn a_program_for_many_threads_may_block_in_place() {
    two().run(async |_: Bed| assert_eq!(tokio::task::block_in_place(|| 7), 7));
}

#[test]
#[should_panic(expected = "call `Testbed::on_tokio` before `run`")]
fn tasks_need_a_test_bed_on_tokio() {
    Testbed::new(["host"]).run(async |_: Bed| drop(tokio::spawn(async {})));
}

/// A panic of blocking work is that of the task, as with the real tokio.
#[test]
fn blocking_work_may_panic() {
    two().run(async |_: Bed| {
        let error = tokio::task::spawn_blocking(|| panic!("blocking work panics")).await.unwrap_err();
        assert_eq!(error.into_panic().downcast_ref::<&str>(), Some(&"blocking work panics"));
    });
}
