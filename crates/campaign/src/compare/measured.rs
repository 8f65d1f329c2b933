//! The measures among the columns of a table, with units and meanings.

use cohaptic_scene::{Measure, Scope};

use crate::table::Column;
use crate::value::Kind;

/// Name of the measure in every table: the largest discrepancy of a run.
pub(super) const LARGEST: &str = "max_discrepancy_m";

/// A column with one number per run, by which runs are judged.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct MeasuredColumn {
    /// Name of the column in the table.
    pub name: String,
    /// Unit of the values.
    pub unit: String,
    /// Meaning of the measure, without a final full stop.
    pub about: String,
}

/// Returns the columns of measures, in the order of the table.
pub(crate) fn measured(columns: &[Column]) -> Vec<MeasuredColumn> {
    columns.iter().filter(|column| column.kind == Kind::Number).filter_map(|column| words(&column.name)).collect()
}

/// Returns name, unit and meaning of a column; `None` if the column is no measure.
fn words(column: &str) -> Option<MeasuredColumn> {
    let (unit, about) = if column == LARGEST {
        ("m", "Largest distance along an axis between two copies, over instants")
    } else {
        // `peers.PEER.MEASURE`: the name of a peer may contain dots, so the last dot begins the measure.
        let name = column.strip_prefix("peers.").and_then(|rest| rest.rsplit_once('.')).map_or(column, |(_, name)| name);
        let scope = if name == column { Scope::Run } else { Scope::Peer };
        let measure = Measure::ALL.iter().find(|measure| measure.name() == name && measure.scope() == scope)?;
        (measure.unit(), measure.about())
    };
    Some(MeasuredColumn { name: column.to_owned(), unit: unit.to_owned(), about: about.to_owned() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measures_of_the_run_and_of_each_peer_are_compared_and_nothing_else() {
        let column = |name: &str| Column { name: name.to_owned(), kind: Kind::Number, optional: true };
        let names = [
            "ended_at_s",
            LARGEST,
            "peers.left.position_x_m",
            "links.mean_delay_s",
            "travel_s",
            "peers.a.b.energy_j",
            "energy_j",
            "peers.left.travel_s",
        ];
        let found = measured(&names.map(column));
        assert_eq!(found.iter().map(|measure| measure.name.as_str()).collect::<Vec<&str>>(), [LARGEST, "travel_s", "peers.a.b.energy_j", "energy_j"]);
        assert_eq!(found.iter().map(|measure| measure.unit.as_str()).collect::<Vec<&str>>(), ["m", "s", "J", "J"]);
        assert_ne!(found[2].about, found[3].about);
        // Every measure is known by its full name.
        let all = |measure: &Measure| column(&measure.pattern().replace("NAME", "left"));
        assert_eq!(measured(&Measure::ALL.iter().map(all).collect::<Vec<Column>>()).len(), Measure::ALL.len());
    }
}
