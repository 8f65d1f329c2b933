//! Declarations of the keys of a study file.

use cohaptic_linkfile::reading::values::Quantity;
use cohaptic_linkfile::schema::{Choices, Form, Table, number, optional, required, usual, words};

use crate::model::{After, Order};

/// Keys at the top level of a study file.
pub static ROOT: Table = Table::of(&[&[
    required("study", Form::Table(&STUDY), "Scene, people, trials and order").expecting("a table [study] with a scene"),
    optional(
        "conditions",
        Form::Table(&CONDITIONS),
        "Keys of the scene that differ between conditions, each with its values; the last key varies fastest",
    ),
    optional("questions", Form::List(&Form::Table(&QUESTION)), "Questions, one or a group of scales per entry"),
    required("analysis", Form::Table(&ANALYSIS), "Analysed measures").expecting("a table [analysis] with measures"),
    optional("operator", Form::Table(&OPERATOR), "Means of the modelled persons of the dry run"),
]]);
pub(super) static STUDY: Table = Table::of(&[&[
    optional("title", Form::Text, "Title for people; the name of the file by default"),
    required("scene", Form::File, "Scene file, whose pointers are the hands of the people").expecting("a scene file such as \"pull.toml\""),
    // Bounds the number of folders of a mistyped number.
    required("participants", Form::Integer(1, 10_000), "Number of people, a multiple of group").expecting("a number of people, {}"),
    required("group", Form::Integer(1, 10), "Number of people in one scene; the group is the unit of the statistics")
        .expecting("a number of people in a group, {}"),
    usual("order", Form::Words(const { &words(&ORDERS) }), "\"williams\"", "Order of the conditions"),
    usual("seed", Form::Integer(0, i64::MAX.unsigned_abs()), "0", "Seed of orders, of trials and of modelled persons"),
    required("trials", Form::Integer(1, MOST_TRIALS), "Analysed trials of each condition").expecting("a number of trials, {}"),
    usual("practice", Form::Integer(0, MOST_TRIALS), "0", "Trials at the beginning of each condition that are never analysed"),
    optional("break", Form::Table(&BREAK), "Breaks between trials"),
    required("consent", Form::File, "Text that a person accepts or refuses first").expecting("a file of Markdown such as \"consent.md\""),
    required("instructions", Form::File, "Text that a person reads before the first trial").expecting("a file of Markdown such as \"task.md\""),
]]);
/// Most trials of a condition, and most practice trials.
const MOST_TRIALS: u64 = 100;
pub(super) static BREAK: Table = Table::of(&[&[
    required("every", Form::Integer(1, 1000), "Number of trials from a break to the next").expecting("a number of trials, {}"),
    usual("at-least", Form::Duration, "\"30s\"", "Least duration of a break"),
]]);
static CONDITIONS: Table = Table::with_others(&[], &Form::List(&Form::AnyOf(&[Form::Text, Form::Boolean, number(Quantity::any(""))])));
pub(super) static QUESTION: Table = Table::of(&[&[
    optional("name", Form::Text, "Name in the table of answers; the kind and the number of the entry by default"),
    required("after", Form::Words(const { &words(&AFTER) }), "When the question is asked").expecting("trial, condition or study"),
    required("kind", Form::Words(const { &words(&KINDS) }), "Form of the answer").expecting("tlx or scale"),
    optional("text", Form::Text, "The question, of the kind scale"),
    optional("ends", Form::Pair(&Form::Text), "Words at the lower and at the upper end of a scale"),
    optional("steps", Form::Integer(2, 101), "Number of steps of a scale").expecting("a number of steps, {}"),
]]);
pub(super) static ANALYSIS: Table =
    Table::of(&[&[required("measures", Form::List(&Form::Text), "Names of measures").expecting("a list of names such as [\"task_time_s\"]")]]);
pub(super) static OPERATOR: Table = Table::of(&[&[
    usual("move", Form::PositiveDuration, "\"250ms\"", "Least duration of a movement"),
    usual("visual-delay", Form::PositiveDuration, "\"200ms\"", "Time from an image to its use by the person"),
    usual("reaction", Form::Duration, "\"250ms\"", "Time until the first movement"),
    usual("noise", number(Quantity::not_negative("")), "0.1", "Standard deviation of the end of a movement, over the length of the movement"),
    usual("crossover", number(Quantity::positive("rad/s")), "3", "Velocity of the hand over the seen error, of a person who tracks"),
]]);
pub(super) const ORDERS: Choices<Order, 3> = [
    ("given", Order::Given, "the order of the file, for every group"),
    ("shuffled", Order::Shuffled, "an order of its own for every group"),
    ("williams", Order::Williams, "the rows of a Williams design, in turn"),
];
pub(super) const AFTER: Choices<After, 3> = [
    ("trial", After::Trial, "after each analysed trial that is valid"),
    ("condition", After::Condition, "after the last trial of each condition"),
    ("study", After::Study, "at the end of the session"),
];
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Kind {
    Tlx,
    Scale,
}
pub(super) const KINDS: Choices<Kind, 2> =
    [("tlx", Kind::Tlx, "the six scales of the NASA Task Load Index, without weights"), ("scale", Kind::Scale, "one scale with equal steps")];
