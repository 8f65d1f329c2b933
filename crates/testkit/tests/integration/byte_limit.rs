//! Limit of the bytes in flight and unread: a run beyond the limit ends and names the sender. Bytes that were read or lost no longer count.

use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use cohaptic_testkit::node::{Node, Nodes, Packet, Transmit};
use cohaptic_testkit::{Bed, Instant, Testbed, time};

const LIMIT: u64 = 1 << 20;

/// Returns the message of a run that reaches its limit.
fn complaint(act: impl FnOnce()) -> String {
    *catch_unwind(AssertUnwindSafe(act)).expect_err("it gives up").downcast::<String>().expect("the message has numbers")
}

fn says(way: &str, text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "{way}: no {part:?} in {text:?}");
    }
}

/// Sends datagrams without end, which pile up. `way` names the place where they wait, and the program of host `a`.
async fn piles_up(bed: Bed, way: &'static str) {
    let socket = bed.host("a").bind("0.0.0.0:0").unwrap();
    let _unread = [bed.host("a").bind("0.0.0.0:7").unwrap(), bed.host("b").bind("0.0.0.0:7").unwrap()];
    socket.set_broadcast(true).unwrap();
    let (to, len) = match way {
        "without a byte" => ("b:7", 0),
        "to itself" => ("10.0.0.1:7", 1000),
        "to all" => ("255.255.255.255:7", 1000),
        _ => ("b:7", 1000),
    };
    loop {
        socket.send_to(&vec![0; len], to).await.unwrap();
        if way == "while time passes" {
            time::sleep(Duration::from_millis(1)).await;
        }
    }
}

#[test]
fn datagrams_that_pile_up_are_named_with_host_socket_and_task() {
    let ways = [
        ("on a long link", "delay 1000s"),
        ("without a byte", "delay 1000s"),
        ("while time passes", "delay 1000s"),
        ("before a slow link", "rate 8bit"),
        ("unread", ""),
        ("to itself", ""),
        ("to all", "delay 1000s"),
    ];
    for (way, link) in ways {
        for bed in [Testbed::new(["a", "b", "c"]), Testbed::new(["a", "b", "c"]).on_tokio()] {
            let bed = bed.links(link).receive_buffer(usize::MAX).byte_limit(LIMIT);
            let text = complaint(|| {
                bed.run(|bed| async move {
                    let task = bed.host("a").spawn(piles_up(bed.clone(), way));
                    task.await.unwrap();
                });
            });
            let places = match way {
                "unread" | "to itself" => " 0 bytes are on links, ",
                "to all" => " in buffers of sockets and 0 in streams",
                _ => " bytes are on links, 0 in buffers of sockets and 0 in streams",
            };
            let parts = [
                places,
                "too many bytes are under way after a send of the UDP socket 0.0.0.0:49152 of host `a`, used by the task of host `a` that was spawned at ",
                "byte_limit.rs:",
                "and its limit is 1048576 bytes. ",
                "`byte_limit` of the test bed sets another limit",
            ];
            says(way, &text, &parts);
        }
    }
}

/// Opens connections without end, which nobody reads, and writes to each as much as it takes.
async fn fills_streams(bed: Bed) {
    let _listener = bed.host("b").listen("0.0.0.0:80").unwrap();
    let mut streams = Vec::new();
    loop {
        let stream = bed.host("a").connect("b:80").await.unwrap();
        loop {
            match stream.try_write(&[0; 10_000]) {
                Ok(_) => time::sleep(Duration::from_millis(10)).await,
                Err(error) => break assert_eq!(error.kind(), io::ErrorKind::WouldBlock),
            }
        }
        streams.push(stream);
    }
}

#[test]
fn streams_that_nobody_reads_are_named() {
    let text = complaint(|| {
        Testbed::new(["a", "b"]).byte_limit(LIMIT).run(|bed| async move {
            let task = bed.host("a").spawn(fills_streams(bed.clone()));
            task.await.unwrap();
        });
    });
    says(
        "streams",
        &text,
        // Each stream holds what its buffers take, so that the limit is reached after some streams.
        &["the TCP socket 10.0.0.1:4915", " to 10.0.0.2:80 of host `a`, used by the task of host `a` that was spawned at", "in streams"],
    );
}

/// Node that sends without end to the node with this number, which may be the node itself.
struct Floods(u16);

impl Node for Floods {
    fn handle_packet(&mut self, _now: Instant, _packet: Packet) {}

    fn poll_transmit(&mut self, _now: Instant) -> Option<Transmit> {
        Some(Transmit::to(self.0.into(), vec![0; 1000]))
    }
}

/// Node that receives packets and sends nothing.
struct Quiet;

impl Node for Quiet {
    fn handle_packet(&mut self, _now: Instant, _packet: Packet) {}

    fn poll_transmit(&mut self, _now: Instant) -> Option<Transmit> {
        None
    }
}

#[test]
fn a_node_that_floods_is_named() {
    for to in [0, 1] {
        let nodes = Nodes::new().add("quiet", Quiet).add("floods", Floods(to)).byte_limit(LIMIT);
        let text = complaint(|| drop(nodes.links("delay 1000s").start()));
        says("nodes", &text, &["too many bytes are under way after a send of node `floods`: ", "its limit is 1048576 bytes. "]);
    }
}

/// Node that sends a packet to the first node each millisecond.
struct Ticks {
    next: Instant,
    is_due: bool,
}

impl Node for Ticks {
    fn handle_packet(&mut self, _now: Instant, _packet: Packet) {}

    fn poll_transmit(&mut self, _now: Instant) -> Option<Transmit> {
        std::mem::take(&mut self.is_due).then(|| Transmit::to(0, vec![0; 1000]))
    }

    fn poll_timeout(&mut self) -> Option<Instant> {
        Some(self.next)
    }

    fn handle_timeout(&mut self, now: Instant) {
        (self.next, self.is_due) = (now + Duration::from_millis(1), true);
    }
}

#[test]
fn packets_for_a_node_that_is_down_or_cut_off_count_no_more() {
    let nodes = Nodes::new().add("quiet", Quiet).add("ticks", Ticks { next: Instant::ZERO, is_due: false }).byte_limit(20_000);
    let mut run = nodes.links("delay 5ms").start();
    let _: Quiet = run.crash("quiet");
    run.run_until(Instant::from_nanos(100_000_000));
    run.restart("quiet", Quiet);
    for turn in 11..30 {
        run.cut("ticks", "quiet");
        run.run_until(Instant::from_nanos(turn * 10_000_000 - 5_000_000));
        run.mend("ticks", "quiet");
        run.run_until(Instant::from_nanos(turn * 10_000_000));
    }
    let lost = run.counts("quiet").while_down + run.counts("ticks").cut;
    assert!(lost > 150, "{lost} packets were lost");
}

/// Fifty times as many bytes as the limit pass over links that lose, copy, damage and hold packets; some sockets are closed and hosts crash with packets unread.
#[test]
fn what_was_read_or_lost_counts_no_more() {
    let words = [
        "",
        "delay 20ms 9ms loss 30%",
        "delay 5ms duplicate 50%",
        "corrupt 40%",
        "delay 20ms reorder 30%",
        "rate 100kbit limit 3",
        "delay 1ms loss 50% ecn",
        "loss 100%",
    ];
    // The smaller buffer has room for one datagram, and further datagrams are lost there.
    for (link, room) in words.into_iter().flat_map(|link| [(link, 1 << 20), (link, 2500)]) {
        Testbed::new(["a", "b"])
            .links(link)
            .receive_buffer(room)
            .byte_limit(20_000)
            .hit("a", "b", "behind 1 packet 5; duplicate packet 9")
            .seed(3)
            .run(|bed| async move {
                let client = bed.host("a").bind("0.0.0.0:0").unwrap();
                let mut server = bed.host("b").bind("0.0.0.0:7").unwrap();
                for turn in 0..1000 {
                    client.send_to(&[0; 800], "b:7").await.unwrap();
                    // No socket is bound to this port, and the host sends an answer.
                    client.send_to(&[0; 8], "b:9").await.unwrap();
                    // A cut loses the packets under way at the far end of the link.
                    let is_cut = turn % 10 == 5;
                    if is_cut {
                        bed.cut("a", "b");
                    }
                    time::sleep(Duration::from_millis(100)).await;
                    if is_cut {
                        bed.mend_all();
                    }
                    match turn % 100 {
                        97 => {
                            drop(server);
                            server = bed.host("b").bind("0.0.0.0:7").unwrap();
                        }
                        98 => {
                            bed.host("b").crash();
                            bed.host("b").restart();
                            drop(server);
                            server = bed.host("b").bind("0.0.0.0:7").unwrap();
                        }
                        99 => bed.cut("a", "b"),
                        0 => bed.mend_all(),
                        // Unread for some turns.
                        1..4 => {}
                        _ => while server.try_recv(&mut [0; 800]).is_ok() {},
                    }
                }
            });
    }
}

#[test]
fn streams_that_are_over_count_no_more() {
    Testbed::new(["a", "b"]).links("delay 5ms 2ms loss 2%").byte_limit(1 << 20).seed(5).run(|bed| async move {
        let listener = bed.host("b").listen("0.0.0.0:80").unwrap();
        for turn in 0..40 {
            let client = bed.host("a").connect("b:80").await.unwrap();
            let (server, _) = listener.accept().await.unwrap();
            let (mut written, mut read) = (0, 0);
            while read < 200_000 {
                if written < 200_000 {
                    written += client.try_write(&vec![0; 200_000 - written]).unwrap_or(0);
                }
                // The client may have room again before anything more comes.
                let _ = time::timeout(Duration::from_millis(20), server.readable()).await;
                read += server.try_read(&mut [0; 50_000]).unwrap_or(0);
                // Some are dropped with octets unread and on their way, or die with their host.
                if read > 100_000 && turn % 4 > 1 {
                    break;
                }
            }
            if turn % 4 == 3 {
                bed.host("a").crash();
                bed.host("a").restart();
            }
        }
    });
}

#[test]
fn values_that_are_dropped_while_a_run_fails_may_send() {
    struct Sends(cohaptic_testkit::UdpSocket);
    impl Drop for Sends {
        fn drop(&mut self) {
            self.0.try_send_to(&[0; 1000], "10.0.0.2:7".parse().unwrap()).unwrap();
        }
    }
    let text = complaint(|| {
        Testbed::new(["a", "b"]).links("delay 1000s").byte_limit(LIMIT).run(|bed| async move {
            let sends = Sends(bed.host("a").bind("0.0.0.0:0").unwrap());
            loop {
                sends.0.send_to(&[0; 1000], "b:7").await.unwrap();
            }
        });
    });
    says("dropped", &text, &["too many bytes are under way"]);
}

/// A test bed without a configured limit has a limit of one gibibyte.
#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn a_gibibyte_is_the_limit_that_is_not_said() {
    let text = complaint(|| {
        Testbed::new(["a", "b"]).links("delay 1000s").run(|bed| async move {
            let socket = bed.host("a").bind("0.0.0.0:0").unwrap();
            loop {
                socket.send_to(&[0; 60_000], "b:7").await.unwrap();
            }
        });
    });
    says("not said", &text, &["its limit is 1073741824 bytes. "]);
}
