//! Readers of the keys of a turning object. The keys stand in several tables, and all need `object.inertia`.

use cohaptic_linkfile::document::{Entry, Node, Value};
use cohaptic_linkfile::reading::values::{self, Quantity, ReadNumber as _};
use cohaptic_linkfile::reading::{Context, TableReader};
use cohaptic_linkfile::schema::{Form, number};
use cohaptic_peer::rotation::{Attitude, Spin, Triple};
use cohaptic_peer::{Gains, Signal};

use crate::context::SceneContext;
use crate::model::Axes;
use crate::quantities::{COMPONENT, INERTIA, ROTATIONAL_STIFFNESS};

/// Keys without a meaning if the object has no inertia, in any table.
const ROTATIONAL: [&str; 9] = [
    "rotational-damping",
    "rotational-stiffness",
    "orientation",
    "orientations",
    "angular-velocity",
    "grasp",
    "torque",
    "rotation-steps",
    "rotation-discrepancy",
];

/// Rotational keys of `[object]`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct ObjectRotation {
    pub(super) inertia: Triple,
    pub(super) damping: Option<Triple>,
    pub(super) attitude: Attitude,
}

/// Rotational keys of a peer. Each field but `grasp` is `None` if the key is not given.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct PeerRotationKeys {
    pub(crate) grasp: Triple,
    pub(crate) orientation: Option<[f64; 4]>,
    pub(crate) rate: Option<Triple>,
    pub(crate) device: Option<Spin>,
    pub(crate) coupling: Option<Gains>,
    pub(crate) torque: Option<Signal>,
}

/// Reads the rotational keys of `[object]`; `Some(None)` without an inertia.
pub(super) fn read_object_rotation(table: &mut TableReader<'_>, context: SceneContext<'_>) -> Option<Option<ObjectRotation>> {
    let inertia = table.maybe("inertia", |node, file| read_inertia(node, file, context.axes));
    let damping = maybe_triple(table, "rotational-damping");
    let orientation = table.read("orientation", read_orientation);
    let rate = triple(table, "angular-velocity");
    let (damping, orientation, rate) = (damping?, orientation?, rate?);
    Some(inertia?.map(|inertia| ObjectRotation { inertia, damping, attitude: Attitude { orientation, rate } }))
}

fn read_inertia(node: &Node, file: Context<'_>, axes: Option<Axes>) -> Option<Triple> {
    let inertia = read_triple(INERTIA, node, file)?;
    if axes.is_some_and(|axes| axes != Axes::Three) {
        file.fault_at(node, "an object with an inertia turns in space: expected scene.axes = 3, or no object.inertia");
        return None;
    }
    check_triangle(&inertia, "a moment of inertia", node, file).then_some(inertia)
}

/// Returns true if each of three numbers is at most the sum of the two others, otherwise false after a fault.
fn check_triangle(numbers: &Triple, name: &str, node: &Node, context: Context<'_>) -> bool {
    let sum: f64 = numbers.iter().sum();
    // The tolerance admits a body without thickness: the largest moment equals the sum of the two others but for rounding.
    let above = numbers.iter().any(|number| *number > 0.5 * sum * (1.0 + 1e-12));
    if above {
        context.fault_at(node, format!("{name} is above the sum of the two others: expected three numbers of which none is"));
    }
    !above
}

/// Reads a number for all three axes of a body, or a list of three numbers.
fn read_triple(quantity: Quantity, node: &Node, context: Context<'_>) -> Option<Triple> {
    let Value::List(elements) = &node.value else { return quantity.read(node, context).map(|number| [number; 3]) };
    let numbers: Vec<Option<f64>> = elements.iter().map(|element| quantity.read(element, context)).collect();
    let numbers: Vec<f64> = numbers.into_iter().collect::<Option<_>>()?;
    let triple = Triple::try_from(numbers).ok();
    if triple.is_none() {
        context.fault_at(node, format!("a list of {}: expected a number [{}], or a list of three", elements.len(), quantity.unit()));
    }
    triple
}

/// Reads the three numbers under a key, or the declared default.
fn triple(table: &mut TableReader<'_>, key: &'static str) -> Option<Triple> {
    let quantity = table.key(key).quantity();
    table.read(key, |node, context| read_triple(quantity, node, context))
}

/// Reads the three numbers under an optional key; `Some(None)` if the key is absent.
pub(super) fn maybe_triple(table: &mut TableReader<'_>, key: &'static str) -> Option<Option<Triple>> {
    let quantity = table.key(key).quantity();
    table.maybe(key, |node, context| read_triple(quantity, node, context))
}

/// Reads KR [N·m/rad]. Each of the three numbers may be at most the sum of the two others.
pub(super) fn read_rotational_stiffness(node: &Node, context: Context<'_>) -> Option<Triple> {
    let stiffness = read_triple(ROTATIONAL_STIFFNESS, node, context)?;
    check_triangle(&stiffness, "a stiffness", node, context).then_some(stiffness)
}

pub(super) const QUATERNION: Form = Form::List(&number(COMPONENT));

/// Reads a quaternion of any length above zero. Returns the unit quaternion.
pub(super) fn read_orientation(node: &Node, context: Context<'_>) -> Option<[f64; 4]> {
    const EXPECTED: &str = "a quaternion, a list of four numbers w, x, y, z that are not all zero";
    let elements = values::list(node, context, EXPECTED)?;
    let numbers: Vec<Option<f64>> = elements.iter().map(|element| COMPONENT.read(element, context)).collect();
    let numbers: Vec<f64> = numbers.into_iter().collect::<Option<_>>()?;
    let unit = <[f64; 4]>::try_from(numbers).ok().and_then(|quaternion| {
        // Scaled by the largest component first, so that no square overflows or vanishes.
        let largest = quaternion.iter().fold(0.0_f64, |largest, component| largest.max(component.abs()));
        let scaled = quaternion.map(|component| component / largest);
        let norm = scaled.iter().map(|component| component * component).sum::<f64>().sqrt();
        (largest > 0.0).then(|| scaled.map(|component| component / norm))
    });
    if unit.is_none() {
        context.fault_at(node, format!("{} is not a quaternion: expected {EXPECTED}", values::written(node)));
    }
    unit
}

/// Reads `grasp`, `orientation` and `angular-velocity` of a peer. All further fields keep the defaults.
pub(super) fn read_peer_rotation(table: &mut TableReader<'_>) -> Option<PeerRotationKeys> {
    let grasp = triple(table, "grasp");
    let orientation = table.maybe("orientation", read_orientation);
    let rate = maybe_triple(table, "angular-velocity");
    Some(PeerRotationKeys { grasp: grasp?, orientation: orientation?, rate: rate?, ..PeerRotationKeys::default() })
}

/// Reads `inertia` and `rotational-damping` of a device; `Some(None)` for a device that does not turn.
pub(super) fn read_device_rotation(table: &mut TableReader<'_>) -> Option<Option<Spin>> {
    let inertia = table.maybe("inertia", |node, context| {
        let inertia = read_triple(INERTIA, node, context)?;
        check_triangle(&inertia, "a moment of inertia", node, context).then_some(inertia)
    });
    let needs = "a device without an inertia does not turn: expected device.inertia too";
    let damping = table.only_if(inertia != Some(None), "rotational-damping", needs).and_then(|()| triple(table, "rotational-damping"));
    let (inertia, damping) = (inertia?, damping?);
    Some(inertia.map(|inertia| Spin { inertia, damping }))
}

/// Reads `rotational-stiffness` and `rotational-damping` of a coupling; `Some(None)` without a stiffness.
pub(super) fn read_coupling_rotation(table: &mut TableReader<'_>) -> Option<Option<Gains>> {
    let stiffness = table.maybe_value("rotational-stiffness");
    let needs = "a coupling that turns needs a stiffness: expected rotational-stiffness too";
    let damping = table.only_if(stiffness != Some(None), "rotational-damping", needs).and_then(|()| table.value("rotational-damping"));
    let (stiffness, damping) = (stiffness?, damping?);
    Some(stiffness.map(|stiffness| Gains { stiffness, damping }))
}

/// Refuses every rotational key in a scene without a turning object, at any depth of the document.
pub(crate) fn refuse_rotational_keys(document: &Node, context: Context<'_>) {
    const MESSAGE: &str = "this is about an object that turns: expected object.inertia, or no such key";
    let refuse = |entry: &Entry| context.fault(entry.key, &entry.node.path, MESSAGE);
    match &document.value {
        Value::Table(table) => {
            for entry in &table.0 {
                // The inertia of a device is a rotational key. The inertia of the object is no such key: with an inertia the object would turn.
                let of_device = entry.name == "inertia" && entry.node.path != "object.inertia";
                if of_device || ROTATIONAL.contains(&entry.name.as_str()) {
                    refuse(entry);
                } else {
                    refuse_rotational_keys(&entry.node, context);
                }
            }
        }
        Value::List(elements) => {
            for element in elements {
                refuse_rotational_keys(element, context);
            }
        }
        Value::Text(_) | Value::Integer(_) | Value::Float(_) | Value::Boolean(_) | Value::Date => {}
    }
}
