//! Reader of `hand.operator` of a peer: the model of a person who does the task of the scene.

use core::time::Duration;

use cohaptic_linkfile::document::{Node, quote};
use cohaptic_linkfile::mesh::read_peer_name;
use cohaptic_linkfile::reading::{Context, TableReader, values};
use cohaptic_linkfile::schema::{Choices, Form, Table, number, optional, usual, words};
use cohaptic_peer::operator::{MovesConfig, OperatorConfig, OperatorLaw, Seen};
use cohaptic_peer::{ArmConfig, Hand};
use cohaptic_units::Probability;
use cohaptic_units::print::{Counted, Span};

use crate::context::SceneContext;
use crate::quantities::{ADDED_MASS, DAMPING, DISTANCE, FACTOR, FREQUENCY_LIMIT, SPEED_LIMIT, STIFFNESS};

pub(super) static OPERATOR: Table = Table::of(&[&[
    optional("law", Form::Words(const { &words(&LAWS) }), "Law of the hand; crossover for a task of kind track, and moves for every other kind"),
    optional("arm", Form::Table(&ARM), "Arm of the person, which holds the device"),
    usual(
        "sees",
        Form::AnyOf(const { &[Form::Words(&words(&SEEN)), Form::Like(&["left"])] }),
        "\"own\"",
        "Copy of the object that the person sees: own, or the newest sample that this peer holds of another peer",
    ),
    usual("visual-delay", Form::Duration, "\"200ms\"", "Time from an image to its use by the person, at most 10,000 ticks"),
    usual("reaction", Form::Duration, "\"250ms\"", "Time until the first movement, and wait after a movement of which nothing came through"),
    usual("move", Form::PositiveDuration, "\"250ms\"", "Least duration of a movement"),
    optional("speed", number(SPEED_LIMIT), "Largest speed at the peak of a movement; any speed by default"),
    optional("step", number(DISTANCE), "Largest length of a movement; any length by default"),
    usual("noise", number(FACTOR), "0.1", "Standard deviation of the end of a movement along each axis, over the length of the movement"),
    usual(
        "learns",
        Form::Probability,
        "0.2",
        "Weight of the newest movement in the estimated gain between hand and object; 0 for a gain of 1, without surprise",
    ),
    usual(
        "expects",
        Form::AnyOf(&[Form::Words(&[("auto", "nothing with sees = own, else the mean delays of both ways")]), Form::Duration]),
        "\"auto\"",
        "Delay of the seen copy that the person expects, and waits for after each movement; auto for none with the own copy, and else the mean delays of both ways",
    ),
    usual("crossover", number(FREQUENCY_LIMIT), "3", "Velocity of the hand over the seen error, for the law crossover"),
]]);
static ARM: Table = Table::of(&[&[
    usual("mass", number(ADDED_MASS), "0.5", "Mass of the arm, which moves with the device"),
    usual("damping", number(DAMPING), "20", "Damping towards the wanted motion"),
    usual("stiffness", number(STIFFNESS), "300", "Stiffness towards the wanted motion"),
]]);
const LAWS: Choices<Law, 2> = [
    ("moves", Law::Moves, "movements toward a target at rest, one after the other"),
    ("crossover", Law::Crossover, "continuous tracking of a moving target"),
];
const SEEN: Choices<Seen, 1> = [("own", Seen::Own, "the copy of this peer")];
/// Keys of a single law.
const OF_LAWS: [(&str, Law); 8] = [
    ("reaction", Law::Moves),
    ("move", Law::Moves),
    ("speed", Law::Moves),
    ("step", Law::Moves),
    ("noise", Law::Moves),
    ("learns", Law::Moves),
    ("expects", Law::Moves),
    ("crossover", Law::Crossover),
];
/// Kind of a task with a moving target.
const TRACK: &str = "track";
/// Largest visual delay in ticks. Bounds the memory of a mistyped delay.
const MOST_TICKS: u64 = 10_000;

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Law {
    Moves,
    Crossover,
}

/// Reads the model of a person, as a hand.
pub(super) fn read_operator(node: &Node, context: SceneContext<'_>) -> Option<Hand> {
    let mut table = TableReader::new(node, *context, &OPERATOR, "a table such as { visual-delay = \"200ms\", noise = 0.1 }")?;
    let law_node = table.get("law");
    let law = table.maybe("law", |node, context| values::word(node, context, &LAWS));
    let arm = table.table("arm", read_arm);
    let sees = table.read("sees", read_seen);
    let visual_delay = table.value("visual-delay");
    let moves = read_moves(&mut table);
    let frequency = table.value("crossover");
    let Some(task) = context.task else {
        context.fault_at(node, "an operator does the task of the scene, and the scene has none: expected a table [task] too");
        return None;
    };
    let law = law?.unwrap_or(if task == TRACK { Law::Crossover } else { Law::Moves });
    let refused = match law {
        Law::Moves if task == TRACK => Some("moves leads to a target at rest, and the target of track moves: expected \"crossover\"".to_owned()),
        Law::Crossover if task != TRACK => Some(format!("crossover follows a moving target, and the target of {task} rests: expected \"moves\"")),
        Law::Moves | Law::Crossover => None,
    };
    if let Some(refused) = refused {
        context.fault_at(law_node.unwrap_or(node), refused);
        return None;
    }
    let mut fits = true;
    for (key, of) in OF_LAWS {
        let (name, ..) = LAWS[usize::from(of == Law::Crossover)];
        fits &= table.only_if(law == of, key, &format!("only an operator of the law {name} takes this key")).is_some();
    }
    table.finish();
    let (moves, frequency) = (moves?, frequency?);
    let law = match law {
        Law::Moves => OperatorLaw::Moves(moves),
        Law::Crossover => OperatorLaw::Crossover { frequency },
    };
    fits.then_some(())?;
    Some(Hand::Operator { arm: arm?, operator: Box::new(OperatorConfig { sees: sees?, visual_delay: visual_delay?, law }) })
}

fn read_arm(node: &Node, context: Context<'_>) -> Option<ArmConfig> {
    let mut table = TableReader::new(node, context, &ARM, "a table such as { mass = 0.5, damping = 20.0, stiffness = 300.0 }")?;
    let (mass, damping, stiffness) = (table.value("mass"), table.value("damping"), table.value("stiffness"));
    table.finish();
    Some(ArmConfig { mass: mass?, damping: damping?, stiffness: stiffness? })
}

fn read_seen(node: &Node, context: Context<'_>) -> Option<Seen> {
    // A name of a peer is looked up only if the text is none of the words.
    match SEEN.iter().find(|(word, _, _)| node.as_text() == Some(word)) {
        Some((_, seen, _)) => Some(*seen),
        None => read_peer_name(node, context).map(Seen::Peer),
    }
}

fn read_moves(table: &mut TableReader<'_>) -> Option<MovesConfig> {
    let (reaction, duration) = (table.value("reaction"), table.value("move"));
    let (speed, step) = (table.maybe_value("speed"), table.maybe_value("step"));
    let (noise, learns): (_, Option<Probability>) = (table.value("noise"), table.value("learns"));
    let expects = table.read("expects", read_expected_delay);
    Some(MovesConfig {
        reaction: reaction?,
        duration: duration?,
        speed: speed?,
        step: step?,
        noise: noise?,
        learns: learns?.get(),
        expects: expects?,
    })
}

/// Reads a delay; `Some(None)` for "auto".
fn read_expected_delay(node: &Node, context: Context<'_>) -> Option<Option<Duration>> {
    match node.as_text() {
        Some("auto") => Some(None),
        // Without a digit the text is a mistyped "auto". The message for a duration alone would not name the word.
        Some(word) if !word.contains(|c: char| c.is_ascii_digit()) => {
            context.fault_at(node, format!("unknown word {}: expected auto, or a duration such as \"24ms\"", quote(word)));
            None
        }
        _ => values::duration(node, context).map(Some),
    }
}

/// Returns true if a peer with this tick can hold all that the person has not seen yet, otherwise false after a fault at `hand`, the node of the hand.
pub(super) fn remembers(operator: &OperatorConfig, tick: Duration, hand: &Node, context: Context<'_>) -> bool {
    let ticks = operator.visual_ticks(tick);
    if ticks > MOST_TICKS {
        let within = ["operator", "visual-delay"].iter().try_fold(hand, |node, key| node.as_table()?.get(key).map(|entry| &*entry.node));
        let message = format!(
            "{} are {}: expected at most {MOST_TICKS}, {}",
            Span(operator.visual_delay),
            Counted(ticks, "tick"),
            Span(tick.saturating_mul(u32::try_from(MOST_TICKS).unwrap_or(u32::MAX)))
        );
        context.fault_at(within.unwrap_or(hand), message);
    }
    ticks <= MOST_TICKS
}
