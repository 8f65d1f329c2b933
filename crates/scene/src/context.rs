//! Context of the readers of a scene's parts.

use core::ops::Deref;

use cohaptic_linkfile::document::Node;
use cohaptic_linkfile::reading::{Context, values};
use cohaptic_linkfile::schema::{Choices, Form, words};

use crate::model::Axes;

/// Context of a reader of a file, with facts of the scene for the readers of parts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SceneContext<'a> {
    pub(crate) file: Context<'a>,
    /// Number of axes; `None` if the number was refused. Readers then skip checks that depend on the number.
    pub(crate) axes: Option<Axes>,
    /// True for a live session, in which a peer of kind `udp` needs neither device nor coupling.
    pub(crate) live: bool,
    /// True if the object has an inertia.
    pub(crate) turns: bool,
    /// Kind of the task as written, empty if none is written; `None` for a scene without a task.
    pub(crate) task: Option<&'a str>,
}

impl<'a> SceneContext<'a> {
    /// Returns the context for a table read on its own, without the table of defaults below.
    pub(crate) fn of_part(self) -> Self {
        Self { file: self.file.of_part(), ..self }
    }
}

impl<'a> Deref for SceneContext<'a> {
    type Target = Context<'a>;

    fn deref(&self) -> &Context<'a> {
        &self.file
    }
}

pub(crate) const AXIS: Form = Form::Words(const { &words(&AXES) });
const AXES: Choices<usize, 3> = [("x", 0, "the first"), ("y", 1, "the second"), ("z", 2, "the third")];

/// Reads the name of an axis. Returns the axis, 0 for x; `None` if the word is unknown or the scene has fewer axes.
pub(crate) fn read_axis(node: &Node, context: SceneContext<'_>) -> Option<usize> {
    let axis = values::word(node, *context, &AXES)?;
    check_axis(node, context, axis)
}

/// Returns the axis if the scene has the axis, and reports a fault otherwise. `None` without a fault if the number of axes is not known.
pub(crate) fn check_axis(node: &Node, context: SceneContext<'_>, axis: usize) -> Option<usize> {
    let count = context.axes?.count();
    if axis >= count {
        let there = ["x", "y", "z"][..count].join(", ");
        context
            .fault_at(node, format!("{} is beyond the axes of this scene: expected {there}, or a larger number under scene.axes", node.describe()));
        return None;
    }
    Some(axis)
}
