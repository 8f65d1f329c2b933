//! Sockets do what tokio's do.

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
