//! Figure 8: the object pushed with 1.5 N.

use std::fmt::Write as _;

use cohaptic_picture::{Axis, Line, Look, Panel, Picture, Size};

use super::Figure;
use crate::case::Strategy;
use crate::experiment::{DISTANCE, PeerTrace, Travel};

pub(super) fn figure(travels: &[Travel], delay_ms: u32, size: Size) -> Figure {
    let title = format!("Figure 8: pushed with 1.5 N, KT = 1000 N/m, {delay_ms} ms one way");
    let find = |strategy| travels.iter().find(|travel| travel.strategy == strategy && travel.delay_ms == delay_ms);
    // PD stands to the left, as in the paper.
    let shown: Vec<&Travel> = [Strategy::Pd, Strategy::Ap].into_iter().filter_map(find).collect();
    let mut panels = Vec::new();
    for quantity in &QUANTITIES {
        panels.extend(shown.iter().map(|travel| panel(travel, quantity)));
    }
    let caption = "The grey line is where the object has moved 20 mm. Where the loop is stable the velocity saturates, sooner with PD: both objects feel viscous, that of PD more so. A push from rest moves \
                   the two untouched copies alike, so it does not show how they swing against each other."
        .to_owned();
    Figure {
        id: format!("fig-8-{delay_ms}ms"),
        svg: Picture::new(title.as_str()).columns(2).panels(panels).size(size).svg(),
        title,
        caption,
        csv: csv(&shown),
    }
}

/// Length of the drawn part of the scene, a little longer than in the paper \[s\].
const SHOWN: f64 = 3.0;

/// A quantity over time: axis (name, symbol, unit), range, access to the values of a trace, and factor to the unit of the axis.
struct Quantity {
    axis: (&'static str, &'static str, &'static str),
    range: (f64, f64),
    values: fn(&PeerTrace) -> &[f64],
    scale: f64,
    /// `true` if the quantity is the position, whose panel shows the distance of 20 mm.
    is_position: bool,
}

const QUANTITIES: [Quantity; 3] = [
    Quantity { axis: ("Position", "x_O", "cm"), range: (0.0, 5.0), values: |peer| &peer.position, scale: 100.0, is_position: true },
    Quantity { axis: ("Velocity", "v_O", "cm/s"), range: (-4.0, 2.0), values: |peer| &peer.velocity, scale: 100.0, is_position: false },
    Quantity { axis: ("Coordination force", "F_T", "N"), range: (-4.0, 4.0), values: |peer| &peer.force, scale: 1.0, is_position: false },
];

fn panel(travel: &Travel, quantity: &Quantity) -> Panel {
    let line = |(place, peer): (usize, &PeerTrace)| {
        let values = (quantity.values)(peer).iter().map(|value| quantity.scale * value);
        let points = travel.trace.times.iter().copied().zip(values).take_while(|(t, _)| *t <= SHOWN);
        Line::new(points, Look::of(place)).named(format!("copy {}", place + 1))
    };
    let ((name, symbol, unit), (low, high)) = (quantity.axis, quantity.range);
    let time = Axis::new("Time").symbol("t").unit("s").range(0.0, SHOWN);
    let mut panel = Panel::new(time, Axis::new(name).symbol(symbol).unit(unit).range(low, high))
        .titled(travel.strategy.word())
        .with_all(travel.trace.peers.iter().enumerate().map(line));
    if quantity.is_position {
        // The push moves the object towards negative positions.
        let goal = 100.0 * (travel.trace.peers[0].position.first().copied().unwrap_or(0.0) - DISTANCE);
        panel = panel.with(Line::level(goal).named("20 mm"));
        if let Some(time) = travel.time {
            // The upright line ends at the goal, where the copy has moved 20 mm.
            panel = panel.with(Line::new([(time, low), (time, goal)], Look::reference()));
        }
    }
    panel
}

fn csv(travels: &[&Travel]) -> String {
    let mut csv = "strategy,delay_ms,t,peer,position,velocity,coordination_force\n".to_owned();
    for travel in travels {
        for (tick, t) in travel.trace.times.iter().enumerate() {
            for (place, peer) in travel.trace.peers.iter().enumerate() {
                let at = |values: &[f64]| values.get(tick).copied().unwrap_or(f64::NAN);
                let (x, v, f) = (at(&peer.position), at(&peer.velocity), at(&peer.force));
                let _ = writeln!(csv, "{},{},{t:.3},{},{x:.9e},{v:.9e},{f:.9e}", travel.strategy.word(), travel.delay_ms, place + 1);
            }
        }
    }
    csv
}
