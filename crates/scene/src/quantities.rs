//! Quantities of mechanics with their ranges and units, and readers of vectors.

use cohaptic_linkfile::document::{Node, Value};
use cohaptic_linkfile::reading::TableReader;
use cohaptic_linkfile::reading::values::{self, Quantity, ReadNumber as _};
use cohaptic_units::print::Counted;

use crate::context::SceneContext;
use crate::model::Axes;

/// Mass \[kg\], above zero.
pub(crate) const MASS: Quantity = Quantity::positive("kg");
/// Mass that may be absent \[kg\], at least zero.
pub(crate) const ADDED_MASS: Quantity = Quantity::not_negative("kg");
/// Damping [N·s/m], at least zero.
pub(crate) const DAMPING: Quantity = Quantity::not_negative("N·s/m");
/// Wave impedance [N·s/m], above zero.
pub(crate) const IMPEDANCE: Quantity = Quantity::positive("N·s/m");
/// Energy \[J\], at least zero.
pub(crate) const ENERGY: Quantity = Quantity::not_negative("J");
/// Stiffness [N/m], at least zero.
pub(crate) const STIFFNESS: Quantity = Quantity::not_negative("N/m");
/// Stiffness of a wall [N/m], above zero.
pub(crate) const WALL_STIFFNESS: Quantity = Quantity::positive("N/m");
/// Position \[m\], any finite number.
pub(crate) const POSITION: Quantity = Quantity::any("m");
/// Distance \[m\], above zero.
pub(crate) const DISTANCE: Quantity = Quantity::positive("m");
/// Least distance \[m\], at least zero.
pub(crate) const DISTANCE_BOUND: Quantity = Quantity::not_negative("m");
/// Velocity [m/s], any finite number.
pub(crate) const VELOCITY: Quantity = Quantity::any("m/s");
/// Limit of a speed [m/s], above zero.
pub(crate) const SPEED_LIMIT: Quantity = Quantity::positive("m/s");
/// Force \[N\], any finite number.
pub(crate) const FORCE: Quantity = Quantity::any("N");
/// Limit of a force \[N\], above zero.
pub(crate) const POSITIVE_FORCE: Quantity = Quantity::positive("N");
/// Motor counts per torque [counts/(N·m)], above zero.
pub(crate) const POSITIVE_COUNTS: Quantity = Quantity::positive("counts/(N·m)");
/// Factor without a unit, at least zero.
pub(crate) const FACTOR: Quantity = Quantity::not_negative("");
/// Angular frequency \[rad/s\], above zero.
pub(crate) const FREQUENCY_LIMIT: Quantity = Quantity::positive("rad/s");
/// Frequency \[Hz\], at least zero.
pub(crate) const FREQUENCY: Quantity = Quantity::not_negative("Hz");
/// Moment of inertia [kg·m²], above zero.
pub(crate) const INERTIA: Quantity = Quantity::positive("kg·m²");
/// Rotational damping [N·m·s/rad], at least zero.
pub(crate) const ROTATIONAL_DAMPING: Quantity = Quantity::not_negative("N·m·s/rad");
/// Rotational stiffness [N·m/rad], at least zero.
pub(crate) const ROTATIONAL_STIFFNESS: Quantity = Quantity::not_negative("N·m/rad");
/// Angular velocity [rad/s], any finite number.
pub(crate) const RATE: Quantity = Quantity::any("rad/s");
/// Torque [N·m], any finite number.
pub(crate) const TORQUE: Quantity = Quantity::any("N·m");
/// Component of a quaternion, without a unit, any finite number.
pub(crate) const COMPONENT: Quantity = Quantity::any("");
/// Largest angle \[rad\], at least zero.
pub(crate) const ANGLE_BOUND: Quantity = Quantity::not_negative("rad");
/// Limit of an angle \[rad\], above zero.
pub(crate) const POSITIVE_ANGLE: Quantity = Quantity::positive("rad");
/// Angle \[rad\], any finite number.
pub(crate) const ANGLE: Quantity = Quantity::any("rad");

/// Reads the vector under a key, or the declared default. See [`read_vector`].
pub(crate) fn vector_of(table: &mut TableReader<'_>, key: &'static str, context: SceneContext<'_>, spread: Spread) -> Option<[f64; 3]> {
    let quantity = table.key(key).quantity();
    table.read(key, |node, _| read_vector(quantity, node, context, spread))
}

/// Reads the vector under an optional key; `Some(None)` if the key is absent.
pub(crate) fn maybe_vector_of(table: &mut TableReader<'_>, key: &'static str, context: SceneContext<'_>, spread: Spread) -> Option<Option<[f64; 3]>> {
    let quantity = table.key(key).quantity();
    table.maybe(key, |node, _| read_vector(quantity, node, context, spread))
}

/// Reads a number for each axis; components beyond the axes are zero. A single number stands for a list of one number or, with [`Spread::EveryAxis`], for the
/// same number on every axis.
pub(crate) fn read_vector(quantity: Quantity, node: &Node, context: SceneContext<'_>, spread: Spread) -> Option<[f64; 3]> {
    let count = context.axes.map(Axes::count);
    let mut vector = [0.0; 3];
    if let Value::List(elements) = &node.value {
        // A list may have up to three numbers even if the number of axes was refused, so that only one fault is reported. `vector` has room for three.
        if elements.len() > 3 || elements.is_empty() || count.is_some_and(|count| count != elements.len()) {
            let expected = count.map_or_else(|| "1, 2 or 3".to_owned(), |count| count.to_string());
            let message = format!("found a list of {}: expected as many as the scene has axes, {expected}", Counted(elements.len(), "number"));
            context.fault_at(node, message);
            return None;
        }
        // Every element is read before the first `?`, so that each wrong element is reported.
        let numbers: Vec<Option<f64>> = elements.iter().map(|element| quantity.read(element, *context)).collect();
        for (component, number) in vector.iter_mut().zip(numbers) {
            *component = number?;
        }
        return Some(vector);
    }
    let value = quantity.read(node, *context)?;
    match (count, spread) {
        // With one axis, or after a refused number of axes, a single number is enough.
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

/// Meaning of a single number in a scene with more than one axis.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Spread {
    /// A fault: a list is expected.
    Refused,
    /// The same number on every axis.
    EveryAxis,
}
