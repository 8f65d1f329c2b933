//! UDP sockets of the test bed behave as those of tokio.

use std::time::Duration;

use cohaptic_testkit::{Testbed, time};

fn pair() -> Testbed {
    Testbed::new(["a", "b"])
}

#[test]
fn a_datagram_arrives_when_its_link_lets_it_go() {
    for bed in [pair().links("delay 1234567ns"), pair().links("delay 1234567ns").on_tokio()] {
        let at = bed.run_twice(|bed| async move {
            let (a, b) = (bed.host("a").bind("0.0.0.0:0").unwrap(), bed.host("b").bind("0.0.0.0:5").unwrap());
            let receiver = bed.host("b").spawn(async move { b.recv_from_at(&mut [0; 10]).await.unwrap() });
            time::sleep(Duration::from_nanos(10_000_001)).await;
            assert_eq!(a.send_to(b"hello", "b:5").await.unwrap(), 5);
            let (len, from, at) = receiver.await.unwrap();
            assert_eq!((len, from), (5, a.local_addr().map(|_| "10.0.0.1:49152".parse().unwrap()).unwrap()));
            assert_eq!(bed.now(), at);
            at
        });
        assert_eq!(at.as_nanos(), 11_234_568);
    }
}

#[test]
fn tokios_own_timers_are_rounded_up_and_packets_are_not() {
    let (slept, arrived) = pair().links("delay 1300us").on_tokio().run(|bed| async move {
        let (a, b) = (bed.host("a").bind("0.0.0.0:0").unwrap(), bed.host("b").bind("0.0.0.0:5").unwrap());
        let begin = tokio::time::Instant::now();
        a.send_to(b"x", "b:5").await.unwrap();
        let other = tokio::spawn(async move {
            b.recv(&mut [0; 1]).await.unwrap();
            let arrived = begin.elapsed();
            b.send_to(b"y", "a:49152").await.unwrap();
            arrived
        });
        tokio::time::sleep(Duration::from_micros(1500)).await;
        let slept = begin.elapsed();
        a.recv(&mut [0; 1]).await.unwrap();
        assert_eq!(begin.elapsed(), Duration::from_micros(2600));
        tokio::time::sleep(Duration::from_secs(3600)).await;
        assert_eq!(begin.elapsed(), Duration::from_millis(3_600_003));
        (slept, other.await.unwrap())
    });
    assert_eq!((slept, arrived), (Duration::from_millis(2), Duration::from_micros(1300)));
}

#[test]
fn what_may_be_marked_is_not_dropped() {
    let heard = pair().links("delay 1ms loss 100% ecn").run_twice(|bed| async move {
        let (a, b) = (bed.host("a").bind("0.0.0.0:0").unwrap(), bed.host("b").bind("0.0.0.0:5").unwrap());
        a.send_to(b"dropped", "b:5").await.unwrap();
        a.set_tos_v4(0b10).unwrap();
        a.send_to(b"marked", "b:5").await.unwrap();
        let mut buffer = [0; 10];
        let len = b.recv(&mut buffer).await.unwrap();
        assert_eq!(bed.link_stats("a", "b").marked(), 1);
        buffer[..len].to_vec()
    });
    assert_eq!(heard, b"marked");
}

#[test]
fn bits_that_the_link_flips_are_flipped_in_what_arrives() {
    use cohaptic_testkit::wan::{Chance, Checksum, Corruption, Flips, LinkConfig};
    let bits = Flips::Bits { packets: Chance::independent(cohaptic_testkit::units::Probability::ONE), count: 3 };
    let corruption = |checksum| LinkConfig { corruption: Some(Corruption { bits, within: None, checksum }), ..LinkConfig::default() };
    let flipped = pair().link("a", "b", corruption(Checksum::Passes)).run_twice(|bed| async move {
        let (a, b) = (bed.host("a").bind("0.0.0.0:0").unwrap(), bed.host("b").bind("0.0.0.0:5").unwrap());
        a.send_to(&[0; 100], "b:5").await.unwrap();
        let mut buffer = [0; 100];
        assert_eq!(b.recv(&mut buffer).await.unwrap(), 100);
        buffer.iter().map(|byte| byte.count_ones()).sum::<u32>()
    });
    assert_eq!(flipped, 3);
}

#[test]
fn a_broadcast_reaches_all_and_only_with_leave() {
    let bed = Testbed::new(["a", "b", "c"]).link("a", "c", "delay 5ms");
    bed.run_twice(|bed| async move {
        let sockets: Vec<_> = bed.hosts().iter().map(|host| host.bind("0.0.0.0:5").unwrap()).collect();
        let refused = sockets[0].send_to(b"all", "255.255.255.255:5").await.unwrap_err();
        assert_eq!(refused.kind(), std::io::ErrorKind::PermissionDenied);
        sockets[0].set_broadcast(true).unwrap();
        sockets[0].send_to(b"all", "255.255.255.255:5").await.unwrap();
        assert_eq!(sockets[1].recv_from_at(&mut [0; 3]).await.unwrap(), (3, "10.0.0.1:5".parse().unwrap(), bed.now()));
        sockets[2].recv(&mut [0; 3]).await.unwrap();
        assert_eq!(bed.now().as_nanos(), 5_000_000);
        assert_eq!(sockets[0].try_recv(&mut [0; 3]).unwrap(), 3);
    });
}

#[test]
fn what_is_on_its_way_at_the_end_stays_there() {
    for bed in [pair().links("delay 1us"), pair().links("delay 1us").on_tokio()] {
        bed.run_twice(|bed| async move {
            let a = bed.host("a").bind("0.0.0.0:0").unwrap();
            // The machine takes longer than a microsecond to end the run; that time does not count.
            a.send_to(b"never arrives", "b:5").await.unwrap();
            drop(bed.spawn(async move { a.recv(&mut [0; 1]).await }));
        });
    }
}
