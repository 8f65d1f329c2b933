//! Memory and time of a test bed grow with its hosts and with pairs that talk, not with all pairs.

use std::process::{Command, Stdio};
use std::time::Duration;

use cohaptic_testkit::{ARTEFACTS_VARIABLE, SEED_VARIABLE, Testbed, time};

const CHILD: &str = "COHAPTIC_TESTKIT_CHILD_HAS_MANY_HOSTS";

const HOSTS: usize = 10_000;

/// Most memory of the child \[kibibyte\]: 6.7 kB for each host, where 3.9 were measured. A link for each pair took 6.4 GB, and a mark for each pair that says
/// whether its way is cut 100 MB.
const MOST: u64 = 64 << 10;

/// Each host sends to the next, by name, and answers the one before; some ways are cut, and some links are changed.
#[test]
fn ten_thousand_hosts_in_a_child_of_this_process_only() {
    if std::env::var_os(CHILD).is_none() {
        return;
    }
    let bed = Testbed::new((0..HOSTS).map(|host| format!("host-{host}"))).links("delay 3ms 1ms").link("host-0", "host-1", "delay 20ms rate 1mbit");
    bed.run(|bed| async move {
        bed.cut("host-7", "host-8");
        bed.set_link("host-8", "host-9", "delay 1ms duplicate 100%");
        for (place, host) in bed.hosts().into_iter().enumerate() {
            let next = format!("host-{}:7", (place + 1) % HOSTS);
            let socket = host.bind("0.0.0.0:7").unwrap();
            host.spawn(async move {
                socket.send_to(&[0; 100], next).await.unwrap();
                time::timeout(Duration::from_secs(1), socket.recv(&mut [0; 100])).await.is_ok()
            });
        }
        time::sleep(Duration::from_secs(2)).await;
        let arrived = (0..HOSTS).filter(|host| bed.link_stats(&format!("host-{host}"), &format!("host-{}", (host + 1) % HOSTS)).delivered() > 0);
        // A cut packet has left its link.
        assert_eq!(arrived.count(), HOSTS - 1);
        assert_eq!(bed.link_stats("host-8", "host-9").delivered(), 2);
        bed.mend_all();
    });
    // The system counts what this process held at most, on Linux alone.
    let Ok(status) = std::fs::read_to_string("/proc/self/status") else { return };
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
    let peak: u64 = peak.trim().strip_suffix(" kB").unwrap().parse().unwrap();
    assert!(peak <= MOST, "{peak} kB");
}

#[test]
fn ten_thousand_hosts_that_talk_in_a_ring_take_7_kb_each() {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", "many_hosts::ten_thousand_hosts_in_a_child_of_this_process_only", "--nocapture"]).env(CHILD, "1");
    let output = command.env_remove(ARTEFACTS_VARIABLE).env_remove(SEED_VARIABLE).stdout(Stdio::piped()).stderr(Stdio::piped()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
