//! What the commands say in words.

use cohaptic_falcon::kinematics::Triple;

use super::document::{Forces, Seen, Traffic};

pub(super) fn traffic(traffic: &Traffic) -> [String; 2] {
    let Traffic { seconds, exchanges, reports_per_s, timeouts, garbage_bytes, faults, implausible, late_turns, worst_late_us, .. } = traffic;
    [
        format!(
            "{exchanges} exchanges in {seconds:.2} s, {reports_per_s:.0} reports a second; {late_turns} turns were late, by {worst_late_us:.0} µs at most"
        ),
        format!("{timeouts} time-outs, {garbage_bytes} bytes of garbage, {faults} failed transfers, {implausible} reports that cannot be"),
    ]
}

pub(super) fn seen(seen: &Seen) -> [String; 2] {
    let homed = seen.homed.map(|homed| if homed { "homed" } else { "not homed" });
    let encoder = |place: usize| format!("{} ({})", seen.encoders[place], homed[place]);
    let buttons = if seen.buttons.is_empty() { "none".to_owned() } else { seen.buttons.join(", ") };
    [
        format!("encoders: top {}, right {}, left {}", encoder(0), encoder(1), encoder(2)),
        format!("buttons pressed: {buttons}; phase {}, light {}", seen.phase, seen.light),
    ]
}

pub(super) fn forces(forces: &Forces) -> String {
    let Forces { limit_n, largest_n, limited, slewed, saturated, zeroed } = forces;
    let zeroed: Vec<String> = zeroed.iter().map(|(cause, count)| format!("{count} {cause}")).collect();
    let zeroed = if zeroed.is_empty() { "none".to_owned() } else { zeroed.join(", ") };
    format!("force up to {largest_n:.3} N, limit {limit_n} N; {limited} limited, {slewed} slewed, {saturated} saturated; became zero: {zeroed}")
}

/// `x 1.2 mm, y -3.0 mm, z 45.6 mm`.
pub(super) fn place(position: Triple) -> String {
    let [x, y, z] = position.map(|part| 1e3 * part);
    format!("x {x:.1} mm, y {y:.1} mm, z {z:.1} mm")
}

/// Lines below a title.
pub(super) fn block(title: &str, lines: &[String]) -> String {
    let mut text = format!("{title}\n");
    for line in lines {
        text.push_str("  ");
        text.push_str(line);
        text.push('\n');
    }
    text
}

/// The length of a vector.
pub(super) fn length(vector: Triple) -> f64 {
    let [x, y, z] = vector;
    x.hypot(y).hypot(z)
}
