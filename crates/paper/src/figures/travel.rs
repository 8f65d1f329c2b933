//! Figure 8: the object pushed with 1.5 N.

use std::fmt::Write as _;

use cohaptic_picture::{Axis, Line, Look, Panel, Picture, Size};

use super::{Figure, Table};
use crate::case::Strategy;
use crate::experiment::{DISTANCE, PeerTrace, Travel};
use crate::page::seconds;

/// Times for 20 mm in the paper.
const PAPER: [(Strategy, &str); 2] = [(Strategy::Pd, "1.514 s"), (Strategy::Ap, "1.22 s")];

pub(super) fn figure(travels: &[Travel], delay_ms: u32, size: Size) -> Figure {
    let title = format!("Figure 8: pushed with 1.5 N, KT = 1000 N/m, {delay_ms} ms one way");
    let find = |strategy| travels.iter().find(|travel| travel.strategy == strategy && travel.delay_ms == delay_ms);
    let shown: Vec<(&Travel, &str)> = PAPER.iter().filter_map(|(strategy, paper)| Some((find(*strategy)?, *paper))).collect();
    let mut panels = Vec::new();
    for quantity in &QUANTITIES {
        panels.extend(shown.iter().map(|(travel, _)| panel(travel, quantity)));
    }
    let mut table = Table::new(&["", "the paper: 20 mm", "ours: 20 mm", "ours: ρ over 8 ms", "ours: viscosity"]);
    let mut text = String::new();
    for (travel, paper) in &shown {
        let viscosity = format!("{:.1} N·s/m", travel.viscosity);
        let radius = format!("{:.4} ({})", travel.radius.value, travel.radius.verdict().word());
        table.rows.push(vec![travel.strategy.word().to_owned(), (*paper).to_owned(), seconds(travel.time), radius, viscosity]);
        let _ = write!(
            text,
            " {}: {}{}, the paper {paper}.",
            travel.strategy.word(),
            seconds(travel.time),
            if travel.diverges() { " while it diverges" } else { "" }
        );
    }
    let caption = format!(
        "The grey line is where the object has gone 20 mm. Agrees where the loop is stable: the velocity saturates, sooner with PD, and AP is the less viscous.{text} The printed \
         parameters do not give both of the paper's times. A symmetric push does not excite how the two untouched copies swing against each other, which is what may be unstable."
    );
    Figure {
        id: format!("fig-8-{delay_ms}ms"),
        svg: Picture::new(title.as_str()).columns(2).panels(panels).size(size).svg(),
        title,
        caption,
        table,
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
            panel = panel.with(Line::new([(time, low), (time, goal)], Look::reference()));
        }
    }
    panel
}

fn csv(travels: &[(&Travel, &str)]) -> String {
    let mut csv = "strategy,delay_ms,t,peer,position,velocity,coordination_force\n".to_owned();
    for (travel, _) in travels {
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
