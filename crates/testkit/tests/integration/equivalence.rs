//! A program as a state machine and as tasks with sockets sees the same packets at the same nanoseconds.

use std::time::Duration;

use cohaptic_testkit::node::{Node, Nodes, Packet, Transmit, address};
use cohaptic_testkit::units::Ecn;
use cohaptic_testkit::{Instant, Record, Testbed, time};

const COUNT: u32 = 60;
const WAIT: Duration = Duration::from_nanos(77_777_777);

/// Stop and wait: one number at a time, again until it is acknowledged.
struct Sender {
    number: u32,
    deadline: Option<Instant>,
    sends: bool,
}

impl Node for Sender {
    fn handle_packet(&mut self, _now: Instant, packet: Packet) {
        if packet.bytes[..] == self.number.to_be_bytes() {
            self.number += 1;
            self.sends = self.number < COUNT;
            self.deadline = None;
        }
    }

    fn handle_timeout(&mut self, _now: Instant) {
        self.sends = true;
    }

    fn poll_timeout(&mut self) -> Option<Instant> {
        self.deadline
    }

    fn poll_transmit(&mut self, now: Instant) -> Option<Transmit> {
        std::mem::take(&mut self.sends).then(|| {
            self.deadline = Some(now + WAIT);
            Transmit { to: address(1, 7), from_port: 49_152, bytes: self.number.to_be_bytes().to_vec().into(), ecn: Ecn::NotCapable }
        })
    }
}

#[derive(Default)]
struct Echo(Vec<Transmit>);

impl Node for Echo {
    fn handle_packet(&mut self, _now: Instant, packet: Packet) {
        assert_eq!(packet.from, address(0, 49_152));
        self.0.push(packet.answer(packet.bytes.clone()));
    }

    fn poll_transmit(&mut self, _now: Instant) -> Option<Transmit> {
        self.0.pop()
    }
}

fn as_nodes(words: &str, seed: u64) -> Record {
    let nodes = Nodes::new().add("a", Sender { number: 0, deadline: None, sends: true }).add("b", Echo::default());
    let mut run = nodes.links(words).seed(seed).recorded().start();
    run.run_while(|run| run.node::<Sender>("a").number < COUNT);
    run.record()
}

fn as_tasks(words: &str, seed: u64) -> Record {
    let bed = Testbed::new(["a", "b"]).links(words).seed(seed);
    let ((), record) = bed.run_recorded(|bed| async move {
        let echo = bed.host("b").bind("0.0.0.0:7").unwrap();
        bed.host("b").spawn(async move {
            let mut buffer = [0; 4];
            loop {
                let (len, from) = echo.recv_from(&mut buffer).await.unwrap();
                echo.send_to(&buffer[..len], from).await.unwrap();
            }
        });
        let socket = bed.host("a").bind("0.0.0.0:0").unwrap();
        for number in 0..COUNT {
            let mut is_through = false;
            while !is_through {
                socket.send_to(&number.to_be_bytes(), "b:7").await.unwrap();
                let deadline = time::now() + WAIT;
                let mut buffer = [0; 4];
                while let Ok(Ok(_)) = time::timeout(deadline - time::now(), socket.recv(&mut buffer)).await {
                    is_through = buffer == number.to_be_bytes();
                    if is_through {
                        break;
                    }
                }
            }
        }
    });
    record
}

#[test]
fn a_state_machine_and_a_task_see_the_same_packets_at_the_same_nanoseconds() {
    let words = [
        "delay 24ms",
        "delay 20ms 9ms distribution normal loss 20% duplicate 10%",
        "delay 3ms 2ms loss gemodel 5% 30% rate 1mbit limit 20 reorder 20% 50%",
        "delay 1ms 300us distribution pareto corrupt 3%",
    ];
    for (seed, words) in (0..).zip(words) {
        let (nodes, tasks) = (as_nodes(words, seed), as_tasks(words, seed));
        if let Some(difference) = nodes.trace().first_difference(tasks.trace()) {
            panic!("{words}: {difference}");
        }
        assert!(nodes.trace().events().len() >= 4 * COUNT as usize, "{words}");
        assert_eq!(nodes.ended(), tasks.ended());
        for (from, to) in [("a", "b"), ("b", "a")] {
            assert_eq!(nodes.fates(from, to), tasks.fates(from, to));
        }
    }
}
