//! Stability in the mean square under random loss and random delay.
//!
//! With chance in the network the state of a frame is multiplied by a random matrix, z ← A·z. The scene is *stable in the mean square* if E z·zᵀ dies out for
//! every initial z. This holds if and only if the operator X ↦ E A·X·Aᵀ, or with a Markov chain V_j ↦ Σ p_ij·A_i·V_i·A_iᵀ, has a spectral radius below
//! 1 (Costa, Fragoso & Marques 2005, Theorem 3.9). A packet carries all axes of a sample, and every axis obeys the same equations, so the moments of
//! two axes have the operator of a single axis, and the radius equals the radius of a scene of one axis.
//!
//! Every sample enters a receiver's force only as the number KT·x + BT·v, so each link adds one state: this number of the sample held by the receiver. The
//! other combination of the held position and velocity exerts no force, but is part of the state. Its eigenvalue is the probability per frame of no
//! arrival (`held`).
//!
//! # How sure the radii are
//!
//! The bounds are proven (`positive`) for the operator with the step maps and probabilities as they are stored. The errors of the step maps' products are
//! counted among the roundings on the assumption that each term of a tick is rounded at most 48 times, coefficients included (`tracked`). Rounding errors
//! of the probabilities themselves, and numbers that underflow, are not counted.

pub(crate) mod arrivals;
mod build;
mod bursts;
mod equal;
mod events;
mod held;
mod law;
pub(crate) mod positive;
pub(crate) mod symmetric;
#[cfg(test)]
mod tests;
mod tracked;
mod variance;

use std::time::Duration;

use cohaptic_scene::Scene;

use self::arrivals::Hazards;
use self::build::{Line, events_watched, nanoseconds};
pub(crate) use self::equal::{Equal, EqualScratch};
use self::law::{LinkLaw, is_random};
use self::positive::{Positive, radius_watched};
use self::symmetric::Symmetric;
use crate::analysis::{CHANGES_LEFT_OUT, UNLOADED, arms_alone};
use crate::combinations::{Combination, pairs};
use crate::cost::{FrameCost, PASSES};
use crate::lifted::{Lifted, Node};
use crate::network::{LinkTiming, NominalNetwork};
use crate::parts::{PartKind, radius_of, reduced};
use crate::pieces::{refuse_operators, refuse_slow_devices, refuse_topology, split};
use crate::rounding::real;
use crate::structure::{Contacts, Structure, has_equal_clocks, linear_law};
use crate::timetable::{Instants, NodeClock, Timetable};
use crate::{AnalysisError, Limits, Matrix, Method, PartCost, Radius, Verdict, Watch};

/// Largest number of unknowns of the second moment, whatever the caller allows. More unknowns take minutes.
const MOST_UNKNOWNS: usize = 1 << 20;
/// Number of unknowns of the second moment up to which an analysis takes some seconds at most.
pub const QUICK_UNKNOWNS: usize = 1 << 17;
/// Largest number of `f64` in memory at once, one gibibyte. A step may copy all moments, which takes the same amount again.
const MOST_NUMBERS: usize = 1 << 27;
/// Largest number of peers for an analysis that treats each peer and link separately.
const MOST_PEERS: usize = 64;

/// Method by which the second moment of a scene was analysed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum MeanSquareMethod {
    /// No link is random. The radius of the second moment is the square of the radius of the motion.
    Nominal,
    /// Symmetry of equal peers over equal links with independent losses. The cost does not depend on the number of peers.
    Symmetric,
    /// Event by event over a frame, with separate states for each peer and each link.
    Events,
}

impl MeanSquareMethod {
    /// Returns the name of the method in JSON.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Nominal => "nominal",
            Self::Symmetric => "symmetric",
            Self::Events => "events",
        }
    }
}

/// The result of the analysis of the second moment of a scene.
#[derive(Clone, PartialEq, Debug)]
pub struct MeanSquare {
    /// Factor by which a frame multiplies the second moment of the relative motion in the long run. The scene is stable in the mean square if the factor is
    /// below 1.
    pub radius: Radius,
    /// Probability per frame, in the long run, of no arrival on a random link: the largest such probability over all random links. Only KT·x + BT·v of
    /// a held sample exerts a force. The rest stays until a sample arrives, so `radius` is at least this probability.
    pub held: Radius,
    /// Square of the spectral radius over a frame of the same scene without randomness: every delay is its mean and no packet is lost.
    pub nominal_squared: Radius,
    /// Method of the analysis. With several combinations of contacts: the method for the combination with the largest radius.
    pub method: MeanSquareMethod,
    /// Span over which the radii count.
    pub frame: Duration,
    /// Number of unknowns that describe the second moment; 0 with [`MeanSquareMethod::Nominal`].
    pub unknowns: usize,
    /// Sentences about the limits of the analysis, such as an ignored timeline.
    pub notes: Vec<String>,
}

impl MeanSquare {
    /// Returns the verdict on stability in the mean square, as far as `radius` and its error decide.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        self.radius.verdict()
    }
}

/// Returns the growth of the second moment of a scene in its initial configuration. The timeline is left out.
///
/// Losses may be independent among any number of equal peers, or among up to 64 different peers. Losses in bursts, and delays so random that samples
/// overtake, need the joint states of the chains of all links, which is feasible for two or three peers.
///
/// # Errors
///
/// [`AnalysisError`] as [`analyse`](crate::analyse); also if a link has a random impairment without a law of moments in this crate, or if the links have too
/// many joint states.
pub fn mean_square(scene: &Scene) -> Result<MeanSquare, AnalysisError> {
    mean_square_watched(scene, &Limits::of_unknowns(MOST_UNKNOWNS))
}

/// Like [`mean_square`], but within `limits`. The watcher of `limits` sees the progress and can end the analysis.
///
/// # Errors
///
/// As for [`mean_square`]; [`AnalysisError::TooManyOperations`] beyond the limit of operations, [`AnalysisError::Stopped`] if the watcher ends the analysis.
pub fn mean_square_watched(scene: &Scene, limits: &Limits<'_>) -> Result<MeanSquare, AnalysisError> {
    let limits = &Limits { unknowns: limits.unknowns.min(MOST_UNKNOWNS), ..*limits };
    refuse_topology(scene, "the mean square")?;
    refuse_operators(scene, "the mean square")?;
    refuse_slow_devices(scene, "the mean square")?;
    let pieces = split(scene).map_err(|why| AnalysisError::Turns { what: "the mean square", why })?;
    let network = NominalNetwork::of(scene)?;
    let mut notes = Vec::new();
    let mut combines = false;
    let mut found: Option<MeanSquare> = None;
    // Pieces move independently and contacts last in each combination, so the scene is as unstable as the worst pair.
    for (piece, combination) in pairs(&pieces, &mut combines)? {
        let one = of_contacts(&piece.scene, &network, &combination, limits, &mut notes)?;
        found = Some(match found {
            None => one,
            Some(before) => {
                let (radius, nominal_squared) = (before.radius.or(one.radius), before.nominal_squared.or(one.nominal_squared));
                let held = before.held.or(one.held);
                let larger = if one.radius.value > before.radius.value { one } else { before };
                MeanSquare { radius, held, nominal_squared, ..larger }
            }
        });
    }
    if combines {
        notes.push(format!("every combination of contacts is analysed as if it lasted; {CHANGES_LEFT_OUT}"));
    }
    if !scene.timeline.is_empty() {
        notes.push("the timeline is left out: the scene is analysed as it begins".to_owned());
    }
    if scene.rotation.is_some() {
        notes.push(UNLOADED.to_owned());
    }
    notes.extend(arms_alone(scene));
    notes.dedup();
    let none = MeanSquare {
        radius: NOTHING,
        held: NOTHING,
        nominal_squared: NOTHING,
        method: MeanSquareMethod::Nominal,
        frame: Duration::ZERO,
        unknowns: 0,
        notes: Vec::new(),
    };
    let found = found.unwrap_or(none);
    if found.held.value > 0.0 && found.held.value >= found.radius.value {
        notes.push("the radius is that of a held sample without force: it stays until the next one arrives, and moves nothing".to_owned());
    }
    Ok(MeanSquare { notes, ..found })
}

const NOTHING: Radius = Radius { value: 0.0, error: 0.0 };

/// Returns whether all links have the same model.
fn only_model(scene: &Scene) -> bool {
    scene.links.is_uniform()
}

fn of_contacts(
    scene: &Scene,
    network: &NominalNetwork,
    combination: &Combination,
    limits: &Limits<'_>,
    notes: &mut Vec<String>,
) -> Result<MeanSquare, AnalysisError> {
    let structure = Structure::of(&[scene], network, &combination.contacts)?;
    let parts = reduced(&structure, scene, combination.axes, Method::Reduced, limits.watch)?.parts;
    let nominal = radius_of(&parts);
    let frame = structure.timetable.frame;
    let nominal_squared = nominal.over(2);
    let random = random_links(scene)?;
    let nothing = Found { radius: nominal_squared, held: NOTHING, method: MeanSquareMethod::Nominal, frame, unknowns: 0 };
    let mut found = if random.is_empty() {
        nothing
    } else {
        // The cheap method first: symmetry describes all equal peers with a fixed number of unknowns, while `one_by_one` needs states for each link.
        match alike(scene, &structure).then(|| symmetric(scene, network, &structure, limits, notes)).transpose()?.flatten() {
            Some(found) => found,
            None => one_by_one(scene, network, &structure, &combination.contacts, &random, limits, notes)?,
        }
    };
    // No peer hears another then. Only the held samples are random, and the motion is as without chance.
    if structure.is_silent(scene) {
        found = Found { held: found.held, ..nothing };
    }
    // A device that touches nothing moves on its own and is in no operator. Its radius counts over the structure's frame, and a random frame may be a multiple
    // of that frame, hence the power.
    for part in parts.iter().filter(|part| matches!(part.kind, PartKind::LooseDevice { .. })) {
        let frames = found.frame.as_nanos() / frame.as_nanos().max(1);
        found.radius = found.radius.or(part.radius.over(u32::try_from(2 * frames).unwrap_or(u32::MAX)));
    }
    let Found { radius, held, method, frame, unknowns } = found;
    let radius = if random.is_empty() { radius } else { radius.or(held) };
    Ok(MeanSquare { radius, held, nominal_squared, method, frame, unknowns, notes: Vec::new() })
}

/// Returns the random links as pairs (sender, receiver). Among links of one model, the link from peer 0 to peer 1 stands for all.
fn random_links(scene: &Scene) -> Result<Vec<(usize, usize)>, AnalysisError> {
    let random = if only_model(scene) {
        if is_random(scene.links.between(0, 1)) { vec![(0, 1)] } else { Vec::new() }
    } else {
        let peers = scene.peers.len();
        if peers > MOST_PEERS {
            return Err(AnalysisError::TooManyMoments { joint: None, unknowns: None, most: MOST_UNKNOWNS });
        }
        let pairs = (0..peers).flat_map(|to| (0..peers).filter(move |from| *from != to).map(move |from| (from, to)));
        pairs.filter(|(from, to)| is_random(scene.links.between(*from, *to))).collect()
    };
    // All links of a peer share the peer's access line. Chance on the line correlates these links, but the operator takes their chains as independent.
    let access = |model: Option<&cohaptic_wan::LinkModel>| model.is_some_and(is_random);
    let queues = |model: Option<&cohaptic_wan::LinkModel>| model.is_some_and(|model| !model.is_constant_delay());
    if let Some(peer) = scene
        .peers
        .iter()
        .find(|peer| access(peer.uplink.as_deref()) || access(peer.downlink.as_deref()) || (!random.is_empty() && queues(peer.downlink.as_deref())))
    {
        return Err(AnalysisError::ChanceWithoutMoments {
            link: peer.name.clone(),
            why: "its access line ties what happens to several links together",
        });
    }
    Ok(random)
}

/// Returns the law of a random link, and the possible ticks of arrival; `None` if nothing ever arrives.
fn hazards(
    scene: &Scene,
    network: &NominalNetwork,
    (from, to): (usize, usize),
    frame: Duration,
    sends: &[u64],
    ticks: &[u64],
    notes: &mut Vec<String>,
) -> Result<Option<(Hazards, LinkLaw)>, AnalysisError> {
    let refuse = |why| AnalysisError::ChanceWithoutMoments { link: format!("{} → {}", scene.peers[from].name, scene.peers[to].name), why };
    let nominal = match network.timing(from, to) {
        LinkTiming::Constant(nominal) => nominal,
        LinkTiming::Pattern(pattern) if pattern.iter().all(Option::is_none) => return Ok(None),
        LinkTiming::Pattern(_) => return Err(refuse("its packets take different times even without chance")),
    };
    let law = LinkLaw::of(scene.links.between(from, to), *nominal).map_err(refuse)?;
    if law.is_silent() {
        return Ok(None);
    }
    let hazards = Hazards::new(nanoseconds(frame), sends, ticks, &law).ok_or_else(|| refuse("its delays have no end"))?;
    if hazards.spread && law.correlated_delays {
        return Err(refuse("its delays depend on each other"));
    }
    // With several places a sample can overtake an earlier sample. A link in order delays the overtaking sample, and `Arrival` does not describe this delay.
    if hazards.places > 1 && law.in_order {
        return Err(refuse("its samples wait for each other (order = \"in-order\")"));
    }
    if hazards.spread && law.cut {
        notes.push("delays outside the central 1 − 2·10⁻⁹ of their law count as at its ends".to_owned());
    }
    Ok(Some((hazards, law)))
}

/// Radii of one combination of contacts: of the moments with forces, and of the forceless held moments.
#[derive(Clone, Copy, Debug)]
struct Found {
    radius: Radius,
    held: Radius,
    method: MeanSquareMethod,
    frame: Duration,
    unknowns: usize,
}

impl Found {
    /// Computes the radius of `operator`. The watcher hears of `operations` operations per image of the operator.
    fn of(
        operator: &impl Positive,
        operations: f64,
        held: Radius,
        (method, frame): (MeanSquareMethod, Duration),
        watch: &dyn Watch,
    ) -> Result<Self, AnalysisError> {
        let unknowns = operator.unknowns();
        PartCost { states: unknowns, bytes: 8.0 * real(unknowns), operations: PASSES * operations }.begin(watch)?;
        let radius = radius_watched(operator, operations, watch).ok_or(AnalysisError::Stopped)?;
        Ok(Self { radius, held, method, frame, unknowns: operator.unknowns() })
    }
}

/// Probability per frame of no arrival on a link without any arrivals.
const SILENT: Radius = Radius { value: 1.0, error: 0.0 };

/// Instants of sending, and of possible arrivals, of equal peers over equal links.
struct Alike {
    /// Events of one peer, without deliveries.
    timetable: Timetable,
    instants: Instants,
    /// Hazards and law of every link; `None` if nothing ever arrives.
    hazards: Option<(Hazards, LinkLaw)>,
}

impl Alike {
    fn of(scene: &Scene, network: &NominalNetwork, notes: &mut Vec<String>) -> Result<Self, AnalysisError> {
        let timetable = Timetable::new(&[NodeClock::of(scene, 0)], &[])?;
        let instants = Instants::of(&timetable);
        let hazards = hazards(scene, network, (0, 1), timetable.frame, &instants.sends[0], &instants.ticks[0], notes)?;
        Ok(Self { timetable, instants, hazards })
    }

    /// Returns the hazards if losses are independent, no sample overtakes another, and the frame of one peer equals the frame of the scene.
    fn independent(&self, structure: &Structure) -> Option<&Hazards> {
        let (hazards, law) = self.hazards.as_ref()?;
        (hazards.places == 1 && law.chain.is_none() && self.timetable.frame == structure.timetable.frame).then_some(hazards)
    }

    /// Returns the probability per frame of no arrival on a link.
    fn held(&self, hazards: &Hazards) -> Radius {
        let line = Line { from: 0, to: 0, chance: Some((hazards.clone(), None)) };
        line.staying(&self.instants, self.timetable.frame).unwrap_or(NOTHING)
    }
}

/// Returns whether all peers and all links are equal, and a receiver uses one number of each sample.
fn alike(scene: &Scene, structure: &Structure) -> bool {
    structure.classes.len() == 1 && only_model(scene) && structure.sampling(scene).channels() == 1
}

/// Computes the radii of equal peers over equal links by symmetry; `None` if losses are not independent, or samples overtake.
fn symmetric(
    scene: &Scene,
    network: &NominalNetwork,
    structure: &Structure,
    limits: &Limits<'_>,
    notes: &mut Vec<String>,
) -> Result<Option<Found>, AnalysisError> {
    let alike = Alike::of(scene, network, notes)?;
    let (timetable, instants) = (&alike.timetable, &alike.instants);
    let frame = timetable.frame;
    let node = structure.node(scene, 0);
    let lifted = Lifted { timetable, ..structure.quotient(scene, std::slice::from_ref(&node)) };
    if alike.hazards.is_none() {
        // No peer hears another peer, so each peer moves alone, pulled towards the constant initial positions of all other peers. The pull ties the peer to the
        // ground.
        let alone = Lifted { tied: true, ..lifted };
        let operator = events_watched(&alone, &[], instants, limits.watch).ok_or(AnalysisError::Stopped)?;
        let cost = frame_cost(scene, timetable, 0);
        return Found::of(&operator, cost.of_a_pass(), SILENT, (MeanSquareMethod::Symmetric, frame), limits.watch).map(Some);
    }
    let Some(hazards) = alike.independent(structure) else {
        return Ok(None);
    };
    let operator = Symmetric::new(scene.peers.len(), &lifted, hazards);
    if operator.unknowns() > MOST_UNKNOWNS {
        return Err(AnalysisError::TooManyMoments { joint: Some(1), unknowns: Some(operator.unknowns()), most: MOST_UNKNOWNS });
    }
    Found::of(&operator, operator.operations(), alike.held(hazards), (MeanSquareMethod::Symmetric, frame), limits.watch).map(Some)
}

/// Method for the second moments of many scenes with different numbers, in one combination of contacts.
#[derive(Clone, Debug)]
pub(crate) enum Followed {
    /// No link is random: the radius is the square of the spectral radius of the motion.
    Certain,
    /// Equal peers over equal links with independent losses. `held` is the probability per frame of no arrival on a link.
    Equal { frame: Equal, held: f64 },
    /// [`mean_square`] for each scene, because no part of the computation is common to all scenes.
    Anew,
}

impl Followed {
    /// Chooses the method for all scenes with the same structure as `scene` and different numbers. `structure` holds the common classes of peers.
    ///
    /// # Errors
    ///
    /// The errors of [`mean_square`] that can be known before the computation.
    pub(crate) fn of(scene: &Scene, network: &NominalNetwork, structure: &Structure) -> Result<Self, AnalysisError> {
        if random_links(scene)?.is_empty() {
            return Ok(Self::Certain);
        }
        refuse_operators(scene, "the mean square")?;
        refuse_slow_devices(scene, "the mean square")?;
        Ok(Independent::of(scene, network, structure)?.map_or(Self::Anew, |Independent { timetable, hazards, held }| Self::Equal {
            frame: Equal::new(scene.peers.len(), timetable, &hazards),
            held: held.value,
        }))
    }
}

/// Arrivals among equal peers over equal links with independent losses, on which no sample overtakes another.
#[derive(Clone, Debug)]
pub struct Independent {
    /// Events of one peer, without deliveries.
    pub timetable: Timetable,
    /// Ticks at which samples of a link may arrive, with their probabilities.
    pub hazards: Hazards,
    /// Probability per frame that nothing arrives on a link.
    pub held: Radius,
}

impl Independent {
    /// Returns the arrivals of a scene; `None` if peers or links differ, no link is random, losses depend on each other, or samples overtake.
    ///
    /// # Errors
    ///
    /// The errors of [`mean_square`] for a random link without a law of moments.
    pub fn of(scene: &Scene, network: &NominalNetwork, structure: &Structure) -> Result<Option<Self>, AnalysisError> {
        if random_links(scene)?.is_empty() || !alike(scene, structure) {
            return Ok(None);
        }
        let alike = Alike::of(scene, network, &mut Vec::new())?;
        let hazards = alike.independent(structure).cloned();
        Ok(hazards.map(|hazards| Self { held: alike.held(&hazards), hazards, timetable: alike.timetable }))
    }
}

/// Computes the radii with separate states for each peer and each link. `random` lists the random links, or one of them if all links have the same model.
fn one_by_one(
    scene: &Scene,
    network: &NominalNetwork,
    structure: &Structure,
    contacts: &Contacts,
    random: &[(usize, usize)],
    limits: &Limits<'_>,
    notes: &mut Vec<String>,
) -> Result<Found, AnalysisError> {
    let peers = scene.peers.len();
    if peers > MOST_PEERS {
        return Err(AnalysisError::TooManyMoments { joint: None, unknowns: None, most: MOST_UNKNOWNS });
    }
    let clocks: Vec<NodeClock> = (0..peers).map(|place| NodeClock::of(scene, place)).collect();
    let all_random = only_model(scene);
    let pairs: Vec<(usize, usize)> = (0..peers).flat_map(|to| (0..peers).filter(move |from| *from != to).map(move |from| (from, to))).collect();
    let certain = pairs.iter().filter(|pair| !all_random && !random.contains(pair));
    let certain: Vec<(usize, usize, LinkTiming)> = certain.map(|(from, to)| (*from, *to, network.timing(*from, *to).clone())).collect();
    let timetable = Timetable::new(&clocks, &certain)?;
    let cost = frame_cost(scene, &timetable, pairs.len());
    // The joint states of the chains only add to this cost. Refusing here avoids building an operator that is refused afterwards.
    within(cost, limits)?;
    let instants = Instants::of(&timetable);
    let horizon = linear_law(scene, 0).and_then(|law| law.horizon);
    let beyond = horizon.is_some_and(|horizon| timetable.oldest() > horizon).then_some(BEYOND_HORIZON);
    // With different clocks the age of a sample includes their difference. Such an age may exceed the horizon or be negative.
    let apart = (horizon.is_some() && !has_equal_clocks(scene)).then_some(AGES_BY_CLOCKS);
    if let Some(why) = beyond.or(apart) {
        let link = format!("{} → {}", scene.peers[0].name, scene.peers[1].name);
        return Err(AnalysisError::ChanceWithoutMoments { link, why });
    }
    let (mut lines, mut held) = (Vec::new(), NOTHING);
    let mut tied = structure.tied;
    for (from, to) in pairs {
        if limits.watch.stops() {
            return Err(AnalysisError::Stopped);
        }
        if let Some((_, _, timing)) = certain.iter().find(|(one, other, _)| (*one, *other) == (from, to)) {
            // A link that never delivers leaves the receiver with a constant initial position. The resulting constant force needs no state.
            if !matches!(timing, LinkTiming::Pattern(pattern) if pattern.iter().all(Option::is_none)) {
                lines.push(Line { from, to, chance: None });
            }
            continue;
        }
        match hazards(scene, network, (from, to), timetable.frame, &instants.sends[from], &instants.ticks[to], notes)? {
            Some((hazards, law)) => {
                let depth = hazards.depth();
                let line = Line { from, to, chance: Some((hazards, law.chain)) };
                if let Some(stays) = line.staying(&instants, timetable.frame) {
                    if !within_horizon(horizon, timetable.frame, stays, depth) {
                        let link = format!("{} → {}", scene.peers[from].name, scene.peers[to].name);
                        return Err(AnalysisError::ChanceWithoutMoments { link, why: BEYOND_HORIZON });
                    }
                    held = held.or(stays);
                }
                lines.push(line);
            }
            // Nothing ever arrives: the constant initial position of the sender ties the receiver to the ground.
            None => {
                tied = true;
                held = SILENT;
            }
        }
    }
    let class_of = |peer: usize| structure.classes.iter().position(|class| class.contains(&peer)).unwrap_or(0);
    let nodes: Vec<Node> = (0..peers).map(|peer| structure.node(scene, class_of(peer))).collect();
    debug_assert_eq!(nodes.iter().map(|node| node.device.is_some()).collect::<Vec<_>>(), contacts.touching);
    let share = 1.0 / real(peers - 1);
    let weights = Matrix::from_fn(peers, peers, |row, column| if row == column { 0.0 } else { share });
    let quotient = structure.quotient(scene, &nodes);
    let lifted = Lifted { nodes: &nodes, weights: &weights, timetable: &timetable, tied, ..quotient };
    let operator = events_watched(&lifted, &lines, &instants, limits.watch).ok_or(AnalysisError::Stopped)?;
    let most = limits.unknowns;
    let joint = operator.joint().filter(|joint| *joint <= most);
    let unknowns = joint.map(|_| operator.unknowns());
    let Some((joint, unknowns)) = joint.zip(unknowns).filter(|(_, unknowns)| *unknowns <= most) else {
        return Err(AnalysisError::TooManyMoments { joint: operator.joint(), unknowns, most });
    };
    let cost = FrameCost { joint, sums: operator.sums(), ..cost };
    within(cost, limits)?;
    PartCost { states: cost.rows, bytes: 8.0 * cost.numbers(), operations: cost.operations() }.begin(limits.watch)?;
    let radius = radius_watched(&operator, cost.of_a_pass(), limits.watch).ok_or(AnalysisError::Stopped)?;
    Ok(Found { radius, held, method: MeanSquareMethod::Events, frame: timetable.frame, unknowns })
}

/// Largest probability, counted as zero, that a sample is held for longer than the horizon of an extrapolating law.
const NEVER: f64 = 1e-9;
const AGES_BY_CLOCKS: &str = "the strategy uses the ages of its samples by clocks that differ: expected one tick, offset and drift for all peers";

const BEYOND_HORIZON: &str = "its samples may be held for longer than the strategy extrapolates them: expected a longer horizon";

/// Returns whether a link delivers a newer sample before the held sample is older than `horizon` \[s\], except with a probability of at most [`NEVER`].
/// Samples of the link arrive within `depth` frames, and `stays` is the probability that nothing arrives in a frame. Without a horizon always true.
fn within_horizon(horizon: Option<f64>, frame: Duration, stays: Radius, depth: usize) -> bool {
    horizon.is_none_or(|horizon| {
        let frames = horizon / frame.as_secs_f64() - real(depth + 1);
        frames >= 0.0 && stays.value.powf(frames.floor()) <= NEVER
    })
}

/// Returns the cost of a frame with `links` random links, each of which delivers every sample. The joint states of the links' chains are not included.
fn frame_cost(scene: &Scene, timetable: &Timetable, links: usize) -> FrameCost {
    let peers = scene.peers.len().max(1);
    let sent: usize = timetable.sent.iter().sum();
    // Four rows per peer: position and velocity of its device and of its copy.
    let rows = 4 * peers + sent + timetable.depth.iter().sum::<usize>() + links;
    FrameCost { events: timetable.events.len() + sent / peers * links, rows, joint: 1, sums: 0 }
}

/// Refuses a computation with more operations than `limits` allow, or with more than [`MOST_NUMBERS`] numbers in memory.
fn within(cost: FrameCost, limits: &Limits<'_>) -> Result<(), AnalysisError> {
    let operations = cost.operations();
    if operations > limits.operations {
        return Err(AnalysisError::TooManyOperations { operations, most: limits.operations });
    }
    if cost.numbers() > real(MOST_NUMBERS) {
        let unknowns = cost.rows.checked_mul(cost.rows).and_then(|square| square.checked_mul(cost.joint));
        return Err(AnalysisError::TooManyMoments { joint: Some(cost.joint), unknowns, most: MOST_NUMBERS });
    }
    Ok(())
}
