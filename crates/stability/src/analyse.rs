//! The analysis of a scene: chooses the method of computation that the scene and the caller's [`Method`] require, and combines the results.

use cohaptic_scene::{FromScene, Scene, Strategies, Topology};

use crate::analysis::combine;
use crate::combinations::{Combination, pairs, whole};
use crate::cost::eigenvalue_operations;
use crate::full::{Trust, full_along};
use crate::graph::on_this_topology;
use crate::network::NominalNetwork;
use crate::parts::{Part, Reduced, radius_of, reduced};
use crate::pieces;
use crate::spectrum::bounded_radius;
use crate::structure::{Structure, linear_law};
use crate::{Analysis, AnalysisError, ContactMode, Graph, Method, Unwatched, Watch, analyse_on_watched, turning};

/// Analyses the scene at its beginning, with the strategy that the scene names. The timeline is left out.
///
/// # Errors
///
/// [`AnalysisError`] if the scene has no frame that repeats, or does not split into linear scenes.
pub fn analyse(scene: &Scene, method: Method) -> Result<Analysis, AnalysisError> {
    analyse_watched(scene, method, &Unwatched)
}

/// Like [`analyse`], with a watch that can stop the analysis. The watch is asked between the parts of the scene, within frames and determinants, and between
/// the vectors of [`Method::Full`].
///
/// # Errors
///
/// As for [`analyse`], and [`AnalysisError::Stopped`] if the watch stops the analysis.
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
        // A strategy without a linear law takes the general path, like a caller's own strategy, and is checked there.
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

/// Analyses a scene with a topology as equal peers on a graph. Only [`Method::Reduced`] is possible.
fn on_topology(scene: &Scene, topology: &Topology, method: Method, watch: &dyn Watch) -> Result<Analysis, AnalysisError> {
    match method {
        Method::Reduced => analyse_on_watched(&scene.without_topology(), &Graph::from(topology), watch).map_err(on_this_topology),
        Method::Full => Err(AnalysisError::Topology { what: "the method full" }),
        Method::Determinant => Err(AnalysisError::Topology { what: "the method determinant" }),
    }
}

/// Analyses small motions about the state of rest under the constant forces and torques of the hands and the springs of their arms. The copies rest at
/// different positions there, and a rotation of the object changes the moments of the forces. For an object that does not turn the result equals the result of
/// [`analyse_watched`].
///
/// # Errors
///
/// The errors of [`analyse_watched`]. Further errors: a force or torque of a hand is not constant, or no state of rest exists under the forces.
pub fn analyse_loaded(scene: &Scene, method: Method, watch: &dyn Watch) -> Result<Analysis, AnalysisError> {
    if scene.rotation.is_some() { turning::analyse_loaded(scene, watch) } else { analyse_watched(scene, method, watch) }
}

/// Analyses small motions about the steady spin that constant torques of the hands drive about one axis of the world. The spin is searched near the initial
/// attitude of the object, and near its initial angular velocity if that is not zero. A held sample shows an attitude of the past, and so pulls the copy back
/// against the spin. The rate of the steady spin is the rate at which the torques balance this pull and the damping.
///
/// # Errors
///
/// The errors of [`analyse_watched`]. Further errors: the object does not turn, or no steady spin exists under the torques.
pub fn analyse_spinning(scene: &Scene, watch: &dyn Watch) -> Result<Analysis, AnalysisError> {
    if scene.rotation.is_none() {
        return Err(AnalysisError::NoSpin { why: "the object has no inertia".to_owned() });
    }
    turning::analyse_spinning(scene, watch)
}

/// Analyses the scene by the general path, with the caller's own strategies.
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

fn push_through(scene: &Scene, trust: Trust, strategies: &impl Strategies, watch: &dyn Watch) -> Result<Analysis, AnalysisError> {
    let network = NominalNetwork::of(scene)?;
    // The walls of the simulator push and do not pull. Such a force is not linear, so combinations at a wall are left out.
    let modes = whole(scene)?.into_iter().filter(|combination| !combination.contacts.at_wall).map(|combination| {
        let contacts = &combination.contacts;
        // With one-sided contacts each axis has separate combinations, so `axes` may be below the scene's number of axes.
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
