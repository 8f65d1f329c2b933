//! `[object]`: the shared virtual object.

use cohaptic_linkfile::document::Node;
use cohaptic_linkfile::reading::values::ReadNumber as _;
use cohaptic_linkfile::reading::{TableReader, values};
use cohaptic_peer::Enclosure;
use cohaptic_units::print::SixDigits;

use super::rotation::{ObjectRotation, read_object_rotation};
use crate::context::SceneContext;
use crate::model::ObjectSpec;
use crate::quantities::{DAMPING, MASS, POSITION, Spread, VELOCITY, WALL_STIFFNESS, read_vector};

/// The object, and how it turns if it does.
pub(crate) fn read_object(node: &Node, context: SceneContext<'_>) -> Option<(ObjectSpec, Option<ObjectRotation>)> {
    let mut table = TableReader::new(node, *context, "a table such as [object]")?;
    let mass = table.required("mass", &MASS.expected(), |node, context| MASS.read(node, context));
    let damping = table.optional("damping", 0.0, |node, context| DAMPING.read(node, context));
    let split_mass = table.optional("split-mass", true, values::boolean);
    let position = table.optional("position", [0.0; 3], |node, _| read_position(node, context));
    let velocity = table.optional("velocity", [0.0; 3], |node, _| read_velocity(node, context));
    let enclosure = table.maybe("enclosure", |node, _| read_enclosure(node, context));
    let rotation = read_object_rotation(&mut table, context);
    table.finish();
    let (position, velocity, enclosure) = (position?, velocity?, enclosure?);
    Some((ObjectSpec { mass: mass?, damping: damping?, split_mass: split_mass?, position, velocity, enclosure }, rotation?))
}

/// Where something begins.
pub(crate) fn read_position(node: &Node, context: SceneContext<'_>) -> Option<[f64; 3]> {
    read_vector(POSITION, node, context, Spread::EveryAxis)
}

/// With which velocity something begins.
pub(crate) fn read_velocity(node: &Node, context: SceneContext<'_>) -> Option<[f64; 3]> {
    read_vector(VELOCITY, node, context, Spread::EveryAxis)
}

fn read_enclosure(node: &Node, context: SceneContext<'_>) -> Option<Enclosure> {
    let mut table = TableReader::new(node, *context, "a table such as { min = -0.1, max = 0.1, stiffness = 1000.0, damping = 5.0 }")?;
    let ends = "a number [m], or a list of one for each axis";
    let min = table.required("min", ends, |node, _| read_position(node, context));
    let max_node = table.get("max");
    let max = table.required("max", ends, |node, _| read_position(node, context));
    let stiffness = table.required("stiffness", &WALL_STIFFNESS.expected(), |node, context| WALL_STIFFNESS.read(node, context));
    let damping = table.required("damping", &DAMPING.expected(), |node, context| DAMPING.read(node, context));
    table.finish();
    let (min, max) = (min?, max?);
    let axes = context.axes?.count();
    if let Some(axis) = (0..axes).find(|&axis| min[axis] >= max[axis]) {
        let name = ["x", "y", "z"][axis];
        let message = format!(
            "the end at {} on axis {name} is not above min, {}: expected max above min on each axis",
            SixDigits(max[axis]),
            SixDigits(min[axis])
        );
        context.fault_at(max_node?, message);
        return None;
    }
    Some(Enclosure { min, max, stiffness: stiffness?, damping: damping? })
}
