//! Which columns the table of a campaign has.

use cohaptic_wan::DropCause;

use super::{Column, Kind, Roster};
use crate::vary::Variation;

/// The letters of the axes.
const AXES: [&str; 3] = ["x", "y", "z"];

/// The columns, in the order in which [`row`](super::row()) fills them.
pub(crate) fn columns(variations: &[Variation], verdicts: bool, roster: &Roster) -> Vec<Column> {
    let column = |name: String, kind: Kind, optional: bool| Column { name, kind, optional };
    let always = |name: &str, kind: Kind| column(name.to_owned(), kind, false);
    let mut columns = vec![always("run", Kind::Integer), always("combination", Kind::Integer), always("seed", Kind::Integer)];
    columns.extend(variations.iter().map(|vary| column(vary.column(), vary.kind(), false)));
    if verdicts {
        let optional = |name: &str, kind: Kind| column(name.to_owned(), kind, true);
        columns.extend([optional("verdict", Kind::Text), optional("judged", Kind::Text)]);
        columns.extend([optional("radius", Kind::Number), optional("error_bound", Kind::Number)]);
    }
    columns.push(always("ending", Kind::Text));
    columns.push(always("ended_at_s", Kind::Number));
    columns.push(always("ticks", Kind::Integer));
    columns.push(always("max_discrepancy_m", Kind::Number));
    for (place, peer) in roster.peers.iter().enumerate() {
        for (quantity, unit) in [("position", "m"), ("velocity", "m_s")] {
            for (axis, letter) in AXES.iter().enumerate().take(roster.axes) {
                let optional = place >= roster.always || axis >= roster.fewest_axes;
                columns.push(column(format!("peers.{peer}.{quantity}_{letter}_{unit}"), Kind::Number, optional));
            }
        }
    }
    columns.push(always("stale_samples", Kind::Integer));
    columns.push(always("refused_samples", Kind::Integer));
    counters("links", &mut columns);
    if roster.access_lines {
        counters("access", &mut columns);
    }
    columns
}

/// What links did in all.
fn counters(of: &str, columns: &mut Vec<Column>) {
    let causes = DropCause::ALL.into_iter().map(|cause| format!("dropped_{}", cause.name().replace('-', "_")));
    let names = ["offered", "duplicated", "delivered"].map(str::to_owned).into_iter().chain(causes);
    let names = names.chain(["in_flight", "marked", "damaged"].map(str::to_owned));
    columns.extend(names.map(|name| Column { name: format!("{of}.{name}"), kind: Kind::Integer, optional: false }));
    columns.push(Column { name: format!("{of}.mean_delay_s"), kind: Kind::Number, optional: true });
}
