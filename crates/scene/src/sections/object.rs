//! Reader of `[object]`: the shared virtual object.

use cohaptic_linkfile::document::Node;
use cohaptic_linkfile::reading::TableReader;
use cohaptic_linkfile::schema::{Form, Table, number, optional, required, usual, vector};
use cohaptic_peer::Enclosure;
use cohaptic_units::print::SixDigits;

use super::rotation::{ObjectRotation, QUATERNION, read_object_rotation};
use crate::context::SceneContext;
use crate::model::ObjectSpec;
use crate::quantities::{DAMPING, INERTIA, MASS, POSITION, RATE, ROTATIONAL_DAMPING, Spread, VELOCITY, WALL_STIFFNESS, vector_of};

pub(crate) static OBJECT: Table = Table::of(&[&[
    required("mass", number(MASS), "Mass of the whole object"),
    usual("damping", number(DAMPING), "0", "Viscous damping of each copy"),
    usual("split-mass", Form::Boolean, "true", "Whether each of the N copies has the mass divided by N; if false, each copy has the whole mass"),
    usual("position", vector(POSITION), "0", "Position of copies and devices at the beginning"),
    usual("velocity", vector(VELOCITY), "0", "Velocity of copies and devices at the beginning"),
    optional("enclosure", Form::Table(&ENCLOSURE), "Walls that limit the travel of every copy"),
    optional(
        "inertia",
        vector(INERTIA),
        "Principal moments of inertia of the whole object, each at most the sum of the other two. An object with this key turns, which needs three axes",
    ),
    optional("rotational-damping", vector(ROTATIONAL_DAMPING), "Viscous rotational damping of each copy; damping times inertia over mass by default"),
    usual("orientation", QUATERNION, "[1, 0, 0, 0]", "Orientation of copies and devices at the beginning, as a quaternion w, x, y, z of any length"),
    usual("angular-velocity", vector(RATE), "0", "Angular velocity of copies and devices at the beginning, in their own axes"),
]]);
static ENCLOSURE: Table = Table::of(&[&[
    required("min", vector(POSITION), "Position of the lower wall on each axis").expecting(ENDS),
    required("max", vector(POSITION), "Position of the upper wall on each axis").expecting(ENDS),
    required("stiffness", number(WALL_STIFFNESS), "Stiffness of the walls"),
    required("damping", number(DAMPING), "Damping of the walls"),
]]);
const ENDS: &str = "{}, or a list of one for each axis";

/// Reads the object and its rotational part; `Some((_, None))` for an object that does not turn.
pub(crate) fn read_object(node: &Node, context: SceneContext<'_>) -> Option<(ObjectSpec, Option<ObjectRotation>)> {
    let mut table = TableReader::new(node, *context, &OBJECT, "a table such as [object]")?;
    let (mass, damping, split_mass) = (table.value("mass"), table.value("damping"), table.value("split-mass"));
    let [position, velocity] = ["position", "velocity"].map(|key| vector_of(&mut table, key, context, Spread::EveryAxis));
    let enclosure = table.maybe("enclosure", |node, _| read_enclosure(node, context));
    let rotation = read_object_rotation(&mut table, context);
    table.finish();
    let (position, velocity, enclosure) = (position?, velocity?, enclosure?);
    Some((ObjectSpec { mass: mass?, damping: damping?, split_mass: split_mass?, position, velocity, enclosure }, rotation?))
}

fn read_enclosure(node: &Node, context: SceneContext<'_>) -> Option<Enclosure> {
    const EXPECTED: &str = "a table such as { min = -0.1, max = 0.1, stiffness = 1000.0, damping = 5.0 }";
    let mut table = TableReader::new(node, *context, &ENCLOSURE, EXPECTED)?;
    let [min, max] = ["min", "max"].map(|key| vector_of(&mut table, key, context, Spread::EveryAxis));
    let max_node = table.get("max");
    let (stiffness, damping) = (table.value("stiffness"), table.value("damping"));
    table.finish();
    let (min, max) = (min?, max?);
    // Components beyond the axes are zero in both ends, which is no fault.
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
