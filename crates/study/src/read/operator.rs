//! Reader of `[operator]`: means of the modelled persons.

use cohaptic_linkfile::document::Node;
use cohaptic_linkfile::reading::{Context, TableReader};

use super::keys::OPERATOR;
use crate::model::{Person, Study};

/// Keys of the persons of a single law, each with `true` for persons who track.
const OF_LAWS: [(&str, bool); 4] = [("move", false), ("reaction", false), ("noise", false), ("crossover", true)];

pub(super) fn read_operator(node: &Node, context: Context<'_>) -> Option<Person> {
    let mut table = TableReader::new(node, context, &OPERATOR, "a table such as { move = \"250ms\", noise = 0.1 }")?;
    let (movement, visual_delay) = (table.value("move"), table.value("visual-delay"));
    let (reaction, noise, crossover) = (table.value("reaction"), table.value("noise"), table.value("crossover"));
    table.finish();
    Some(Person { movement: movement?, visual_delay: visual_delay?, reaction: reaction?, noise: noise?, crossover: crossover? })
}

/// Reports the first key of a table `[operator]` that no condition uses. Returns whether every key is used.
pub(super) fn is_used(study: &Study, operator: &Node, context: Context<'_>) -> bool {
    let unused = OF_LAWS.iter().find_map(|(key, tracks)| {
        let entry = operator.as_table()?.get(key)?;
        study.conditions.iter().all(|condition| condition.tracks != *tracks).then_some((&*entry.node, *tracks))
    });
    if let Some((node, tracks)) = unused {
        let who = if tracks {
            "persons who track take this key, and no condition has a task of kind track"
        } else {
            "persons who track do not take this key"
        };
        context.fault_at(node, format!("{who}: expected no such key"));
    }
    unused.is_none()
}
