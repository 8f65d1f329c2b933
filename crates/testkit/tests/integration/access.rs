//! Hosts behind access lines of the library of links: the way of packets, hits, losses and their records.

use std::fs;
use std::panic::catch_unwind;
use std::time::Duration;

use cohaptic_testkit::hit::Verdict;
use cohaptic_testkit::node::{Nodes, Transmit};
use cohaptic_testkit::wan::{DropCause, Fate};
use cohaptic_testkit::{Bed, Happening, Instant, Lost, Record, Testbed, UdpSocket, time};

use crate::once::Once;

/// Returns the instant `count` microseconds after the beginning.
const fn us(count: u64) -> Instant {
    Instant::from_nanos(count * 1_000)
}

/// Receives datagrams until none comes for ten seconds. Returns the first byte of each, with the instant of arrival.
async fn drain(socket: &UdpSocket) -> Vec<(Instant, u8)> {
    let mut came = Vec::new();
    let mut buffer = [0; 1500];
    while let Ok(Ok((_, _, at))) = time::timeout(Duration::from_secs(10), socket.recv_from_at(&mut buffer)).await {
        came.push((at, buffer[0]));
    }
    came
}

/// Sends 75 bytes, 800 µs at 750 kbit/s, to each receiver. Returns what has come to each.
async fn one_to_each(bed: Bed, from: &'static str, receivers: [&'static str; 2]) -> [Vec<(Instant, u8)>; 2] {
    let sockets = receivers.map(|host| bed.host(host).bind("0.0.0.0:7").unwrap());
    let sender = bed.host(from).bind("0.0.0.0:0").unwrap();
    for (byte, host) in (0..).zip(receivers) {
        sender.send_to(&[byte; 75], format!("{host}:7")).await.unwrap();
    }
    [drain(&sockets[0]).await, drain(&sockets[1]).await]
}

fn both(bed: Testbed) -> [Testbed; 2] {
    [bed.clone(), bed.on_tokio()]
}

/// Up 750 kbit/s and 75 ms, down 1600 kbit/s and 75 ms; the links between hosts take 10 ms.
#[test]
fn a_packet_passes_the_uplink_the_link_and_the_downlink() {
    let bed =
        Testbed::new(["phone", "server", "tablet"]).access("phone", "devtools/slow-4g").access("tablet", "devtools/slow-4g").links("delay 10ms");
    for bed in both(bed) {
        // Packets to all hosts share the uplink. The second one waits for the first, and passes the downlink of its receiver in 375 µs besides.
        let [server, tablet] = bed.clone().run(|bed| one_to_each(bed, "phone", ["server", "tablet"]));
        assert_eq!((server, tablet), (vec![(us(800 + 75_000 + 10_000), 0)], vec![(us(2 * 800 + 75_000 + 10_000 + 375 + 75_000), 1)]));
        // The server has no access line.
        let [phone, tablet] = bed.run(|bed| one_to_each(bed, "server", ["phone", "tablet"]));
        assert_eq!((phone, tablet), (vec![(us(10_000 + 375 + 75_000), 0)], vec![(us(10_000 + 375 + 75_000), 1)]));
    }
}

/// A law judges a packet of its path alone, whatever else passes the uplink, and a hit changes nothing for other packets of the uplink.
#[test]
fn a_packet_that_is_hit_passes_the_uplink_and_not_the_link() {
    let bed = Testbed::new(["phone", "server", "tablet"]).access("phone", "devtools/slow-4g").links("delay 10ms");
    let plain = bed.clone().run(|bed| one_to_each(bed, "phone", ["server", "tablet"]));
    for bed in both(bed.hit("phone", "server", "drop packet 0")) {
        let (came, record) = bed.clone().run_recorded(|bed| async move {
            let came = one_to_each(bed.clone(), "phone", ["server", "tablet"]).await;
            assert_eq!(bed.access_stats("phone").unwrap().uplink.delivered(), 2);
            let link = bed.link_stats("phone", "server");
            assert_eq!((link.offered(), link.dropped(DropCause::Filter), bed.hits("phone", "server")), (1, 1, 1));
            came
        });
        assert_eq!(came, [vec![], plain[1].clone()]);
        let lost = lost(&record);
        assert_eq!(lost, [(us(75_800), Lost::Link(DropCause::Filter))]);
        // The fates of the whole path repeat the run, without access lines.
        let folder = tempfile::tempdir().unwrap();
        record.write(folder.path().join("kept")).unwrap();
        let links = folder.path().join("kept/links.txt");
        let text = fs::read_to_string(&links).unwrap();
        assert!(text.contains("# all: delay 10ms\n# access of phone: devtools/slow-4g@1\n"), "{text}");
        assert_eq!(Testbed::from_file(&links).run(|bed| one_to_each(bed, "phone", ["server", "tablet"])), came);
    }
}

fn lost(record: &Record) -> Vec<(Instant, Lost)> {
    let lost = |event: &cohaptic_testkit::TraceEvent| if let Happening::Lost { why, .. } = event.what { Some((event.at, why)) } else { None };
    record.trace().events().iter().filter_map(lost).collect()
}

/// All actions but drop happen at the far end of the path, after the downlink.
#[test]
fn every_other_hit_happens_after_the_downlink() {
    let bed = Testbed::new(["server", "phone"]).access("phone", "devtools/slow-4g").links("delay 10ms");
    let came = |words: &str| {
        bed.clone().hit("server", "phone", words).run(|bed| async move {
            let phone = bed.host("phone").bind("0.0.0.0:7").unwrap();
            let server = bed.host("server").bind("0.0.0.0:0").unwrap();
            for byte in 0..2 {
                server.send_to(&[byte; 75], "phone:7").await.unwrap();
            }
            drain(&phone).await
        })
    };
    let (first, second) = (us(85_375), us(85_750));
    assert_eq!(came("delay 3ms packet 0"), [(second, 1), (us(88_375), 0)]);
    assert_eq!(came("duplicate packet 0"), [(first, 0), (first, 0), (second, 1)]);
    assert_eq!(came("behind 1 packet 0"), [(second, 1), (Instant::from_nanos(85_750_001), 0)]);
}

/// Sends 3000 packets of 64 bytes in both directions over 24 s, which is one boundary of 15 s at least.
async fn chatter(bed: Bed) {
    let (phone, server) = (bed.host("phone").bind("0.0.0.0:7").unwrap(), bed.host("server").bind("0.0.0.0:7").unwrap());
    for _ in 0..3000 {
        phone.send_to(&[1; 64], "server:7").await.unwrap();
        server.send_to(&[2; 64], "phone:7").await.unwrap();
        time::sleep(Duration::from_millis(8)).await;
    }
}

/// The trace, the counters, the summary and the capture tell on which part of its path a packet was lost.
#[test]
fn the_part_of_the_path_that_lost_a_packet_is_told() {
    let bed = Testbed::new(["phone", "server"]).access("phone", "starlink").seed(2);
    let (stats, record) = bed.run_recorded(|bed| async move {
        chatter(bed.clone()).await;
        assert_eq!(bed.access_stats("server"), None);
        (bed.access_stats("phone").unwrap(), bed.link_stats("phone", "server"), bed.link_stats("server", "phone"))
    });
    let (access, forth, back) = stats;
    let (up, down) = (access.uplink.dropped(DropCause::Loss), access.downlink.dropped(DropCause::Loss));
    assert!(up > 0 && down > 0, "{up} {down}");
    // The link before the downlink has delivered what the downlink has lost; the link after the uplink was never offered what the uplink has lost.
    assert_eq!((forth.offered(), back.offered(), back.delivered()), (3000 - up - access.uplink.in_flight(), 3000, 3000));
    let told = |why: Lost| lost(&record).iter().filter(|(_, found)| *found == why).count() as u64;
    assert_eq!((told(Lost::Uplink(DropCause::Loss)), told(Lost::Downlink(DropCause::Loss))), (up, down));
    let trace: Vec<String> = record.trace().events().iter().map(|event| record.trace().words(event).to_string()).collect();
    assert!(trace.iter().any(|line| line.contains("phone -> server  packet") && line.ends_with("lost: loss (uplink)")));
    let folder = tempfile::tempdir().unwrap();
    record.write(folder.path()).unwrap();
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    let texts: Vec<String> =
        fs::read_dir(folder.path()).unwrap().map(|entry| String::from_utf8_lossy(&fs::read(entry.unwrap().path()).unwrap()).into_owned()).collect();
    assert!(
        texts.iter().any(|text| text.contains(&format!("{up} lost (loss (uplink))")) && text.contains(&format!("{down} lost (loss (downlink))")))
    );
    let has = |file: &str, comment: &str| read(file).windows(comment.len()).any(|window| window == comment.as_bytes());
    assert!(
        has("packets-phone-to-server.pcapng", "dropped on the uplink: loss")
            && has("packets-server-to-phone.pcapng", "dropped on the downlink: loss")
    );
}

/// Uplink and downlink of one host lose packets at the boundaries of one modulator. Another host has a modulator of its own, with other delays in each 15 s.
#[test]
fn a_host_has_a_modulator_of_its_own_for_both_directions() {
    let delays = |host: &'static str| {
        let bed = Testbed::new(["dish", "other", "server"]).access("dish", "starlink").access("other", "starlink").seed(5);
        let ((), record) = bed.run_recorded(move |bed| async move {
            let (dish, server) = (bed.host(host).bind("0.0.0.0:7").unwrap(), bed.host("server").bind("0.0.0.0:7").unwrap());
            for _ in 0..300 {
                dish.send_to(&[1; 64], "server:7").await.unwrap();
                server.send_to(&[2; 64], format!("{host}:7")).await.unwrap();
                time::sleep(Duration::from_millis(500)).await;
            }
        });
        // The state of each period of 15 s by the mean delay within it, from 0 to 4 in the order of the delays of the profile [ms].
        [(host, "server", [24.296, 27.338, 29.885, 32.862, 38.069]), ("server", host, [16.353, 18.401, 20.115, 22.119, 25.623])].map(
            |(from, to, means)| {
                (0..10_u32)
                    .map(|period| {
                        let within =
                            |at: Instant| at.as_nanos() / 15_000_000_000 == u64::from(period) && at.as_nanos() % 15_000_000_000 > 250_000_000;
                        let fates = record.fates(from, to);
                        let spans: Vec<f64> = fates
                            .records()
                            .iter()
                            .filter(|packet| within(packet.offered))
                            .filter_map(|packet| match packet.fate {
                                Fate::Delivered(at) => Some((at - packet.offered).as_secs_f64() * 1e3),
                                Fate::Dropped(_) | Fate::Duplicated => None,
                            })
                            .collect();
                        let (sum, count) = spans.iter().fold((0.0_f64, 0.0_f64), |(sum, count), span| (sum + span, count + 1.0));
                        let mean = sum / count;
                        (0..5).min_by(|one: &usize, other| (means[*one] - mean).abs().total_cmp(&(means[*other] - mean).abs())).unwrap()
                    })
                    .collect::<Vec<usize>>()
            },
        )
    };
    let ([up, down], [other_up, _]) = (delays("dish"), delays("other"));
    // Of 29 packets in a period the mean has a deviation of 0.7 ms, so that a neighbouring state can be mistaken, and a far one cannot.
    assert!(up.iter().zip(&down).all(|(up, down)| up.abs_diff(*down) <= 1), "{up:?} {down:?}");
    assert!(up.iter().zip(&other_up).any(|(one, other)| one.abs_diff(*other) > 1), "{up:?} {other_up:?}");
}

#[test]
fn nodes_have_access_lines_too() {
    let mut run = Nodes::new()
        .add("phone", Once::sending(Transmit::to(1, [0; 75].to_vec())))
        .add("server", Once::default())
        .access("phone", "devtools/slow-4g")
        .start();
    run.run_until_idle();
    assert_eq!(run.node::<Once>("server").came, Some(us(75_800)));
    assert_eq!(run.access_stats("phone").unwrap().uplink.delivered(), 1);
}

#[test]
fn what_is_no_access_fails_the_test() {
    let message = |host: &'static str, link: &'static str| {
        let panic = catch_unwind(|| drop(Testbed::new(["phone", "server"]).access(host, link))).unwrap_err();
        panic.downcast_ref::<String>().unwrap().clone()
    };
    assert_eq!(
        message("phone", "starlink/up"),
        "`starlink/up` cannot be the access line of host `phone`: an access line has both directions: expected the name without a direction, starlink@1"
    );
    assert!(message("phone", "starlnk").contains("no link of the library is called \"starlnk\": expected"));
    assert!(message("laptop", "starlink").contains("there is no host `laptop`"));
}

/// A law that is a function sees the packets of its path, numbered from 0, also those that the uplink loses.
#[test]
fn laws_see_every_packet_that_is_sent() {
    let mut next = 0;
    let bed = Testbed::new(["phone", "server"]).access("phone", "starlink").seed(2).on_packet("phone", "server", move |packet| {
        assert_eq!(packet.number, next);
        next += 1;
        Verdict::Pass
    });
    bed.run(|bed| async move {
        chatter(bed.clone()).await;
        assert!(bed.access_stats("phone").unwrap().uplink.dropped(DropCause::Loss) > 0);
    });
}
