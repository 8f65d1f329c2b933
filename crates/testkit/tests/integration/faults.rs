//! Hosts that crash, come back, are cut off from each other and move.

use std::cell::Cell;
use std::io::ErrorKind;
use std::rc::Rc;
use std::time::Duration;

use cohaptic_testkit::{Bed, Happening, Host, Lost, Testbed, UdpSocket, time};

const DELAY: Duration = Duration::from_millis(10);

fn beds() -> [Testbed; 2] {
    let bed = Testbed::new(["a", "b", "c"]).links("delay 10ms");
    [bed.clone(), bed.on_tokio()]
}

/// Returns a counter of the datagrams that arrive at port 5 of a host.
fn count(host: &Host) -> Rc<Cell<u32>> {
    let (socket, count) = (host.bind("0.0.0.0:5").unwrap(), Rc::new(Cell::new(0)));
    let counted = Rc::clone(&count);
    drop(host.spawn(async move {
        while socket.recv(&mut [0; 8]).await.is_ok() {
            counted.set(counted.get() + 1);
        }
    }));
    count
}

#[test]
fn a_crash_drops_tasks_where_they_wait_and_kills_sockets() {
    struct Dropped(Rc<Cell<bool>>);
    impl Drop for Dropped {
        fn drop(&mut self) {
            self.0.set(true);
        }
    }
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let (a, b) = (bed.host("a"), bed.host("b"));
            let dropped = Rc::new(Cell::new(false));
            let guard = Dropped(Rc::clone(&dropped));
            let waiting = b.spawn(async move {
                let _guard = guard;
                time::sleep(Duration::from_secs(100)).await;
            });
            let socket = b.bind("0.0.0.0:9").unwrap();
            let sender = a.bind("0.0.0.0:0").unwrap();
            // On its way when the host crashes, and lost when it arrives; what the host has sent itself goes on.
            sender.send_to(b"late", "b:9").await.unwrap();
            socket.send_to(b"last", sender.local_addr().map(|address| ("a", address.port())).unwrap()).await.unwrap();
            time::sleep(DELAY / 2).await;
            b.crash();
            assert!(dropped.get(), "at once");
            assert!(waiting.await.is_err());
            assert!(!b.is_up());
            assert_eq!(sender.recv(&mut [0; 8]).await.unwrap(), 4);
            let error = socket.send_to(b"x", "a:1").await.unwrap_err();
            assert_eq!(error.kind(), ErrorKind::ConnectionAborted);
            let text = error.to_string();
            assert_eq!(text, "host `b` crashed at 0.005 s, and this socket (0.0.0.0:9) with it; after `Host::restart`, bind a new one");
            assert_eq!(socket.recv(&mut [0; 8]).await.unwrap_err().kind(), ErrorKind::ConnectionAborted);
            assert_eq!(b.bind("0.0.0.0:9").unwrap_err().kind(), ErrorKind::NetworkDown);
            b.restart();
            // The dead socket holds its port no longer.
            let again = b.bind("0.0.0.0:9").unwrap();
            sender.send_to(b"again", "b:9").await.unwrap();
            assert_eq!(again.recv(&mut [0; 8]).await.unwrap(), 5);
            assert_eq!(socket.local_addr().unwrap_err().kind(), ErrorKind::ConnectionAborted, "it stays dead");
        });
    }
}

#[test]
fn a_program_is_begun_anew_by_a_restart() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let (a, b) = (bed.host("a"), bed.host("b"));
            let begun = Rc::new(Cell::new(0));
            let count = Rc::clone(&begun);
            b.start(move || {
                count.set(count.get() + 1);
                async {
                    // Bound on the host on which it runs.
                    let socket = UdpSocket::bind("0.0.0.0:7").await.unwrap();
                    let mut buffer = [0; 8];
                    loop {
                        let (len, from) = socket.recv_from(&mut buffer).await.unwrap();
                        socket.send_to(&buffer[..len], from).await.unwrap();
                    }
                }
            });
            let socket = a.bind("0.0.0.0:0").unwrap();
            for round in 1..=3 {
                let asked = bed.now();
                socket.send_to(b"echo", "b:7").await.unwrap();
                socket.recv(&mut [0; 8]).await.unwrap();
                assert_eq!(bed.now() - asked, 2 * DELAY);
                assert_eq!(begun.get(), round);
                b.crash();
                socket.send_to(b"nobody", "b:7").await.unwrap();
                assert!(time::timeout(Duration::from_secs(1), socket.recv(&mut [0; 8])).await.is_err());
                b.restart();
                b.restart();
            }
        });
    }
}

#[test]
fn a_host_may_crash_itself() {
    for bed in beds() {
        let reached = Rc::new(Cell::new(false));
        let after = Rc::clone(&reached);
        bed.run(|bed| async move {
            let b = bed.host("b");
            let task = b.clone().spawn(async move {
                b.crash();
                time::sleep(Duration::from_secs(1)).await;
                after.set(true);
            });
            assert!(task.await.is_err());
            time::sleep(Duration::from_secs(5)).await;
        });
        assert!(!reached.get(), "it ends where it next waits");
    }
}

#[test]
fn a_way_that_is_cut_loses_what_is_sent_and_what_would_arrive_and_the_way_back_is_open() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let (a, b) = (bed.host("a"), bed.host("b"));
            let (at_a, at_b) = (count(&a), count(&b));
            let (from_a, from_b) = (a.bind("0.0.0.0:0").unwrap(), b.bind("0.0.0.0:0").unwrap());
            let both = async || {
                from_a.send_to(b"x", "b:5").await.unwrap();
                from_b.send_to(b"x", "a:5").await.unwrap();
            };
            both().await;
            time::sleep(DELAY / 2).await;
            bed.cut("a", "b");
            // The first is on its way, and arrives nowhere.
            both().await;
            time::sleep(2 * DELAY).await;
            assert_eq!((at_a.get(), at_b.get()), (2, 0));
            bed.mend("a", "b");
            both().await;
            time::sleep(2 * DELAY).await;
            assert_eq!((at_a.get(), at_b.get()), (3, 1));
            // The link counts only the datagrams that were handed to the link.
            assert_eq!(bed.link_stats("a", "b").offered(), 2);
        });
    }
}

#[test]
fn a_partition_cuts_groups_apart_and_leaves_each_whole() {
    for bed in beds() {
        bed.run(|bed| async move {
            let counts: Vec<_> = bed.hosts().iter().map(count).collect();
            let sockets: Vec<_> = bed.hosts().iter().map(|host| host.bind("0.0.0.0:0").unwrap()).collect();
            let all_to_all = async || {
                for socket in &sockets {
                    for to in ["a", "b", "c"] {
                        socket.send_to(b"x", (to, 5)).await.unwrap();
                    }
                }
                time::sleep(2 * DELAY).await;
                counts.iter().map(|count| count.take()).collect::<Vec<_>>()
            };
            assert_eq!(all_to_all().await, [3, 3, 3]);
            bed.partition(&["a", "b"], &["c"]);
            assert_eq!(all_to_all().await, [2, 2, 1], "a host reaches itself");
            bed.mend_all();
            assert_eq!(all_to_all().await, [3, 3, 3]);
        });
    }
}

#[test]
fn a_host_that_moves_is_reached_at_its_new_address_alone() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let (a, b) = (bed.host("a"), bed.host("b"));
            let (any, fixed) = (b.bind("0.0.0.0:5").unwrap(), b.bind((b.ip(), 6)).unwrap());
            let from_a = a.bind("0.0.0.0:1").unwrap();
            let before = b.addresses();
            // From now on it is known where datagrams to that port go.
            from_a.send_to(b"first", (before.v4, 5)).await.unwrap();
            assert_eq!(any.recv(&mut [0; 20]).await.unwrap(), 5);
            from_a.send_to(b"on its way", (before.v4, 5)).await.unwrap();
            let after = b.change_addresses();
            assert_eq!((after.v4.to_string(), after.v6.to_string()), ("10.0.0.4".into(), "fd00::4".into()));
            assert_eq!((bed.owner(before.v4.into()), bed.owner(after.v4.into())), (None, Some("b".into())));
            from_a.send_to(b"old", (before.v4, 5)).await.unwrap();
            from_a.send_to(b"new", ("b", 5)).await.unwrap();
            assert_eq!(any.recv(&mut [0; 20]).await.unwrap(), 3, "the last one alone");
            assert_eq!(any.try_recv(&mut [0; 20]).unwrap_err().kind(), ErrorKind::WouldBlock);
            any.send_to(b"moved", "a:1").await.unwrap();
            assert_eq!(from_a.recv_from(&mut [0; 8]).await.unwrap(), (5, (after.v4, 5).into()));
            assert_eq!(fixed.send_to(b"x", "a:1").await.unwrap_err().kind(), ErrorKind::AddrNotAvailable);
            assert_eq!(b.bind((before.v4, 9)).unwrap_err().kind(), ErrorKind::AddrNotAvailable);
        });
    }
}

#[test]
fn nobody_at_a_port_is_told_over_the_link() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let socket = bed.host("a").bind("0.0.0.0:0").unwrap();
            socket.connect("b:99").await.unwrap();
            socket.send(b"hello?").await.unwrap();
            assert_eq!(socket.recv(&mut [0; 8]).await.unwrap_err().kind(), ErrorKind::ConnectionRefused);
            assert_eq!(bed.now().as_nanos(), 20_000_000, "there and back");
            bed.cut("b", "a");
            socket.send(b"hello?").await.unwrap();
            assert!(time::timeout(Duration::from_secs(9), socket.recv(&mut [0; 8])).await.is_err(), "the answer can be lost");
        });
    }
}

#[test]
fn a_full_buffer_loses_what_comes_and_everything_has_a_name_in_the_trace() {
    // Two datagrams of 10 bytes take 1664 bytes of memory.
    let bed = Testbed::new(["a", "b"]).links("delay 1ms").receive_buffer(1664).seed(1);
    let (got, happened) = bed.run_twice(|bed| async move {
        let (a, b) = (bed.host("a").bind("0.0.0.0:0").unwrap(), bed.host("b").bind("0.0.0.0:5").unwrap());
        for _ in 0..3 {
            a.send_to(&[0; 10], "b:5").await.unwrap();
        }
        time::sleep(DELAY).await;
        let mut got = 0;
        while b.try_recv(&mut [0; 10]).is_ok() {
            got += 1;
        }
        // Room again.
        a.send_to(&[0; 25], "b:5").await.unwrap();
        assert_eq!(b.recv(&mut [0; 30]).await.unwrap(), 25);
        let happened: Vec<Happening> = bed.trace().events().iter().map(|event| event.what.clone()).collect();
        (got, happened)
    });
    assert_eq!(got, 2);
    let count = |is: fn(&Happening) -> bool| happened.iter().filter(|what| is(what)).count();
    assert_eq!(count(|what| matches!(what, Happening::Lost { why: Lost::BufferFull, .. })), 1);
    assert_eq!(count(|what| matches!(what, Happening::Arrived { .. })), 3);
}

#[test]
fn links_change_while_it_runs() {
    for bed in beds() {
        bed.run_twice(|bed: Bed| async move {
            let (a, b) = (bed.host("a").bind("0.0.0.0:0").unwrap(), bed.host("b").bind("0.0.0.0:5").unwrap());
            let mut delays = Vec::new();
            for link in ["delay 10ms", "delay 1us", "", "delay 3s"] {
                bed.set_link("a", "b", link);
                let sent = bed.now();
                a.send_to(b"x", "b:5").await.unwrap();
                delays.push((b.recv_from_at(&mut [0; 1]).await.unwrap().2 - sent).as_nanos());
            }
            assert_eq!(delays, [10_000_000, 1_000, 0, 3_000_000_000]);
        });
    }
}

/// Returns how many of `sizes`, sent again and again, a buffer of the default size keeps.
fn kept(address: &'static str, sizes: &'static [usize]) -> Vec<usize> {
    kept_in(212_992, address, sizes)
}

fn kept_in(buffer: usize, address: &'static str, sizes: &'static [usize]) -> Vec<usize> {
    Testbed::new(["a", "b"]).links("delay 1ms").receive_buffer(buffer).seed(1).run(move |bed| async move {
        let any = if address.starts_with('[') { "[::]" } else { "0.0.0.0" };
        let (a, b) = (bed.host("a").bind(format!("{any}:0")).unwrap(), bed.host("b").bind(format!("{any}:5")).unwrap());
        for size in sizes.iter().cycle().take(300) {
            a.send_to(&vec![0; *size], address).await.unwrap();
        }
        time::sleep(DELAY).await;
        let mut counts = vec![0; sizes.len()];
        while let Ok(read) = b.try_recv(&mut [0; 4000]) {
            counts[sizes.iter().position(|size| *size == read).unwrap()] += 1;
        }
        counts
    })
}

/// `__udp_enqueue_schedule_skb`: a datagram is kept if nothing waits, whatever memory it takes. A small datagram takes 832 octets.
#[test]
fn an_empty_buffer_takes_any_datagram() {
    for (buffer, size, count) in [(1, &[1400], 1), (1663, &[10], 1), (1664, &[10], 2)] {
        assert_eq!(kept_in(buffer, "10.0.0.2:5", size), [count], "{buffer}");
    }
}

/// Measured on Linux 6.18 (`SKB_TRUESIZE`).
#[test]
fn a_buffer_counts_the_memory_of_datagrams() {
    for (size, count) in [(&[1], 256), (&[197], 256), (&[198], 166), (&[645], 166), (&[646], 92), (&[1669], 92), (&[1670], 48)] {
        assert_eq!(kept("b:5", size), [count], "{size:?}");
    }
    assert_eq!([kept("[b]:5", &[184]), kept("[b]:5", &[185])], [[256], [166]]);
    assert_eq!(kept("b:5", &[1472, 100]), [68, 67]);
}
