//! The quantities of mechanics: their ranges and units, and vectors of them.

use cohaptic_linkfile::document::{Node, Value};
use cohaptic_linkfile::reading::TableReader;
use cohaptic_linkfile::reading::values::{self, Quantity, ReadNumber as _};
use cohaptic_units::print::Counted;

use crate::context::SceneContext;
use crate::model::Axes;

/// Above zero \[kg\].
pub(crate) const MASS: Quantity = Quantity::positive("kg");
/// At least zero \[kg\].
pub(crate) const ADDED_MASS: Quantity = Quantity::not_negative("kg");
/// At least zero [N·s/m].
pub(crate) const DAMPING: Quantity = Quantity::not_negative("N·s/m");
/// Above zero [N·s/m].
pub(crate) const IMPEDANCE: Quantity = Quantity::positive("N·s/m");
/// At least zero \[J\].
pub(crate) const ENERGY: Quantity = Quantity::not_negative("J");
/// At least zero [N/m].
pub(crate) const STIFFNESS: Quantity = Quantity::not_negative("N/m");
/// Above zero [N/m].
pub(crate) const WALL_STIFFNESS: Quantity = Quantity::positive("N/m");
/// Any \[m\].
pub(crate) const POSITION: Quantity = Quantity::any("m");
/// Above zero \[m\].
pub(crate) const DISTANCE: Quantity = Quantity::positive("m");
/// Any [m/s].
pub(crate) const VELOCITY: Quantity = Quantity::any("m/s");
/// Any \[N\].
pub(crate) const FORCE: Quantity = Quantity::any("N");
/// Above zero \[N\].
pub(crate) const POSITIVE_FORCE: Quantity = Quantity::positive("N");
/// Above zero [counts/(N·m)].
pub(crate) const POSITIVE_COUNTS: Quantity = Quantity::positive("counts/(N·m)");
/// At least zero \[Hz\].
pub(crate) const FREQUENCY: Quantity = Quantity::not_negative("Hz");
/// Above zero [kg·m²].
pub(crate) const INERTIA: Quantity = Quantity::positive("kg·m²");
/// At least zero [N·m·s/rad].
pub(crate) const ROTATIONAL_DAMPING: Quantity = Quantity::not_negative("N·m·s/rad");
/// At least zero [N·m/rad].
pub(crate) const ROTATIONAL_STIFFNESS: Quantity = Quantity::not_negative("N·m/rad");
/// Any [rad/s].
pub(crate) const RATE: Quantity = Quantity::any("rad/s");
/// Any [N·m].
pub(crate) const TORQUE: Quantity = Quantity::any("N·m");
/// Any, of a quaternion.
pub(crate) const COMPONENT: Quantity = Quantity::any("");
/// At least zero \[rad\].
pub(crate) const ANGLE_BOUND: Quantity = Quantity::not_negative("rad");
/// Any \[rad\].
pub(crate) const ANGLE: Quantity = Quantity::any("rad");

/// Reads the vector under a key, or the declared default: see [`read_vector`].
pub(crate) fn vector_of(table: &mut TableReader<'_>, key: &'static str, context: SceneContext<'_>, spread: Spread) -> Option<[f64; 3]> {
    let quantity = table.key(key).quantity();
    table.read(key, |node, _| read_vector(quantity, node, context, spread))
}

/// Reads the vector under a key that may be left out.
pub(crate) fn maybe_vector_of(table: &mut TableReader<'_>, key: &'static str, context: SceneContext<'_>, spread: Spread) -> Option<Option<[f64; 3]>> {
    let quantity = table.key(key).quantity();
    table.maybe(key, |node, _| read_vector(quantity, node, context, spread))
}

/// Reads one number for each axis. A plain number stands for a list of one or, where `spread` allows it, for the same number on every axis.
pub(crate) fn read_vector(quantity: Quantity, node: &Node, context: SceneContext<'_>, spread: Spread) -> Option<[f64; 3]> {
    let count = context.axes.map(Axes::count);
    let mut vector = [0.0; 3];
    if let Value::List(elements) = &node.value {
        if elements.len() > 3 || elements.is_empty() || count.is_some_and(|count| count != elements.len()) {
            let expected = count.map_or_else(|| "1, 2 or 3".to_owned(), |count| count.to_string());
            let message = format!("found a list of {}: expected as many as the scene has axes, {expected}", Counted(elements.len(), "number"));
            context.fault_at(node, message);
            return None;
        }
        let numbers: Vec<Option<f64>> = elements.iter().map(|element| quantity.read(element, *context)).collect();
        for (component, number) in vector.iter_mut().zip(numbers) {
            *component = number?;
        }
        return Some(vector);
    }
    let value = quantity.read(node, *context)?;
    match (count, spread) {
        (Some(2..), Spread::Refused) => {
            let axes = count.unwrap_or(1);
            context.fault_at(node, format!("{} has one component: expected a list of {axes} numbers [{}]", values::written(node), quantity.unit()));
            None
        }
        (_, Spread::Refused) => Some([value, 0.0, 0.0]),
        (_, Spread::EveryAxis) => {
            vector[..count.unwrap_or(1).min(3)].fill(value);
            Some(vector)
        }
    }
}

/// What a plain number means where there is more than one axis.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Spread {
    /// Nothing: a list must be written.
    Refused,
    /// The same number on every axis.
    EveryAxis,
}
