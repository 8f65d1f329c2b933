//! Exchanges allocate no memory.

use cohaptic_falcon::driver::DriverConfig;
use cohaptic_falcon::simulator::Faults;

use crate::common::{Bench, running, seconds};

#[test]
fn ten_thousand_exchanges_allocate_nothing() {
    let mut bench = Bench::active(running(), [0.02, 0.01, 0.01], 1.0, DriverConfig::DEFAULT);
    // With garbage, fragments and lost packets, because the paths of errors must not allocate either.
    bench.simulator.with(|device| {
        device.set_faults(Faults { garble_to_host: 0.002, drop_to_host: 0.002, insert_to_host: 0.002, fragment: 0.05, ..Faults::NONE });
    });
    let mut exchanged = 0;
    let counted = allocation_counter::measure(|| {
        bench.run(seconds(10.0), |_, status| Some(status.reading.map_or([0.0; 3], |reading| reading.position.map(|part| -300.0 * part)))).unwrap();
        exchanged = bench.driver.statistics().exchanges;
    });
    assert!(exchanged > 9000, "{exchanged}");
    // The simulator runs within the same calls, and does not allocate either.
    assert_eq!(counted.count_total, 0, "{counted:?}");
    // Check of the counter itself.
    assert!(allocation_counter::measure(|| drop(core::hint::black_box(vec![1_u8; 10]))).count_total > 0);
}
