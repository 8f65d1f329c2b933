//! Reader of `[operator]`: means of the modelled persons.

use std::time::Duration;

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

/// Numerator of 2.5. A number of a person is the mean times e^(0.15·z) with a normal z, and exceeds 2.5 times the mean only if z > 6.1, once in 10⁹ persons.
const MOST: u32 = 5;
/// Denominator of 2.5.
const OVER: u32 = 2;

/// Reports the first key of a table `[operator]` with a mean so near a limit that a scene could refuse the number of a person. Returns whether there is no such
/// key.
pub(super) fn fits(study: &Study, operator: &Node, context: Context<'_>) -> bool {
    let Person { movement, visual_delay, reaction, noise, crossover } = study.operator;
    let (factor, times) = (f64::from(MOST) / f64::from(OVER), |duration: Duration| duration * MOST / OVER);
    let extreme =
        Person { movement: times(movement), visual_delay: times(visual_delay), reaction, noise: noise * factor, crossover: crossover * factor };
    let refused = (0..study.conditions.len()).find_map(|condition| {
        let error = study.scene_of_persons(condition, &vec![extreme; study.group_size()]).err()?;
        let diagnostic = error.diagnostic()?;
        // A key that the table leaves out has its usual mean. The scene may refuse this mean too, but a study with people needs no modelled persons.
        let entry = operator.as_table()?.get(diagnostic.key().rsplit('.').next()?)?;
        Some((&*entry.node, format!("a person may have {factor} times this mean: {}", diagnostic.message())))
    });
    if let Some((node, message)) = &refused {
        context.fault_at(node, message.as_str());
    }
    refused.is_none()
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
