//! Situations in which other implementations have failed, as far as a program notices.

use std::time::Duration;

use cohaptic_testkit::tcp::{CongestionControl, TcpConfig};
use cohaptic_testkit::units::{Probability, Rate};
use cohaptic_testkit::wan::{Bottleneck, Chance, Checksum, Corruption, Delay, Discipline, DualPi2, Flips, LinkConfig};
use cohaptic_testkit::{Bed, Happening, Lost, Testbed, time};
use tokio::io::{AsyncReadExt, AsyncWriteExt};

use crate::tcp::ends::pair;
use crate::tcp::{R, beds, millis, octet, octets, read_all, send_all};

/// Sends `count` octets in both directions at once. Returns the instant at which both hosts have read all octets.
async fn both_ways(bed: Bed, count: usize) -> cohaptic_testkit::Instant {
    let (client, server, _listener) = pair(&bed).await;
    let ends = [("a", client), ("b", server)].map(|(host, stream)| {
        let (mut read, mut write) = stream.into_split();
        let writing = bed.host(host).spawn(async move { send_all(&mut write, count).await });
        (bed.host(host).spawn(async move { read_all(&mut read, count).await }), writing)
    });
    for (reading, writing) in ends {
        reading.await.unwrap();
        writing.await.unwrap();
    }
    bed.now()
}

#[test]
fn every_octet_is_right_over_bad_links() {
    for (seed, words) in
        (0..).zip(["delay 10ms loss 10%", "delay 20ms 5ms loss 1% duplicate 5% reorder 20%", "delay 5ms rate 5mbit limit 10", "delay 3ms corrupt 5%"])
    {
        let bed = Testbed::new(["a", "b"]).links(words).seed(seed);
        let own = bed.clone().run_twice(|bed| both_ways(bed, 200_000));
        assert_eq!(bed.clone().run(|bed| both_ways(bed, 200_000)), own, "nothing looks at the packets, and they are never written");
        assert_eq!(bed.on_tokio().run_twice(|bed| both_ways(bed, 200_000)), own, "both runtimes, to the nanosecond");
    }
}

#[test]
fn the_last_octet_of_100_kilobytes_comes_after_four_round_trips() {
    for bed in [Testbed::new(["a", "b"]).links("delay 100ms"), Testbed::new(["a", "b"]).links("delay 100ms").on_tokio()] {
        let at = bed.run_twice(|bed| async move {
            let listener = bed.host("b").listen("0.0.0.0:80").unwrap();
            drop(bed.host("b").spawn(async move { listener.accept().await.unwrap().0.write_all(&octets(100_000)).await }));
            let mut client = bed.host("a").connect("b:80").await.unwrap();
            client.read_exact(&mut vec![0; 100_000]).await.unwrap();
            bed.now()
        });
        assert_eq!(at, millis(800));
    }
}

#[test]
fn bits_that_a_link_flips_are_found_by_the_checksums() {
    let bits = Flips::Bits { packets: Chance::independent(Probability::new(0.2).unwrap()), count: 1 };
    let flips = LinkConfig { corruption: Some(Corruption { bits, within: None, checksum: Checksum::Passes }), ..LinkConfig::default() };
    Testbed::new(["a", "b"]).link_both("a", "b", flips).seed(3).run_twice(|bed| async move {
        both_ways(bed.clone(), 100_000).await;
        let lost = bed.trace().events().iter().filter(|event| matches!(event.what, Happening::Lost { why: Lost::Checksum, .. })).count();
        assert!(lost > 20, "{lost}");
    });
}

#[test]
fn marks_slow_a_sender_down_that_asks_for_them() {
    let marked = |ecn| {
        let config = TcpConfig { ecn, ..TcpConfig::default() };
        let bed = Testbed::new(["a", "b"]).links("delay 10ms").link("a", "b", "delay 10ms loss 2% ecn").tcp(config).seed(1);
        bed.run_twice(|bed| async move {
            let (mut client, mut server, _listener) = pair(&bed).await;
            let writing = bed.host("a").spawn(async move {
                send_all(&mut client, 500_000).await;
                // The buffer takes much of the data before a mark is reported.
                time::sleep(Duration::from_secs(5)).await;
                client.info()
            });
            read_all(&mut server, 500_000).await;
            (bed.link_stats("a", "b").marked(), writing.await.unwrap().slow_start_threshold < u32::MAX)
        })
    };
    let (with, without) = (marked(true), marked(false));
    assert!(with.0 > 0 && with.1, "{with:?}");
    assert_eq!(without.0, 0);
}

/// The queue of DualPI2 for scalable senders marks what has waited a millisecond, and the sender keeps its round trip at 20 ms and a little more.
#[test]
fn a_scalable_sender_keeps_the_queue_short_and_loses_nothing() {
    let rate = Rate::bits_per_sec(40_000_000).unwrap();
    let bottleneck = Some(Bottleneck { discipline: Discipline::DualPi2(DualPi2::default()), ..Bottleneck::at_rate(rate) });
    let line = LinkConfig { bottleneck, delay: Delay::constant(Duration::from_millis(10)), ..LinkConfig::default() };
    let round_trip = |congestion| {
        let config = TcpConfig { congestion, ..TcpConfig::default() };
        let bed = Testbed::new(["a", "b"]).links("delay 10ms").link("a", "b", line.clone()).tcp(config).seed(1);
        bed.run_twice(|bed| async move {
            let (mut client, mut server, _listener) = pair(&bed).await;
            let writing = bed.host("a").spawn(async move {
                send_all(&mut client, 20_000_000).await;
                client.info()
            });
            read_all(&mut server, 20_000_000).await;
            let (stats, info) = (bed.link_stats("a", "b"), writing.await.unwrap());
            (stats.marked() > 0, info.retransmissions > 0, info.srtt.unwrap())
        })
    };
    let (scalable, classic) = (round_trip(CongestionControl::Dctcp), round_trip(CongestionControl::Cubic));
    assert!(matches!(scalable, (true, false, srtt) if srtt < Duration::from_millis(22)), "{scalable:?}");
    assert!(matches!(classic, (false, true, srtt) if srtt > Duration::from_millis(28)), "{classic:?}");
}

#[test]
fn sequence_numbers_wrap_within_a_stream() {
    let config = TcpConfig { initial_sequence: Some(u32::MAX - 999), ..TcpConfig::default() };
    Testbed::new(["a", "b"]).links("delay 10ms 5ms loss 3%").tcp(config).seed(1).run_twice(|bed| both_ways(bed, 300_000));
}

#[test]
fn small_writes_wait_for_an_answer_unless_the_stream_has_no_delay() {
    for (nodelay, expected) in [(false, vec![1, 9]), (true, vec![1; 10])] {
        for bed in beds() {
            let sizes = bed.run_twice(move |bed| async move {
                let (mut client, mut server, _listener) = pair(&bed).await;
                client.set_nodelay(nodelay).unwrap();
                for _ in 0..10 {
                    client.write_all(b"x").await.unwrap();
                }
                server.read_exact(&mut [0; 10]).await.unwrap();
                assert_eq!(bed.now(), if nodelay { millis(550) } else { millis(650) });
                let trace = bed.trace();
                let octets =
                    trace.events().iter().filter_map(|event| if let Happening::Segment { octets, .. } = event.what { Some(octets) } else { None });
                let octets = octets.filter(|octets| *octets > 0);
                octets.collect::<Vec<_>>()
            });
            assert_eq!(sizes, expected);
        }
    }
}

#[test]
fn a_slow_reader_holds_the_writer_back() {
    let config = TcpConfig { receive_buffer: Some(30_000), send_buffer: 40_000, least_send_buffer: 40_000, ..TcpConfig::default() };
    for bed in beds() {
        bed.tcp(config.clone()).run_twice(|bed| async move {
            let (client, mut server, _listener) = pair(&bed).await;
            let (all, mut written, mut read) = (octets(1_000_000), 0, 0);
            for _ in 0..100 {
                while let Ok(count) = client.try_write(&all[written..]) {
                    written += count;
                }
                assert!(written <= read + 70_000 + 128, "{written} written, {read} read");
                time::sleep(R).await;
                let mut chunk = [0; 3000];
                let count = server.read(&mut chunk).await.unwrap();
                assert!(chunk[..count].iter().zip(read..).all(|(seen, at)| *seen == octet(at)));
                read += count;
            }
            assert!(read >= 290_000, "{read}");
        });
    }
}

#[test]
fn ten_thousand_connections_echo_five_times() {
    Testbed::new(["a", "b"]).links("delay 10ms").run(|bed| async move {
        let listener = bed.host("b").listen("0.0.0.0:80").unwrap();
        let b = bed.host("b");
        drop(bed.host("b").spawn(async move {
            while let Ok((mut stream, _)) = listener.accept().await {
                drop(b.spawn(async move {
                    let mut buffer = [0; 100];
                    while stream.read_exact(&mut buffer).await.is_ok() {
                        stream.write_all(&buffer).await.unwrap();
                    }
                }));
            }
        }));
        let mut clients = Vec::new();
        for start in 0..10_000_u64 {
            clients.push(bed.host("a").spawn(async move {
                time::sleep(Duration::from_micros(100 * start)).await;
                let mut stream = cohaptic_testkit::TcpStream::connect("b:80").await.unwrap();
                for _ in 0..5 {
                    stream.write_all(&[7; 100]).await.unwrap();
                    stream.read_exact(&mut [0; 100]).await.unwrap();
                }
                time::now()
            }));
        }
        for (start, client) in (0..).zip(clients) {
            // A handshake and five questions.
            assert_eq!(client.await.unwrap(), millis(20 * 6) + Duration::from_micros(100 * start));
        }
    });
}
