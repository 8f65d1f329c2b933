//! Figure 7: three users at KT = 2100 N/m.

use std::fmt::Write as _;

use cohaptic_picture::{Axis, Line, Look, Panel, Picture, Size};

use super::Figure;
use crate::case::Strategy;
use crate::experiment::{PeerTrace, StabilityTest};

/// Range of the position \[cm\], a little wider than the paper's ±3 cm. The range of the force \[N\] below is the paper's.
const POSITION_CM: (f64, f64) = (-4.0, 4.0);
const FORCE_N: (f64, f64) = (-6.0, 6.0);

pub(super) fn figure(tests: &[StabilityTest], delay_ms: u32, size: Size) -> Figure {
    let title = format!("Figure 7: three users at KT = 2100 N/m, {delay_ms} ms one way");
    let shown: Vec<&StabilityTest> = [(Strategy::Pd, true), (Strategy::Ap, true), (Strategy::Pd, false), (Strategy::Ap, false)]
        .iter()
        .filter_map(|(strategy, arms)| {
            tests.iter().find(|test| test.strategy == *strategy && test.arms == *arms && test.delay_ms == delay_ms && test.stiffness > 2000.0)
        })
        .collect();
    let mut panels = Vec::new();
    for pair in shown.chunks(2) {
        panels.extend(pair.iter().map(|test| positions(test)));
        panels.extend(pair.iter().map(|test| forces(test)));
    }
    let caption = "Two users move the object at 1 Hz, and nobody touches the third copy. The force is that of the coordination on the copy at the left. Lines end where they leave \
                   the ranges of the paper's axes. The paper's motion is that of people; here arms of 0.3 kg, 10 N·s/m and 100 N/m follow a sine, or forces of 2 N push without \
                   arms."
        .to_owned();
    Figure {
        id: format!("fig-7-{delay_ms}ms"),
        svg: Picture::new(title.as_str()).columns(2).panels(panels).size(size).svg(),
        title,
        caption,
        csv: csv(&shown),
    }
}

fn name(test: &StabilityTest) -> String {
    format!("{} {} arms", test.strategy.word(), if test.arms { "with" } else { "without" })
}

fn time() -> Axis {
    Axis::new("Time").symbol("t").unit("s").range(0.0, 7.0)
}

fn positions(test: &StabilityTest) -> Panel {
    let names = ["left", "right", "untouched"];
    let line = |(place, peer): (usize, &PeerTrace)| {
        let points = test.trace.times.iter().copied().zip(peer.position.iter().map(|x| 100.0 * x));
        Line::new(points, Look::of(place)).named(names.get(place).copied().unwrap_or_default())
    };
    Panel::new(time(), Axis::new("Position").symbol("x_O").unit("cm").range(POSITION_CM.0, POSITION_CM.1))
        .titled(name(test))
        .with_all(test.trace.peers.iter().enumerate().map(line))
}

fn forces(test: &StabilityTest) -> Panel {
    let points = test.trace.times.iter().copied().zip(test.trace.peers[0].force.iter().copied());
    Panel::new(time(), Axis::new("Coordination force").symbol("F_T").unit("N").range(FORCE_N.0, FORCE_N.1))
        .titled(name(test))
        .with(Line::new(points, Look::of(0)).named("left"))
}

fn csv(tests: &[&StabilityTest]) -> String {
    let mut csv = "strategy,arms,delay_ms,t,left,right,untouched,left_coordination_force\n".to_owned();
    for test in tests {
        for (tick, t) in test.trace.times.iter().enumerate() {
            let _ = write!(csv, "{},{},{},{t:.3}", test.strategy.word(), test.arms, test.delay_ms);
            for peer in &test.trace.peers {
                let _ = write!(csv, ",{:.9e}", peer.position.get(tick).copied().unwrap_or(f64::NAN));
            }
            let _ = writeln!(csv, ",{:.9e}", test.trace.peers[0].force.get(tick).copied().unwrap_or(f64::NAN));
        }
    }
    csv
}
