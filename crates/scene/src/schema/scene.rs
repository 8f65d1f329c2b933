//! The keys of a scene.

use cohaptic_peer::Coordination;
use cohaptic_peer::coordination::{LawForm, LawParameter, LawValues};
use cohaptic_wan::DropCause;
use cohaptic_wan::parameters::Quantity;

use cohaptic_linkfile::schema::{
    Form, Key, Table, joined,
    link::{ALL_LINKS, LINK, LINK_ENTRY, LINK_TABLE, LINKS_BETWEEN, MODULATOR},
    number, optional, required, somewhere, usual, vector,
};

use crate::measures::{Measure, Scope};
use crate::quantities::{
    ADDED_MASS, ANGLE, ANGLE_BOUND, COMPONENT, DAMPING, DISTANCE, ENERGY, FORCE, FREQUENCY, IMPEDANCE, INERTIA, MASS, POSITION, POSITIVE_COUNTS,
    POSITIVE_FORCE, RATE, ROTATIONAL_DAMPING, ROTATIONAL_STIFFNESS, STIFFNESS, TORQUE, VELOCITY, WALL_STIFFNESS,
};

const MOST: u64 = i64::MAX.unsigned_abs();

/// The top of a scene.
pub(super) static ROOT: Table = Table::of(&[&[
    required("scene", Form::Table(&SCENE), "How long the scene lasts, its seed and its axes"),
    required("object", Form::Table(&OBJECT), "The shared virtual object, of which every peer has a copy"),
    required("coordination", Form::Table(&COORDINATION), "How the copies are kept together"),
    optional("simulation", Form::Table(&SIMULATION), "How motion between ticks is computed"),
    optional("peer", Form::Table(&PEER_TABLE), "Holds for every peer that does not say otherwise"),
    optional("peers", Form::List(&Form::Table(&PEERS)), "One peer each: its own keys are laid over those of [peer]"),
    optional("topology", Form::Table(&TOPOLOGY), "The peers to which each peer sends"),
    optional("modulators", Form::List(&Form::Table(&MODULATOR)), "Chains of states that links follow"),
    optional("link", Form::Table(&LINK_TABLE), "Holds for every link that does not say otherwise; without it links are ideal"),
    optional("links", Form::List(&Form::Table(&LINK_ENTRY)), "One direction of one pair each: its own keys are laid over those of [link]"),
    optional("timeline", Form::List(&Form::Table(&TIMELINE)), "Changes while the scene runs"),
    optional("measure", Form::Table(&MEASURE), "Numbers that sum a run up, computed while it runs"),
    optional("expect", Form::Table(&EXPECT), "The result that must come out: makes the scene a test for cohaptic check"),
]]);

static SCENE: Table = Table::of(&[&[
    optional("title", Form::Text, "A line for people; without it the name of the file"),
    required("duration", Form::Duration, "How long the scene lasts, above zero"),
    usual("seed", Form::Integer(0, MOST), "0", "Seed of all random numbers"),
    usual("axes", Form::Integer(1, 3), "1", "How many translational axes: x, then y, then z"),
    optional(
        "count",
        Form::Integer(2, 1_000_000),
        "The number of equal peers, named peer1, peer2 and so on; entries [[peers]] may change some of them",
    ),
]]);

static OBJECT: Table = Table::of(&[&[
    required("mass", number(MASS), "Mass of the whole object"),
    usual("damping", number(DAMPING), "0", "Viscous damping of each copy"),
    usual("split-mass", Form::Boolean, "true", "Whether each of N copies has the mass divided by N, or all of it"),
    usual("position", vector(POSITION), "0", "Where copies and devices begin"),
    usual("velocity", vector(VELOCITY), "0", "With which velocity copies and devices begin"),
    optional("enclosure", Form::Table(&ENCLOSURE), "Walls that limit the travel of every copy"),
    optional(
        "inertia",
        vector(INERTIA),
        "Principal moments of inertia of the whole object, which turns then; none above the sum of the others; needs three axes",
    ),
    optional(
        "rotational-damping",
        vector(ROTATIONAL_DAMPING),
        "Viscous damping of the turn of each copy; without it damping times inertia over mass",
    ),
    usual("orientation", QUATERNION, "[1, 0, 0, 0]", "Quaternion w, x, y, z of any length with which copies and devices begin"),
    usual("angular-velocity", vector(RATE), "0", "Angular velocity in their own axes with which they begin"),
]]);
static ENCLOSURE: Table = Table::of(&[&[
    required("min", vector(POSITION), "The lower end on each axis"),
    required("max", vector(POSITION), "The upper end on each axis"),
    required("stiffness", number(WALL_STIFFNESS), "Stiffness of the walls"),
    required("damping", number(DAMPING), "Damping of the walls"),
]]);

static COORDINATION: Table = Table::of(&[&GAINS_OF_ALL, LAWS.split_at(count_laws(false)).0]);
const GAINS_OF_ALL: [Key; 9] = [
    required("strategy", Form::Words(&STRATEGIES), "Where each copy is drawn to"),
    required("stiffness", number(STIFFNESS), "Gain on the difference of positions, K_T"),
    usual("damping", number(DAMPING), "0", "Gain on the difference of velocities, B_T"),
    required("update", Form::Duration, "How often each peer sends a sample; a whole multiple of every peer's tick"),
    optional("send-when", Form::Table(&SEND_WHEN), "Which of these samples are sent; without it all"),
    usual("scaling", Form::Words(&SCALINGS), "\"none\"", "How both gains follow the number of peers"),
    usual("pull", Form::Words(&PULLS), "\"mean\"", "Whether both gains count once, or once for each other peer"),
    optional(
        "rotational-stiffness",
        vector(ROTATIONAL_STIFFNESS),
        "Gain on turns between copies, K_R; none above the sum of the others; without it K_T times inertia over mass",
    ),
    optional(
        "rotational-damping",
        vector(ROTATIONAL_DAMPING),
        "Gain on the difference of angular velocities, B_R; without it B_T times inertia over mass",
    ),
];
static SEND_WHEN: Table = Table::of(&[&[
    optional("velocity", Form::Probability, "The velocity differs from the one sent last by this part of its size, below 100%"),
    optional("position", number(DISTANCE), "The copy is that far from where receivers hold it"),
    optional("heartbeat", Form::Duration, "That much time has passed since the last sample"),
]]);
const PULLS: [(&str, &str); 2] = [("mean", "once"), ("sum", "times N-1 among N peers; average-position is proportional-derivative then")];
const STRATEGIES: [(&str, &str); Coordination::ALL.len()] = {
    let mut words = [("", ""); Coordination::ALL.len()];
    let mut place = 0;
    while place < words.len() {
        words[place] = (Coordination::ALL[place].name(), Coordination::ALL[place].about());
        place += 1;
    }
    words
};

const fn form_of(form: LawForm) -> Form {
    match form {
        LawForm::Duration => Form::Duration,
        LawForm::AutomaticDuration => Form::AnyOf(const { &[Form::Words(&AUTOMATIC), Form::Duration] }),
        LawForm::AutomaticDamping => Form::AnyOf(const { &[Form::Words(&AUTOMATIC), number(DAMPING)] }),
        LawForm::Damping => number(DAMPING),
        LawForm::Impedance => number(IMPEDANCE),
        LawForm::Energy => number(ENERGY),
        LawForm::Words(words) => Form::Words(words),
        LawForm::Peer => Form::Text,
    }
}
const AUTOMATIC: [(&str, &str); 1] = [("auto", "as the links of the scene ask for")];

/// The parameters that a strategy has of its own, of all or of those that the timeline may change: how many of them each has.
const fn count_parameters(law: usize, changing: bool) -> usize {
    let parameters = Coordination::ALL[law].parameters();
    let (mut place, mut count) = (0, 0);
    while place < parameters.len() {
        if !changing || parameters[place].can_change {
            count += 1;
        }
        place += 1;
    }
    count
}

/// How many strategies have such parameters.
const fn count_laws(changing: bool) -> usize {
    let (mut law, mut count) = (0, 0);
    while law < Coordination::ALL.len() {
        if count_parameters(law, changing) > 0 {
            count += 1;
        }
        law += 1;
    }
    count
}

/// Declares the key of a table for each strategy that has such parameters, one after another: the first ones of `$laws` are used.
macro_rules! law_tables {
    ($changing:literal, $about:literal, $keys:ident, $groups:ident, $tables:ident, $laws:ident) => {
        /// The keys of each strategy, by its place in the registry; the first ones of a row are used.
        static $keys: [[Key; LawValues::MOST]; Coordination::ALL.len()] = {
            let mut keys = [const { [const { optional("", Form::Duration, "") }; LawValues::MOST] }; Coordination::ALL.len()];
            let mut law = 0;
            while law < keys.len() {
                let parameters = Coordination::ALL[law].parameters();
                let (mut place, mut count) = (0, 0);
                while place < parameters.len() {
                    let LawParameter { key, form, default, about, can_change } = parameters[place];
                    if !$changing || can_change {
                        keys[law][count] = if $changing {
                            optional(key, form_of(form.without_automatic()), "From then on")
                        } else if default.is_empty() {
                            optional(key, form_of(form), about)
                        } else {
                            usual(key, form_of(form), default, about)
                        };
                        count += 1;
                    }
                    place += 1;
                }
                law += 1;
            }
            keys
        };
        static $groups: [[&[Key]; 1]; Coordination::ALL.len()] = {
            let mut groups: [[&[Key]; 1]; Coordination::ALL.len()] = [[&[]]; Coordination::ALL.len()];
            let mut law = 0;
            while law < groups.len() {
                groups[law] = [$keys[law].split_at(count_parameters(law, $changing)).0];
                law += 1;
            }
            groups
        };
        static $tables: [Table; Coordination::ALL.len()] = {
            let mut tables = [const { Table::of(&[]) }; Coordination::ALL.len()];
            let mut law = 0;
            while law < tables.len() {
                tables[law] = Table::of(&$groups[law]);
                law += 1;
            }
            tables
        };
        static $laws: [Key; Coordination::ALL.len()] = {
            let mut keys = [const { optional("", Form::Duration, "") }; Coordination::ALL.len()];
            let (mut law, mut count) = (0, 0);
            while law < Coordination::ALL.len() {
                if count_parameters(law, $changing) > 0 {
                    keys[count] = optional(Coordination::ALL[law].name(), Form::Table(&$tables[law]), $about);
                    count += 1;
                }
                law += 1;
            }
            keys
        };
    };
}
law_tables!(false, "Own parameters", LAW_KEYS, LAW_GROUPS, LAW_TABLES, LAWS);
law_tables!(true, "Own parameters", CHANGING_KEYS, CHANGING_GROUPS, CHANGING_TABLES, CHANGING_LAWS);

const SCALINGS: [(&str, &str); 2] = [("none", "as they are written"), ("inverse-n", "times 4(N-1)/N^2 among N peers; of a coupling times 2/N")];

static SIMULATION: Table = Table::of(&[&[
    usual("integrator", Form::Words(&INTEGRATORS), "\"exact\"", "How motion between ticks is computed"),
    usual("substeps", Form::Integer(1, u32::MAX as u64), "1", "Steps a tick; not with exact"),
    usual("rotation-steps", Form::Integer(1, 10_000), "1", "Steps of a turn in a tick, times substeps"),
]]);
const INTEGRATORS: [(&str, &str); 3] =
    [("exact", "the exact solution"), ("semi-implicit-euler", "the velocity first, then the position"), ("rk4", "Runge and Kutta's fourth order")];

const PEER: [Key; 21] = [
    somewhere("device", Form::Table(&DEVICE), "The haptic device"),
    somewhere("coupling", Form::Table(&COUPLING), "Spring and damper between device and copy; not needed where contact is none"),
    usual("contact", Form::AnyOf(const { &[Form::Words(&CONTACTS), Form::Table(&PUSH)] }), "\"grasp\"", "How the device touches the object"),
    usual("hand", HAND, "\"none\"", "What the user does: a constant force, a sine, a recorded file, or an arm that follows a motion"),
    usual("tick", Form::Duration, "\"1ms\"", "Period of the control loop"),
    usual("compute-delay", Form::Integer(0, 1), "0", "Ticks from computing a force to applying it"),
    usual("phase", Form::Integer(0, MOST), "0", "At which tick the first sample is sent, below coordination.update / tick"),
    optional("clock", Form::Table(&CLOCK), "How the peer's clock differs"),
    optional("position", vector(POSITION), "Where its copy and device begin; without it where the object does"),
    optional("velocity", vector(VELOCITY), "With which velocity they begin; without it that of the object"),
    optional("device-position", vector(POSITION), "Where its device begins, if not with its copy"),
    optional("device-velocity", vector(VELOCITY), "With which velocity its device begins, if not with that of its copy"),
    usual("grasp", vector(POSITION), "0", "Where the device grasps an object that turns, from its centre in its own axes"),
    optional("orientation", QUATERNION, "As of the object"),
    optional("angular-velocity", vector(RATE), "As of the object"),
    optional("uplink", Form::Table(&LINK_TABLE), "A line that all it sends passes before the links"),
    optional("downlink", Form::Table(&LINK_TABLE), "A line that all it receives passes after the links"),
    usual("kind", Form::Words(&KINDS), "\"simulated\"", "Where the peer lives in a live session"),
    optional("silence", Form::Table(&SILENCE), "When the pull of a peer that lives elsewhere fades"),
    optional("falcon", Form::Table(&FALCON), "Which device a peer of kind falcon has, and how its numbers are meant"),
    optional("pointer", Form::Table(&POINTER), "The arm through which a pointer pulls the device of a peer of kind pointer"),
];
static PEER_TABLE: Table = Table::of(&[&PEER]);
static PEERS: Table =
    Table::over(&[&[required("name", Form::Text, "Its name: unique, not all, without space and without . > / , and quotes")], &PEER]);
const KINDS: [(&str, &str); 4] = [
    ("simulated", "simulated here"),
    ("udp", "another program, which sends and receives samples"),
    ("falcon", "simulated here, with a Novint Falcon"),
    ("pointer", "simulated here, pulled by a mouse, a finger or a stick"),
];
const CONTACTS: [(&str, &str); 2] = [("grasp", "held both ways"), ("none", "not touched")];

static DEVICE: Table = Table::of(&[&[
    somewhere("mass", number(MASS), "Mass of the device"),
    usual("damping", number(DAMPING), "0", "Viscous damping of the device"),
    optional("inertia", vector(INERTIA), "Moments of inertia of a device with six degrees of freedom"),
    usual("rotational-damping", vector(ROTATIONAL_DAMPING), "0", "Viscous damping of its turn"),
]]);
static COUPLING: Table = Table::of(&[&[
    somewhere("stiffness", number(STIFFNESS), "Stiffness between device and copy, K_C"),
    usual("damping", number(DAMPING), "0", "Damping between device and copy, B_C"),
    usual("scaling", Form::Words(&SCALINGS), "\"none\"", "How all follow the number of peers"),
    optional(
        "rotational-stiffness",
        number(ROTATIONAL_STIFFNESS),
        "Stiffness between the turns of device and copy, K_CR; needed with device.inertia",
    ),
    usual("rotational-damping", number(ROTATIONAL_DAMPING), "0", "Damping between their turns, B_CR"),
]]);
static PUSH: Table = Table::of(&[&[required("push", Form::Words(&DIRECTIONS), "A finger that can push in that direction and cannot pull")]]);
const DIRECTIONS: [(&str, &str); 6] =
    [("+x", "to larger x"), ("-x", "to smaller x"), ("+y", "to larger y"), ("-y", "to smaller y"), ("+z", "to larger z"), ("-z", "to smaller z")];
static CLOCK: Table = Table::of(&[&[
    usual("offset", Form::Duration, "\"0s\"", "By how much its first tick is late"),
    usual("drift", DRIFT, "0", "How fast it runs: parts per million as text, or seconds gained in a second, at most 0.1 either way"),
]]);
const DRIFT: Form = Form::AnyOf(&[Form::Like(&["20ppm", "-20ppm"]), Form::Number(Quantity::any(""))]);
static SILENCE: Table = Table::of(&[&[
    usual("after", Form::Duration, "\"100ms\"", "After how long a silence the pull fades"),
    usual("fade", Form::Duration, "\"250ms\"", "How long that takes"),
]]);
static POINTER: Table = Table::of(&[&[
    usual("stiffness", number(STIFFNESS), "400", "Stiffness of the arm between pointer and device"),
    usual("damping", number(DAMPING), "20", "Its damping"),
    usual("force-limit", number(POSITIVE_FORCE), "20", "The arm pulls with no greater force"),
    usual("held", Form::Boolean, "false", "Whether the pointer holds the device from the beginning"),
]]);
static FALCON: Table = Table::of(&[&[
    usual("device", Form::Like(&["first", "simulated"]), "\"first\"", "The first that no other peer has, one that is simulated, or a serial number"),
    usual("counts-per-newton-metre", number(POSITIVE_COUNTS), "10000", "Motor counts for a torque at the joint of an arm"),
    usual("force-limit", number(POSITIVE_FORCE), "4", "No greater force is sent to the motors"),
    usual("origin", Form::Triple(POSITION), "[0, 0, 0.125]", "The place in the device's coordinates that is the origin of the scene"),
]]);

const HAND: Form = Form::AnyOf(&[Form::Words(&[("none", "nothing; takes away what [peer] says")]), Form::Table(&HAND_TABLE)]);
static HAND_TABLE: Table = Table::of(&[&[
    optional("force", vector(FORCE), "A constant force"),
    optional("sine", Form::Table(&FORCE_SINE), "A force that sways"),
    optional("file", Form::File, "A recorded force: a CSV with the header t,fx (and fy, fz, then tx,ty,tz), in s, N and N·m"),
    optional("arm", Form::Table(&ARM), "An arm that adds its mass to the device and holds it with a damper and a spring"),
    optional("follows", Form::Table(&FOLLOWS), "Beside arm: the motion that it wants; without it to rest at 0"),
    optional("torque", vector(TORQUE), "A constant torque on a device that turns, in world axes"),
]]);
static FORCE_SINE: Table = Table::of(&[
    &[required("amplitude", vector(FORCE), "Amplitude")],
    &SINE,
    &[optional("torque", vector(TORQUE), "Amplitude of a torque that sways with it")],
]);
static MOTION_SINE: Table = Table::of(&[&[required("amplitude", vector(POSITION), "Amplitude")], &SINE]);
const SINE: [Key; 2] = [
    required("frequency", number(FREQUENCY), "Frequency, below half the rate of ticks"),
    usual("phase", number(ANGLE), "0", "Phase at the beginning of the scene"),
];
static ARM: Table = Table::of(&[&[
    required("mass", number(ADDED_MASS), "Mass that the arm adds to the device"),
    required("damping", number(DAMPING), "Damping of the arm"),
    required("stiffness", number(STIFFNESS), "Stiffness of the arm"),
]]);
static FOLLOWS: Table = Table::of(&[&[
    optional("position", vector(POSITION), "A constant position"),
    optional("sine", Form::Table(&MOTION_SINE), "A position that sways"),
    optional("file", Form::File, "A recorded motion: a CSV with the header t,x (and y, z, then tx,ty,tz), in s, m and N·m"),
]]);

static TIMELINE: Table = Table::of(&[&[
    required("at", Form::Duration, "When, from the beginning of the scene"),
    optional("link", LINKS_BETWEEN, "Which links change: all, or one by its ends"),
    optional("peer", Form::Text, "The name of the peer that changes"),
    optional("set", Form::Table(&SET), "The keys that change: of the link, or contact and hand of the peer"),
    optional("coordination", Form::Table(&CHANGES), "In place of link or peer, and without set: what changes at every peer"),
]]);
/// The key of a link or of a peer that is set: another key says which of the two.
static SET: Table = Table::over(&joined::<16>(&[LINK.as_slice(), &[&SET_OF_PEER]]));
const SET_OF_PEER: [Key; 2] = [
    optional("contact", Form::AnyOf(const { &[Form::Words(&CONTACTS), Form::Table(&PUSH)] }), "Of a peer: how the device touches the object"),
    optional("hand", HAND, "Of a peer: what the user does"),
];
static CHANGES: Table = Table::of(&[&CHANGES_OF_ALL, CHANGING_LAWS.split_at(count_laws(true)).0]);
const CHANGES_OF_ALL: [Key; 5] = [
    optional("stiffness", number(STIFFNESS), "Gain on the difference of positions; without it as it was"),
    optional("damping", number(DAMPING), "Gain on the difference of velocities; without it as it was"),
    optional("rotational-stiffness", vector(ROTATIONAL_STIFFNESS), "Gain on turns; without it as it was"),
    optional("rotational-damping", vector(ROTATIONAL_DAMPING), "Gain on angular velocities; without it as it was"),
    optional("send-when", Form::Table(&SEND_WHEN), "Which samples are sent; without it as it was"),
];

static TOPOLOGY: Table = Table::of(&[&[
    usual("kind", Form::Words(&TOPOLOGIES), "\"full\"", "The neighbours of a peer"),
    optional("neighbours", Form::Integer(2, u16::MAX as u64), "Of a ring: how many, an even number; without it 2"),
    optional("hub", Form::Text, "Of a star: the name of a peer; without it the first"),
    optional("role", Form::Words(&HUB_ROLES), "Of the hub; without it peer"),
    optional("file", Form::File, "Of a graph: mutual weights, a row a peer"),
]]);
const TOPOLOGIES: [(&str, &str); 4] = [
    ("full", "all others"),
    ("ring", "half before it, half behind it"),
    ("star", "the hub, or all others of the hub"),
    ("graph", "those with a weight above 0"),
];
const HUB_ROLES: [(&str, &str); 2] = [("peer", "has a copy"), ("relay", "no peer: hands samples on")];

static MEASURE: Table = Table::of(&[&[
    usual("names", Form::AnyOf(const { &[Form::Words(&[("all", "every measure")]), Form::List(&MEASURE_NAME)] }), "\"all\"", "Which measures"),
    optional("travel", Form::Table(&MEASURE_TRAVEL), "What travel_s is about"),
    usual("band", number(DISTANCE), "0.001", "Above this discrepancy the copies are not settled, for settling_s"),
    optional("probe", Form::Table(&PROBE), "Whose hand meets the impedance of viscosity_n_s_m and effective_mass_kg, which have no value without it"),
]]);
/// Words for the measures of a run, and an example for those of a peer.
const MEASURE_NAME_FORM: Form = Form::AnyOf(&[Form::Words(&MEASURES), Form::Like(&["peers.left.energy_j"])]);
static MEASURE_NAME: Form = MEASURE_NAME_FORM;
const MEASURES_OF_RUN: usize = {
    let (mut place, mut count) = (0, 0);
    while place < Measure::ALL.len() {
        if matches!(Measure::ALL[place].scope(), Scope::Run) {
            count += 1;
        }
        place += 1;
    }
    count
};
const MEASURES: [(&str, &str); MEASURES_OF_RUN] = {
    let mut words = [("", ""); MEASURES_OF_RUN];
    let (mut place, mut count) = (0, 0);
    while place < Measure::ALL.len() {
        if matches!(Measure::ALL[place].scope(), Scope::Run) {
            words[count] = (Measure::ALL[place].name(), Measure::ALL[place].about());
            count += 1;
        }
        place += 1;
    }
    words
};
static MEASURE_TRAVEL: Table = Table::of(&[&[
    optional("peer", Form::Text, "The name of the peer whose copy is meant; without it the first"),
    usual("distance", number(DISTANCE), "0.02", "How far from where it began"),
    usual("axis", Form::Words(&AXES), "\"x\"", "Along which axis"),
]]);
static PROBE: Table = Table::of(&[&[required("peer", Form::Text, "The name of a peer whose hand is a sine from the beginning to the end")]]);

static EXPECT: Table = Table::of(&[&[
    optional("stable", Form::Boolean, "Whether a small disturbance dies out"),
    optional("discrepancy", Form::Table(&METRES), "The largest distance along an axis between two copies"),
    optional("position", Form::List(&Form::Table(&EXPECT_POSITION)), "Where copies are at some time"),
    optional("travel", Form::List(&Form::Table(&EXPECT_TRAVEL)), "When copies have first moved so far"),
    optional("loss", Form::List(&Form::Table(&EXPECT_LOSS)), "Which fraction of what was offered was dropped"),
    optional("delay", Form::List(&Form::Table(&EXPECT_DELAY)), "The mean delay of what was delivered"),
    optional("measures", Form::List(&Form::Table(&EXPECT_MEASURE)), "The values of measures"),
    optional("rotation-discrepancy", Form::Table(&RADIANS), "The largest angle between two copies"),
    optional("orientation", Form::List(&Form::Table(&EXPECT_ORIENTATION)), "How copies are turned at some time"),
]]);
static RADIANS: Table = Table::of(&[&[optional("min", number(ANGLE_BOUND), "At least"), optional("max", number(ANGLE_BOUND), "At most")]]);
static EXPECT_ORIENTATION: Table = Table::of(&[&[
    required("peer", Form::Text, "The name of a peer"),
    required("at", Form::Duration, "When, from the beginning of the scene"),
    required("of", QUATERNION, "A quaternion w, x, y, z of any length"),
    required("max", number(ANGLE_BOUND), "The largest angle between the two"),
]]);
const QUATERNION: Form = Form::List(&number(COMPONENT));
static METRES: Table = Table::of(&[&METRE_BOUNDS]);
const METRE_BOUNDS: [Key; 2] = [optional("min", number(POSITION), "At least"), optional("max", number(POSITION), "At most")];
const TIME_BOUNDS: [Key; 2] = [optional("min", Form::Duration, "At least"), optional("max", Form::Duration, "At most")];
const FRACTION_BOUNDS: [Key; 2] = [optional("min", Form::Probability, "At least"), optional("max", Form::Probability, "At most")];
const OF_PEER: [Key; 2] = [required("peer", Form::Text, "The name of a peer"), usual("axis", Form::Words(&AXES), "\"x\"", "Along which axis")];
const AXES: [(&str, &str); 3] = [("x", "the first"), ("y", "the second"), ("z", "the third")];
static EXPECT_POSITION: Table = Table::of(&[&OF_PEER, &[required("at", Form::Duration, "When, from the beginning of the scene")], &METRE_BOUNDS]);
static EXPECT_TRAVEL: Table = Table::of(&[&OF_PEER, &[required("distance", number(DISTANCE), "How far from where it began")], &TIME_BOUNDS]);
const LINK_OR_LINE: [Key; 1] = [usual(
    "link",
    Form::AnyOf(const { &[Form::Words(ALL_LINKS), Form::Table(&SELECTOR)] }),
    "\"all\"",
    "Which link: all, one by its ends, or an access line",
)];
static SELECTOR: Table = Table::of(&[&[
    optional("from", Form::Text, "The name of the peer that sends"),
    optional("to", Form::Text, "The name of the peer that receives"),
    optional("uplink", Form::Text, "In place of both: the uplink of this peer"),
    optional("downlink", Form::Text, "In place of both: the downlink of this peer"),
]]);
static EXPECT_LOSS: Table =
    Table::of(&[&LINK_OR_LINE, &[optional("cause", Form::Words(&CAUSES), "Dropped for this cause; without it for any")], &FRACTION_BOUNDS]);
static EXPECT_DELAY: Table = Table::of(&[&LINK_OR_LINE, &TIME_BOUNDS]);
static EXPECT_MEASURE: Table = Table::of(&[&[
    required("name", MEASURE_NAME_FORM, "The name of the measure, which ends in its unit"),
    optional("min", Form::Number(Quantity::any("")), "At least"),
    optional("max", Form::Number(Quantity::any("")), "At most"),
]]);
const CAUSES: [(&str, &str); DropCause::ALL.len()] = {
    let mut causes = [("", "dropped for this cause"); DropCause::ALL.len()];
    let mut place = 0;
    while place < causes.len() {
        causes[place].0 = DropCause::ALL[place].name();
        place += 1;
    }
    causes
};
