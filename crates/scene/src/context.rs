//! The state of the readers of a scene.

use core::ops::Deref;

use cohaptic_linkfile::document::Node;
use cohaptic_linkfile::reading::{Context, values};
use cohaptic_linkfile::schema::{Choices, Form, words};

use crate::model::Axes;

/// The state of a reader of a file, and the facts of a scene that the readers of its parts depend on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SceneContext<'a> {
    pub(crate) file: Context<'a>,
    /// `None`: not known, because the number itself was refused.
    pub(crate) axes: Option<Axes>,
    /// Whether the scene is for a live session, where peers that live elsewhere need no model.
    pub(crate) live: bool,
    /// Whether the object has an inertia.
    pub(crate) turns: bool,
}

impl<'a> SceneContext<'a> {
    /// This state for a table that is read without the table below it.
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

/// An axis that the scene has, from 0.
pub(crate) fn read_axis(node: &Node, context: SceneContext<'_>) -> Option<usize> {
    let axis = values::word(node, *context, &AXES)?;
    check_axis(node, context, axis)
}

/// Reports an axis that the scene does not have.
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
