//! Figure 8: the object pushed with 1.5 N.

use std::fmt::Write as _;

use super::chart::{Line, Panel, draw};
use super::{Figure, Table};
use crate::case::Strategy;
use crate::experiment::{DISTANCE, PeerTrace, Travel};
use crate::text::seconds;

/// What the paper measured for 20 mm [s].
const PAPER: [(Strategy, &str); 2] = [(Strategy::Pd, "1.514 s"), (Strategy::Ap, "1.22 s")];

pub(super) fn figure(travels: &[Travel], delay_ms: u32) -> Figure {
    let title = format!("Figure 8: pushed with 1.5 N, KT = 1000 N/m, {delay_ms} ms one way");
    let find = |strategy| travels.iter().find(|travel| travel.strategy == strategy && travel.delay_ms == delay_ms);
    let shown: Vec<(&Travel, &str)> = PAPER.iter().filter_map(|(strategy, paper)| Some((find(*strategy)?, *paper))).collect();
    let mut panels = Vec::new();
    for quantity in QUANTITIES {
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
    Figure { id: format!("fig-8-{delay_ms}ms"), svg: draw(&panels, 2, &title), title, caption, table, csv: csv(&shown) }
}

/// How much of the scene is shown, a little more than in the paper [s].
const SHOWN: f64 = 3.0;

/// A quantity with its unit, its range, and how it is had from a trace.
type Quantity = (&'static str, (f64, f64), fn(&PeerTrace) -> &[f64], f64);

const QUANTITIES: [Quantity; 3] = [
    ("position [cm]", (0.0, 5.0), |peer| &peer.position, 100.0),
    ("velocity [cm/s]", (-4.0, 2.0), |peer| &peer.velocity, 100.0),
    ("coordination force [N]", (-4.0, 4.0), |peer| &peer.force, 1.0),
];

fn panel(travel: &Travel, (label, y, values, scale): Quantity) -> Panel {
    let line = |(place, peer): (usize, &PeerTrace)| {
        let points = travel.trace.times.iter().copied().zip(values(peer).iter().map(|value| scale * value)).take_while(|(t, _)| *t <= SHOWN);
        Line::within(format!("copy {}", place + 1), place, points, y)
    };
    let mut lines: Vec<Line> = travel.trace.peers.iter().enumerate().map(line).collect();
    if label.starts_with("position") {
        let goal = 100.0 * (travel.trace.peers[0].position.first().copied().unwrap_or(0.0) - DISTANCE);
        lines.push(Line { name: "20 mm".to_owned(), colour: 6, dashed: true, runs: vec![vec![(0.0, goal), (SHOWN, goal)]] });
        if let Some(time) = travel.time {
            lines.push(Line { name: String::new(), colour: 6, dashed: true, runs: vec![vec![(time, y.0), (time, goal)]] });
        }
    }
    Panel { title: travel.strategy.word().to_owned(), x_label: "t [s]", y_label: label, x: (0.0, SHOWN), y, decades: false, lines }
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
