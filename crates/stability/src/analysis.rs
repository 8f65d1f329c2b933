//! The verdict on a scene as it stands.

use std::time::Duration;

use cohaptic_peer::Contact;
use cohaptic_scene::{FromScene, Scene, Strategies, Topology};

use crate::cost::eigenvalue_operations;
use crate::full::{Trust, full_along};
use crate::network::NominalNetwork;
use crate::parts::{Part, Reduced, radius_of, reduced};
use crate::pieces::{self, Piece};
use crate::spectrum::bounded_radius;
use crate::structure::{Contacts, Structure, linear_law};
use crate::{AnalysisError, Graph, GraphError, Radius, Unwatched, Verdict, Watch, analyse_on_watched, turning};

/// How a verdict is reached.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Method {
    /// Peers that are equal are treated together: see [`Part`]. For scenes with the strategies of this workspace.
    #[default]
    Reduced,
    /// As [`Method::Reduced`], and where samples are on their way for frames, the roots of a small determinant instead of the eigenvalues of a large
    /// matrix. Chosen where the matrix would be large.
    Determinant,
    /// Unit vectors of the whole state are pushed through the code that simulates. For any linear strategy.
    Full,
}

impl Method {
    /// The word in JSON.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Reduced => "reduced",
            Self::Determinant => "determinant",
            Self::Full => "full",
        }
    }
}

/// The stability of a scene, as far as it is known.
#[derive(Clone, PartialEq, Debug)]
pub struct Analysis {
    /// The largest radius of all modes of contact, the rigid-body modes left out.
    pub radius: Radius,
    /// How many rigid-body modes were removed: displacements of everything together (with waves of each copy by itself), and of each device that touches nothing, per axis. Of the mode of
    /// contact with the largest radius; of an object that turns, of all its motions.
    pub rigid_modes: usize,
    /// How many states are left: of bodies, of forces that wait to be applied, and of samples that are held or in flight.
    pub dimension: usize,
    /// How it was reached.
    pub method: Method,
    /// The span that the radius is over: after it everything repeats.
    pub frame: Duration,
    /// One entry for a linear scene; one for each combination of open and closed contacts otherwise; and all this for each motion of an object that turns.
    pub modes: Vec<ContactMode>,
    /// What the verdict leaves out, in words.
    pub notes: Vec<String>,
}

impl Analysis {
    /// What the radius says.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        self.radius.verdict()
    }

    /// Whether the verdict is that of the worst of several combinations of contacts.
    #[must_use]
    pub fn combines_contacts(&self) -> bool {
        combines(&self.modes)
    }
}

/// Whether any motion has several modes of contact.
fn combines(modes: &[ContactMode]) -> bool {
    modes.windows(2).any(|pair| pair[0].motion == pair[1].motion)
}

/// A combination of contacts in which the scene is linear.
#[derive(Clone, PartialEq, Debug)]
pub struct ContactMode {
    /// Of an object that turns: the components of its motion that move so, apart from all others, in words; otherwise empty.
    pub motion: String,
    /// Which contacts are closed, in words; empty for a linear scene.
    pub contacts: String,
    /// The largest radius of its parts.
    pub radius: Radius,
    /// The parts that do not mix.
    pub parts: Vec<Part>,
    pub(crate) rigid_modes: usize,
    pub(crate) dimension: usize,
    pub(crate) frame: Duration,
}

/// Analyses the scene as it begins, with the strategy that it names; its timeline is left out.
///
/// # Errors
///
/// [`AnalysisError`] if the scene has no frame that repeats, or cannot be taken apart into linear scenes.
pub fn analyse(scene: &Scene, method: Method) -> Result<Analysis, AnalysisError> {
    analyse_watched(scene, method, &Unwatched)
}

/// [`analyse`], watched: it is asked between the parts of the scene, within frames and determinants, and between the vectors of [`Method::Full`].
///
/// # Errors
///
/// As for [`analyse`], and [`AnalysisError::Stopped`] if the watcher ends it.
pub fn analyse_watched(scene: &Scene, method: Method, watch: &dyn Watch) -> Result<Analysis, AnalysisError> {
    if let Some(topology) = &scene.topology {
        return on_topology(scene, topology, method, watch);
    }
    let equivalent = (0..scene.peers.len()).all(|peer| linear_law(scene, peer).is_some());
    let pieces = match pieces::split(scene) {
        Ok(pieces) if scene.rotation.is_none() || method != Method::Full => pieces,
        _ => return turning::analyse(scene, method, watch),
    };
    match method {
        // A strategy that cannot be taken apart goes the way of a user's own.
        _ if !equivalent => push_through(scene, Trust::Nothing, &FromScene, watch),
        Method::Full => push_through(scene, Trust::Linear, &FromScene, watch),
        Method::Reduced | Method::Determinant => {
            let network = NominalNetwork::of(scene)?;
            let modes = pairs(&pieces, &mut false)?.into_iter().map(|(piece, combination)| {
                if watch.stops() {
                    return Err(AnalysisError::Stopped);
                }
                let structure = Structure::of(&[&*piece.scene], &network, &combination.contacts)?;
                let reduced = reduced(&structure, &piece.scene, combination.axes, method, watch)?;
                Ok(of_parts(combination, reduced))
            });
            Ok(combine(modes.collect::<Result<_, AnalysisError>>()?, method, &network, scene))
        }
    }
}

/// Why a scene with a topology is refused.
pub(crate) fn on_this_topology(error: GraphError) -> AnalysisError {
    match error {
        GraphError::Analysis(error) => error,
        GraphError::Unequal { .. }
        | GraphError::Weight { .. }
        | GraphError::Alone { .. }
        | GraphError::Neighbours { .. }
        | GraphError::Irregular
        | GraphError::NotLinear => AnalysisError::OnTopology { why: error.to_string() },
    }
}

/// The analysis of a scene with a topology: that of its peers on a graph.
fn on_topology(scene: &Scene, topology: &Topology, method: Method, watch: &dyn Watch) -> Result<Analysis, AnalysisError> {
    match method {
        Method::Reduced => analyse_on_watched(&scene.without_topology(), &Graph::from(topology), watch).map_err(on_this_topology),
        Method::Full => Err(AnalysisError::Topology { what: "the method full" }),
        Method::Determinant => Err(AnalysisError::Topology { what: "the method determinant" }),
    }
}

/// [`analyse_watched`] about the rest that the constant forces and torques of the hands, and their arms, leave the object at: copies are then some way apart, and a
/// turn changes the moment of the forces. An object that does not turn moves about it as it does without.
///
/// # Errors
///
/// As [`analyse_watched`]; if hands do not stay as they are, and if nothing rests under what they do.
pub fn analyse_loaded(scene: &Scene, method: Method, watch: &dyn Watch) -> Result<Analysis, AnalysisError> {
    if scene.rotation.is_some() { turning::analyse_loaded(scene, watch) } else { analyse_watched(scene, method, watch) }
}

/// [`analyse_watched`] about the steady spin that constant torques of the hands drive about one axis of the world, near the attitude in which the object begins, and near
/// its angular velocity if it has one. The samples that copies hold are behind by their age, which brakes; the rate is the one at which torques make up for that and for
/// the damping.
///
/// # Errors
///
/// As [`analyse_watched`]; if the object does not turn, or nothing drives a steady spin.
pub fn analyse_spinning(scene: &Scene, watch: &dyn Watch) -> Result<Analysis, AnalysisError> {
    if scene.rotation.is_none() {
        return Err(AnalysisError::NoSpin { why: "the object has no inertia".to_owned() });
    }
    turning::analyse_spinning(scene, watch)
}

/// Analyses the scene by the general path, with strategies of the caller's own.
///
/// # Errors
///
/// As [`analyse`], and if a strategy is not linear or remembers what it does not show.
///
/// # Examples
///
/// ```
/// use cohaptic_peer::{Command, Context, Gains, Strategy};
/// use cohaptic_scene::{Scene, Strategies};
/// use cohaptic_stability::{Verdict, analyse_with};
///
/// /// Average position whose force follows with a lag: it remembers one number an axis.
/// struct Smoothed {
///     gains: Gains,
///     force: [f64; 3],
/// }
///
/// impl<const A: usize> Strategy<A> for Smoothed {
///     fn command(&mut self, context: &Context<'_, A>) -> Command<A> {
///         let (own, target) = (context.own, *context.held.mean());
///         for axis in 0..A {
///             let (distance, speed) = (own.position[axis] - target.position[axis], own.velocity[axis] - target.velocity[axis]);
///             let wanted = self.gains.stiffness * distance + self.gains.damping * speed;
///             self.force[axis] += 0.5 * (wanted - self.force[axis]);
///         }
///         Command { force: core::array::from_fn(|axis| self.force[axis]), target }
///     }
///
///     fn set_gains(&mut self, gains: Gains) {
///         self.gains = gains;
///     }
///
///     fn memory(&self) -> &[f64] {
///         &self.force[..A]
///     }
///
///     fn set_memory(&mut self, memory: &[f64]) {
///         self.force[..A].copy_from_slice(memory);
///     }
/// }
///
/// struct AllSmoothed;
///
/// impl Strategies for AllSmoothed {
///     type Strategy<const A: usize> = Smoothed;
///
///     fn strategy<const A: usize>(&self, scene: &Scene, _peer: usize) -> Smoothed {
///         Smoothed { gains: scene.coordination.gains, force: [0.0; 3] }
///     }
/// }
///
/// fn main() -> Result<(), Box<dyn std::error::Error>> {
///     let text = r#"
///         scene = { duration = "2s", count = 3 }
///         object.mass = 0.45
///         coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
///         peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
///         link.delay = "8ms"
///     "#;
///     let scene = Scene::parse(text, "three.toml".as_ref(), &[])?;
///     let analysis = analyse_with(&scene, &AllSmoothed)?;
///     println!("{:.9} within {:.1e}, {} states", analysis.radius.value, analysis.radius.error, analysis.dimension);
///     assert_eq!(analysis.verdict(), Verdict::Stable);
///     assert_eq!(analysis.dimension, 17 + 3); // a number for each peer more than without the lag
///     Ok(())
/// }
/// ```
pub fn analyse_with(scene: &Scene, strategies: &impl Strategies) -> Result<Analysis, AnalysisError> {
    pieces::refuse_turns(scene, "the analysis of a strategy of one's own")?;
    if whole(scene)?.iter().any(|combination| combination.axes != scene.axes.count()) {
        return Err(AnalysisError::MixedAxes);
    }
    push_through(scene, Trust::Nothing, strategies, &Unwatched)
}

/// The pieces, each with its combinations of contacts; `combines` becomes true if any has several.
pub(crate) fn pairs<'p, 's>(pieces: &'p [Piece<'s>], combines: &mut bool) -> Result<Vec<(&'p Piece<'s>, Combination)>, AnalysisError> {
    let mut pairs = Vec::new();
    for piece in pieces {
        let combinations = combinations(piece)?;
        *combines |= combinations.len() > 1;
        pairs.extend(combinations.into_iter().map(|combination| (piece, combination)));
    }
    Ok(pairs)
}

/// The combinations of contacts of an object that does not turn.
pub(crate) fn whole(scene: &Scene) -> Result<Vec<Combination>, AnalysisError> {
    let mut all = Vec::new();
    for piece in pieces::pieces(scene, "the matrix")? {
        all.extend(combinations(&piece)?);
    }
    Ok(all)
}

fn push_through(scene: &Scene, trust: Trust, strategies: &impl Strategies, watch: &dyn Watch) -> Result<Analysis, AnalysisError> {
    let network = NominalNetwork::of(scene)?;
    // The walls of the simulator push and do not pull, so there is nothing linear to push through them.
    let modes = whole(scene)?.into_iter().filter(|combination| !combination.contacts.at_wall).map(|combination| {
        let contacts = &combination.contacts;
        // With one-sided contacts every axis has combinations of its own.
        let map = full_along(combination.axes, scene, &network, contacts, trust, watch, strategies)?;
        let (rigid_modes, frame) = (map.rigid_modes, map.frame);
        let (matrix, error) = map.felt();
        let radius = bounded_radius(&matrix, error);
        watch.done(eigenvalue_operations(matrix.rows()));
        let part = Part::whole(radius, matrix.rows());
        let Combination { words: contacts, motion, .. } = combination;
        Ok(ContactMode { motion, contacts, radius, parts: vec![part], rigid_modes, dimension: matrix.rows(), frame })
    });
    let mut analysis = combine(modes.collect::<Result<_, AnalysisError>>()?, Method::Full, &network, scene);
    if scene.object.enclosure.is_some() {
        analysis.notes.push("the enclosure is left out: the scene is analysed away from its walls".to_owned());
    }
    Ok(analysis)
}

fn of_parts(combination: Combination, reduced: Reduced) -> ContactMode {
    let Combination { words: contacts, motion, .. } = combination;
    let Reduced { parts, rigid_modes, dimension, frame } = reduced;
    ContactMode { motion, contacts, radius: radius_of(&parts), parts, rigid_modes, dimension, frame }
}

/// The mode with the largest radius.
fn largest<'a>(modes: impl Iterator<Item = &'a ContactMode>) -> Option<&'a ContactMode> {
    modes.max_by(|one, other| one.radius.value.total_cmp(&other.radius.value))
}

pub(crate) fn combine(modes: Vec<ContactMode>, method: Method, network: &NominalNetwork, scene: &Scene) -> Analysis {
    let radius = modes.iter().map(|mode| mode.radius).reduce(Radius::or).unwrap_or(Radius { value: 0.0, error: 0.0 });
    let mut motions: Vec<&str> = modes.iter().map(|mode| mode.motion.as_str()).collect();
    motions.dedup();
    let of_motion = |motion: &&str| largest(modes.iter().filter(|mode| mode.motion == *motion));
    let all = motions.iter().filter_map(of_motion);
    let (rigid_modes, dimension) = all.fold((0, 0), |(rigid_modes, dimension), mode| (rigid_modes + mode.rigid_modes, dimension + mode.dimension));
    let largest = largest(modes.iter());
    let frame = largest.map_or(Duration::ZERO, |mode| mode.frame);
    let determinant = largest.is_some_and(|mode| mode.parts.iter().any(|part| part.method == Method::Determinant));
    let method = match method {
        Method::Full => Method::Full,
        Method::Reduced | Method::Determinant => {
            if determinant {
                Method::Determinant
            } else {
                Method::Reduced
            }
        }
    };
    let notes = notes(&network.notes, combines(&modes), scene);
    Analysis { radius, rigid_modes, dimension, method, frame, modes, notes }
}

/// What a verdict says of contacts that open and close, of which each combination is analysed as if it lasted.
pub const CHANGES_LEFT_OUT: &str = "changing between them is not covered";

/// What a verdict leaves out, in addition to the notes so far.
pub(crate) fn notes(said: &[String], combines: bool, scene: &Scene) -> Vec<String> {
    let mut notes = said.to_vec();
    if combines {
        notes.push(format!(
            "the scene is not linear: every combination of its contacts is analysed as if it lasted, and the verdict is that of the worst; {CHANGES_LEFT_OUT}"
        ));
    }
    if !scene.timeline.is_empty() {
        notes.push("the timeline is left out: the scene is analysed as it begins".to_owned());
    }
    if scene.rotation.is_some() {
        notes.push(UNLOADED.to_owned());
    }
    notes
}

/// The note on an object that turns, whose equations are those of small motions.
pub const UNLOADED: &str = "the object turns: the verdict is about small motions near rest, all copies together, with no hand pushing";

/// Contacts that are closed together, and for how many axes they stand.
#[derive(Clone, Debug)]
pub(crate) struct Combination {
    pub(crate) contacts: Contacts,
    pub(crate) axes: usize,
    /// See [`ContactMode::motion`].
    pub(crate) motion: String,
    pub(crate) words: String,
}

impl Combination {
    /// The motion and the contacts, in words.
    pub(crate) fn name(&self) -> String {
        let between = if self.motion.is_empty() || self.words.is_empty() { "" } else { ": " };
        format!("{}{between}{}", self.motion, self.words)
    }
}

/// More combinations than this are refused.
const MOST: u128 = 4096;

/// Every combination of contacts in which the scene is linear.
pub(crate) fn combinations(piece: &Piece<'_>) -> Result<Vec<Combination>, AnalysisError> {
    let Piece { scene, axes: copies, motion, absent } = piece;
    let grasping = |peer: usize| scene.peers[peer].contact == Contact::Grasp;
    let pushing_along = |axis: usize| -> Vec<usize> {
        let pushes = |peer: &usize| matches!(scene.peers[*peer].contact, Contact::Push(direction) if direction.axis == axis);
        (0..scene.peers.len()).filter(pushes).collect()
    };
    let axes = scene.axes.count();
    let walls = if scene.object.enclosure.is_some() { vec![false, true] } else { vec![false] };
    let count = (0..axes).map(|axis| pushing_along(axis).len()).fold(0_u128, |sum, pushing| sum.saturating_add(1_u128 << pushing.min(100)));
    if count.saturating_mul(walls.len() as u128) > MOST {
        return Err(AnalysisError::TooManyModes { modes: count.saturating_mul(walls.len() as u128), most: MOST });
    }
    let linear = (0..axes).all(|axis| pushing_along(axis).is_empty());
    let mut all = Vec::new();
    for at_wall in walls {
        let wall = if !at_wall { "" } else { "every copy at a wall" };
        if linear {
            let touching = (0..scene.peers.len()).map(grasping).collect();
            let contacts = Contacts { touching, at_wall, absent: absent.clone() };
            all.push(Combination { contacts, axes: *copies, motion: motion.clone(), words: wall.to_owned() });
            continue;
        }
        for axis in 0..axes {
            let pushing = pushing_along(axis);
            for closed in 0..1_u64 << pushing.len() {
                let touches =
                    |peer: usize| grasping(peer) || pushing.iter().position(|pushing| *pushing == peer).is_some_and(|place| closed >> place & 1 == 1);
                let touching: Vec<bool> = (0..scene.peers.len()).map(touches).collect();
                let names: Vec<&str> = pushing.iter().filter(|peer| touching[**peer]).map(|peer| scene.peers[*peer].name.as_str()).collect();
                let mut words = if axes > 1 { format!("along {}: ", ["x", "y", "z"][axis]) } else { String::new() };
                words.push_str(&if names.is_empty() { "nobody pushes".to_owned() } else { format!("pushing: {}", names.join(", ")) });
                if at_wall {
                    words.push_str("; every copy at a wall");
                }
                let contacts = Contacts { touching, at_wall, absent: absent.clone() };
                // Of a scene of several axes, each has combinations of its own.
                all.push(Combination { contacts, axes: copies / axes, motion: motion.clone(), words });
            }
        }
    }
    Ok(all)
}
