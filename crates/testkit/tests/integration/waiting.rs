//! Tasks that read a socket again and again: with and without a record, on both executors.

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::rc::Rc;
use std::time::Duration;

use cohaptic_testkit::{Bed, Instant, Testbed, UdpSocket, time};

fn bed() -> Testbed {
    Testbed::new(["a", "b"]).links("delay 1ms")
}

/// Runs a program on both executors, with and without a second run for comparison. Returns its result, which must be the same in all ways.
fn in_all_ways<T: PartialEq + std::fmt::Debug + 'static, F: Future<Output = T> + 'static>(program: impl Fn(Bed) -> F + Copy) -> T {
    let given = bed().run(program);
    assert_eq!(bed().run_twice(program), given);
    assert_eq!(bed().on_tokio().run(program), given);
    assert_eq!(bed().on_tokio().run_twice(program), given);
    given
}

/// Sends datagrams of one byte from `a` to port 7 of `b`, a millisecond apart: 0, 1, 2 and so on.
async fn sends(bed: Bed, count: u8) {
    let socket = bed.host("a").bind("0.0.0.0:0").unwrap();
    for number in 0..count {
        socket.send_to(&[number], "b:7").await.unwrap();
        time::sleep(Duration::from_millis(1)).await;
    }
}

#[test]
fn two_readers_of_a_socket_are_woken_in_the_order_in_which_they_came() {
    let heard = in_all_ways(|bed| async move {
        let socket = Rc::new(bed.host("b").bind("0.0.0.0:7").unwrap());
        let heard = Rc::new(RefCell::new(Vec::new()));
        let reader = |name: &'static str, first: Duration, count: usize| {
            let (socket, heard) = (Rc::clone(&socket), Rc::clone(&heard));
            async move {
                time::sleep(first).await;
                for _ in 0..count {
                    let mut buffer = [0];
                    socket.recv(&mut buffer).await.unwrap();
                    heard.borrow_mut().push((name, buffer[0], time::now().as_nanos()));
                }
            }
        };
        let one = bed.spawn(reader("one", Duration::ZERO, 4));
        // It comes while the other one waits again.
        let two = bed.spawn(reader("two", Duration::from_micros(1500), 2));
        sends(bed.clone(), 6).await;
        one.await.unwrap();
        two.await.unwrap();
        heard.take()
    });
    let expected = [("one", 0), ("one", 1), ("one", 2), ("one", 3), ("two", 4), ("two", 5)];
    assert_eq!(heard, expected.map(|(name, number)| (name, number, 1_000_000 * (u64::from(number) + 1))));
}

#[test]
fn a_socket_is_read_by_another_task_than_before() {
    let heard = in_all_ways(|bed| async move {
        let socket = bed.host("b").bind("0.0.0.0:7").unwrap();
        let one = bed.spawn(async move {
            let mut buffer = [0];
            socket.recv(&mut buffer).await.unwrap();
            // It waits again, in vain.
            assert!(time::timeout(Duration::from_micros(100), socket.recv(&mut [0])).await.is_err());
            (socket, buffer[0])
        });
        drop(bed.spawn(sends(bed.clone(), 3)));
        let (socket, first) = one.await.unwrap();
        let read = |socket: UdpSocket| async move {
            let mut buffer = [0];
            let (_, _, at) = socket.recv_from_at(&mut buffer).await.unwrap();
            (socket, buffer[0], at)
        };
        let (socket, second, second_at) = bed.spawn(read(socket)).await.unwrap();
        let (_, third, third_at) = bed.spawn(read(socket)).await.unwrap();
        assert_eq!(time::now(), third_at);
        [(first, Instant::from_nanos(1_000_000)), (second, second_at), (third, third_at)]
    });
    assert_eq!(heard.map(|(number, at)| (number, at.as_nanos())), [(0, 1_000_000), (1, 2_000_000), (2, 3_000_000)]);
}

#[test]
fn a_reader_that_waits_again_learns_that_its_host_crashed() {
    let kind = in_all_ways(|bed| async move {
        let socket = bed.host("b").bind("0.0.0.0:7").unwrap();
        let reader = bed.spawn(async move {
            socket.recv(&mut [0]).await.unwrap();
            socket.recv(&mut [0]).await.map_err(|error| (error.kind(), time::now()))
        });
        sends(bed.clone(), 1).await;
        time::sleep(Duration::from_millis(1)).await;
        bed.host("b").crash();
        reader.await.unwrap()
    });
    assert_eq!(kind, Err((std::io::ErrorKind::ConnectionAborted, Instant::from_nanos(2_000_000))));
}

#[test]
fn a_socket_for_which_a_reader_waits_again_is_named_when_nothing_comes() {
    for bed in [bed(), bed().on_tokio()] {
        let program = |bed: Bed| async move {
            let socket = bed.host("b").bind("0.0.0.0:7").unwrap();
            drop(bed.spawn(sends(bed.clone(), 1)));
            for _ in 0..2 {
                socket.recv(&mut [0]).await.unwrap();
            }
        };
        let payload = catch_unwind(AssertUnwindSafe(|| bed.run(program))).unwrap_err();
        let text = payload.downcast_ref::<String>().unwrap();
        assert!(text.contains("host `b`: UDP 0.0.0.0:7 waits for a datagram"), "{text}");
    }
}

/// Without optimisation each call that hands a future on copies it on the stack: programs and tasks with arrays of 200 kB have room on half of the 2 MiB of a test's thread.
#[test]
fn programs_and_tasks_may_hold_large_arrays() {
    let run = || {
        Testbed::new(["a"]).run(|bed| async move {
            let program = [1_u8; 200_000];
            let task = bed.host("a").spawn(async {
                let task = [2_u8; 200_000];
                time::sleep(Duration::from_millis(1)).await;
                task.iter().map(|byte| usize::from(*byte)).sum::<usize>()
            });
            let sum = task.await.unwrap();
            assert_eq!(sum + program.len(), 600_000);
        });
    };
    std::thread::Builder::new().stack_size(1 << 20).spawn(run).unwrap().join().unwrap();
}
