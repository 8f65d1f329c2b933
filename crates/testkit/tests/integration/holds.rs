//! Paths on hold.

use std::time::Duration;

use cohaptic_testkit::{Happening, Instant, Testbed, time};

const fn millis(milliseconds: u64) -> Instant {
    Instant::from_nanos(milliseconds * 1_000_000)
}

#[test]
fn packets_wait_at_the_end_of_a_link_on_hold() {
    let bed = Testbed::new(["a", "b"]).links("delay 10ms").traced();
    for bed in [bed.clone(), bed.on_tokio()] {
        bed.run_twice(|bed| async move {
            let [a, b] = ["a", "b"].map(|name| bed.host(name).bind("0.0.0.0:5").unwrap());
            // The first is under way when the hold begins, the second is sent during the hold, the third after it.
            a.send_to(b"1", "b:5").await.unwrap();
            time::sleep_until(millis(5)).await;
            bed.hold("a", "b");
            bed.hold("a", "b");
            a.send_to(b"2", "b:5").await.unwrap();
            time::sleep_until(millis(40)).await;
            assert!(b.try_recv_from(&mut [0]).is_err());
            // The way back is as before.
            b.send_to(b"4", "a:5").await.unwrap();
            assert_eq!((a.recv(&mut [0]).await.unwrap(), bed.now()), (1, millis(50)));
            bed.release("a", "b");
            bed.release("a", "b");
            a.send_to(b"3", "b:5").await.unwrap();
            let mut heard = Vec::new();
            for _ in 0..3 {
                let mut letter = [0];
                let (_, _, at) = b.recv_from_at(&mut letter).await.unwrap();
                heard.push((letter[0], at));
            }
            assert_eq!(heard, [(b'1', millis(50)), (b'2', millis(50)), (b'3', millis(60))]);
            let trace = bed.trace();
            let words: Vec<String> = trace.events().iter().map(|event| trace.words(event).to_string()).collect();
            for expected in ["0.005 s  a -> b on hold", "0.05 s  a -> b released", "0.05 s  a -> b  packet 1 arrived"] {
                assert!(words.iter().any(|words| words == expected), "{expected}: {words:#?}");
            }
            assert_eq!(trace.events().iter().filter(|event| matches!(event.what, Happening::Held(_) | Happening::Released(_))).count(), 2);
        });
    }
}

#[test]
fn a_cut_or_a_crash_during_the_hold_loses_what_waits() {
    Testbed::new(["a", "b"]).run(|bed| async move {
        let [a, b] = ["a", "b"].map(|name| bed.host(name).bind("0.0.0.0:5").unwrap());
        bed.hold("a", "b");
        a.send_to(b"1", "b:5").await.unwrap();
        bed.cut("a", "b");
        bed.release("a", "b");
        bed.mend_all();
        assert!(time::timeout(Duration::from_secs(1), b.recv(&mut [0])).await.is_err());
        bed.hold("a", "b");
        a.send_to(b"1", "b:5").await.unwrap();
        bed.host("b").crash();
        bed.host("b").restart();
        let b = bed.host("b").bind("0.0.0.0:6").unwrap();
        bed.release("a", "b");
        assert!(time::timeout(Duration::from_secs(1), b.recv(&mut [0])).await.is_err());
    });
}

#[cfg(feature = "tcp")]
#[test]
fn a_stream_goes_on_after_the_hold() {
    use tokio::io::{AsyncReadExt, AsyncWriteExt};

    Testbed::new(["a", "b"]).links("delay 10ms").run(|bed| async move {
        let listener = bed.host("b").listen("0.0.0.0:80").unwrap();
        let mut a = bed.host("a").connect("b:80").await.unwrap();
        let mut b = listener.accept().await.unwrap().0;
        bed.hold("a", "b");
        a.write_all(&[7; 10_000]).await.unwrap();
        time::sleep(Duration::from_secs(5)).await;
        assert!(a.info().retransmissions > 0);
        bed.release("a", "b");
        let released = bed.now();
        b.read_exact(&mut [0; 10_000]).await.unwrap();
        assert_eq!(bed.now(), released);
    });
}

#[test]
fn a_hold_before_a_nat_lets_packets_go_on_when_it_ends() {
    Testbed::new(["laptop", "server"]).nat("router", "home", ["laptop"]).link("router", "server", "delay 20ms").run(|bed| async move {
        let server = bed.host("server").bind("0.0.0.0:7").unwrap();
        let laptop = bed.host("laptop").bind("0.0.0.0:0").unwrap();
        bed.hold("laptop", "router");
        laptop.send_to(b"?", "server:7").await.unwrap();
        time::sleep_until(millis(100)).await;
        bed.release("laptop", "router");
        server.recv(&mut [0]).await.unwrap();
        assert_eq!(bed.now(), millis(120));
    });
}
