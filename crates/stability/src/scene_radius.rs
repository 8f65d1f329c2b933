//! Repeated computation of the radius of one scene while its numbers change. All parts without the numbers are prepared once.

use std::borrow::Cow;

use cohaptic_peer::coordination::BuiltIn;
use cohaptic_peer::{Gains, Plant};
use cohaptic_scene::{FromScene, Scene};

use crate::analyse::analyse;
use crate::combinations::{Combination, pairs};
use crate::cost::PartCost;
use crate::full::{FullMap, Trust, full_along};
use crate::lifted::{Autonomous, Body, Lifted, Node};
use crate::mean_square::{EqualScratch, Followed};
use crate::network::NominalNetwork;
use crate::parts::loose_device;
use crate::pieces::split;
use crate::radius::worse;
use crate::spectrum::Workspace;
use crate::stack_frame::{StackFrame, StackNode};
use crate::structure::{Contacts, Structure, knows_origin, linear_law};
use crate::turning::{self, Together, mode_of};
use crate::{AnalysisError, Matrix, Method, Radius, Unwatched};

/// The parts of a linear scene common to all values of the scene's numbers, prepared for computing radii.
#[derive(Debug)]
pub(crate) struct SceneRadius {
    /// Name of the first component of motion, for a piece of a turning object's motion. `None` without such a piece.
    component: Option<String>,
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    /// A scene with a linear law as its strategy.
    Parts(Box<PartsRadius>),
    /// A scene for the general path only.
    Whole(Box<WholeRadius>),
    /// A scene with a turning object of unsplit motion.
    Turning(Box<TurningRadius>),
    /// A scene with a topology.
    Graph(Box<GraphRadius>),
}

/// A scene with a topology. The modes are computed again for each set of numbers.
#[derive(Debug)]
struct GraphRadius {
    /// Every peer by itself.
    classes: Vec<Vec<usize>>,
    unfollowed: AnalysisError,
}

impl GraphRadius {
    fn new(scene: &Scene) -> Result<Self, AnalysisError> {
        // A refused scene is refused for all values of its numbers.
        analyse(scene, Method::Reduced)?;
        let classes = (0..scene.peers.len()).map(|peer| vec![peer]).collect();
        Ok(Self { classes, unfollowed: AnalysisError::Topology { what: "the mean square" } })
    }
}

/// Returns the radius of a scene with a topology, unknown if the scene cannot be analysed.
fn radius_on_topology(scene: &Scene) -> Radius {
    analyse(scene, Method::Reduced).map_or(Radius::UNKNOWN, |analysis| analysis.radius)
}

/// A scene with a turning object of unsplit motion.
#[derive(Debug)]
struct TurningRadius {
    /// Classes of peers equal for all numbers.
    structure: Structure,
    /// Every peer by itself.
    classes: Vec<Vec<usize>>,
    unfollowed: AnalysisError,
}

impl TurningRadius {
    fn new(scenes: &[&Scene], network: &NominalNetwork, why: &'static str) -> Result<Self, AnalysisError> {
        let structure = Structure::of(scenes, network, &turning::contacts(scenes[0])?)?;
        turning::allowed(&structure, &Unwatched)?;
        let classes = (0..scenes[0].peers.len()).map(|peer| vec![peer]).collect();
        Ok(Self { structure, classes, unfollowed: AnalysisError::Turns { what: "the mean square", why } })
    }

    fn radius<const BOUND: bool>(&self, scene: &Scene, workspace: &mut Workspace) -> Radius {
        let together = Together::new(scene, self.structure.clone());
        if BOUND {
            mode_of(&together, Method::Reduced, &Unwatched).map_or(Radius::UNKNOWN, |mode| mode.radius)
        } else {
            turning::radius(&together, workspace)
        }
    }
}

impl SceneRadius {
    /// Prepares the radius for scenes with different numbers. An arm may tie the object to ground in some of the scenes only.
    fn new(scenes: &[&Scene], network: &NominalNetwork, combination: &Combination) -> Result<Self, AnalysisError> {
        let component = combination.motion.split(", ").next().filter(|name| !name.is_empty()).map(str::to_owned);
        // A number may change how the motion splits. Scenes without the component are left out here and have an unknown radius later.
        let views: Vec<Cow<'_, Scene>> = scenes.iter().filter_map(|scene| view(scene, component.as_deref())).collect();
        let scenes: Vec<&Scene> = views.iter().map(AsRef::as_ref).collect();
        let kind = if linear_law(scenes[0], 0).is_some() {
            Kind::Parts(Box::new(PartsRadius::new(&scenes, network, &combination.contacts)?))
        } else {
            Kind::Whole(Box::new(WholeRadius::new(scenes[0], network, combination)?))
        };
        Ok(Self { component, kind })
    }

    /// Returns the method for the second moment, or an error with the reason for the absence of a method.
    pub(crate) const fn followed(&self) -> Result<&Followed, &AnalysisError> {
        match &self.kind {
            Kind::Parts(parts) => parts.followed.as_ref(),
            Kind::Whole(whole) => Err(&whole.unfollowed),
            Kind::Turning(turning) => Err(&turning.unfollowed),
            Kind::Graph(graph) => Err(&graph.unfollowed),
        }
    }

    /// Returns the members of each class of equal peers.
    pub(crate) fn classes(&self) -> &[Vec<usize>] {
        match &self.kind {
            Kind::Parts(parts) => &parts.structure.classes,
            Kind::Whole(whole) => &whole.classes,
            Kind::Turning(turning) => &turning.classes,
            Kind::Graph(graph) => &graph.classes,
        }
    }

    /// Returns the largest radius of all parts. Without `BOUND` the error is not computed.
    pub(crate) fn radius<const BOUND: bool>(&self, scene: &Scene, scratch: &mut RadiusScratch) -> Radius {
        let Some(scene) = view(scene, self.component.as_deref()) else { return Radius::UNKNOWN };
        match &self.kind {
            Kind::Parts(parts) => parts.radius::<BOUND>(&scene, scratch),
            Kind::Whole(whole) => whole.radius::<BOUND>(&scene, &mut scratch.workspace),
            Kind::Turning(turning) => turning.radius::<BOUND>(&scene, &mut scratch.workspace),
            Kind::Graph(_) => radius_on_topology(&scene),
        }
    }

    /// Returns the radius of the second moment over a frame, without a bound of its error. Returns `None` if the second moment is not followed here, or if
    /// numbers leave their range.
    pub(crate) fn mean_square(&self, scene: &Scene, scratch: &mut RadiusScratch) -> Option<f64> {
        match &self.kind {
            Kind::Parts(parts) => {
                let scene = view(scene, self.component.as_deref())?;
                parts.mean_square(&scene, scratch)
            }
            Kind::Whole(_) | Kind::Turning(_) | Kind::Graph(_) => None,
        }
    }
}

/// Returns the scene itself, or for a component the part of a turning object's motion with this component. `None` if no part has the component.
fn view<'a>(scene: &'a Scene, component: Option<&str>) -> Option<Cow<'a, Scene>> {
    let Some(component) = component else { return Some(Cow::Borrowed(scene)) };
    let parts = scene.rotation_parts()?.ok()?.parts;
    let part = parts.into_iter().find(|part| part.components.iter().any(|name| name == component))?;
    Some(Cow::Owned(part.scene))
}

/// A scene analysed again by the general path for each set of numbers.
#[derive(Debug)]
pub(crate) struct WholeRadius {
    network: NominalNetwork,
    contacts: Contacts,
    axes: usize,
    /// Every peer by itself.
    classes: Vec<Vec<usize>>,
    unfollowed: AnalysisError,
}

impl WholeRadius {
    fn new(scene: &Scene, network: &NominalNetwork, combination: &Combination) -> Result<Self, AnalysisError> {
        let whole = Self {
            network: network.clone(),
            contacts: combination.contacts.clone(),
            axes: combination.axes,
            classes: (0..scene.peers.len()).map(|peer| vec![peer]).collect(),
            unfollowed: AnalysisError::OtherStrategy { strategy: scene.coordination.strategy.name() },
        };
        // A refused scene is refused for all values of its numbers.
        whole.map(scene)?;
        Ok(whole)
    }

    fn map(&self, scene: &Scene) -> Result<FullMap, AnalysisError> {
        full_along(self.axes, scene, &self.network, &self.contacts, Trust::Linear, &Unwatched, &FromScene)
    }

    fn radius<const BOUND: bool>(&self, scene: &Scene, workspace: &mut Workspace) -> Radius {
        let Ok(map) = self.map(scene) else { return Radius::UNKNOWN };
        let (matrix, error) = map.felt();
        if BOUND { workspace.bounded_radius(&matrix, error) } else { Radius { value: workspace.radius(&matrix), error: 0.0 } }
    }
}

/// The parts of a scene with a linear law common to all values of the scene's numbers.
#[derive(Clone, Debug)]
pub(crate) struct PartsRadius {
    structure: Structure,
    /// `true` if something other than an arm ties the object to ground.
    tied: bool,
    /// Frame of the averages, if the frame fits on the stack.
    together: Option<StackFrame>,
    apart: Vec<Option<Apart>>,
    /// Weight −1/(N−1) with which a difference of equal peers receives its own samples, as a matrix of one entry.
    difference: Matrix,
    /// Method for the second moment, or the error with the reason for the absence of a method.
    followed: Result<Followed, AnalysisError>,
}

/// The system of the differences between the members of a class.
#[derive(Clone, Debug)]
struct Apart {
    stack: Option<StackFrame>,
    /// Number of this system's frames in a frame of the whole scene.
    frames: u32,
}

/// Scratch memory for computing radii, with the nodes and the step maps of the bodies of the last computation.
#[derive(Debug, Default)]
pub(crate) struct RadiusScratch {
    nodes: Vec<Node>,
    bodies: Vec<Bodies>,
    together: Matrix,
    apart: Matrix,
    workspace: Workspace,
    equal: EqualScratch,
}

/// Inputs of the step maps and of the linear law of a class, for detecting a change.
#[derive(Clone, Debug)]
struct Bodies {
    object: Plant,
    device: Plant,
    law: Option<BuiltIn>,
    /// Radius of the device, if the device touches nothing.
    loose: Option<Radius>,
}

impl RadiusScratch {
    /// Returns the last computed matrix of the averages.
    #[cfg(test)]
    pub(crate) fn together(&self) -> &Matrix {
        &self.together
    }
}

impl PartsRadius {
    fn new(scenes: &[&Scene], network: &NominalNetwork, contacts: &Contacts) -> Result<Self, AnalysisError> {
        // A scene without arms is added, so `structure.tied` is true only if something other than an arm ties the object.
        let mut armless = scenes[0].clone();
        for spec in &mut armless.peers {
            spec.hand = None;
        }
        let all: Vec<&Scene> = std::iter::once(&armless).chain(scenes.iter().copied()).collect();
        let structure = Structure::of(&all, network, contacts)?;
        let together = StackFrame::of(&structure.timetable);
        let apart = structure.apart.iter().map(|timetable| {
            timetable.as_ref().map(|timetable| {
                let frames = structure.timetable.frame.as_nanos() / timetable.frame.as_nanos().max(1);
                Apart { stack: StackFrame::of(timetable), frames: u32::try_from(frames).unwrap_or(u32::MAX) }
            })
        });
        let apart = apart.collect();
        let difference = Matrix::from_fn(1, 1, |_, _| structure.difference_weight());
        // Numbers that are written into the scene leave the size of the matrix as it is, so the memory is checked once.
        let nodes = structure.nodes(scenes[0]);
        PartCost::of_eigenvalues(structure.quotient(scenes[0], &nodes).sizes().states).allowed(&Unwatched)?;
        let followed = Followed::of(scenes[0], network, &structure);
        Ok(Self { tied: structure.tied, together, apart, difference, followed, structure })
    }

    fn radius<const BOUND: bool>(&self, scene: &Scene, scratch: &mut RadiusScratch) -> Radius {
        self.refresh(scene, scratch);
        let RadiusScratch { nodes, bodies, together, apart, workspace, .. } = scratch;
        let structure = &self.structure;
        let quotient = self.quotient(scene, nodes);
        let mut worst = part::<BOUND>(self.together.as_ref(), &quotient, together, workspace);
        for (class, part_of) in self.apart.iter().enumerate() {
            if let (Some(Apart { stack, frames }), Some(timetable)) = (part_of, &structure.apart[class]) {
                let nodes = Structure::apart(nodes, class);
                let lifted = Lifted { nodes: &nodes, weights: &self.difference, timetable, tied: true, ..quotient };
                // The differences have a shorter frame than the scene, so their radius is raised to the number of such frames per frame of the scene.
                let radius = part::<BOUND>(stack.as_ref(), &lifted, apart, workspace).over(*frames);
                worst = worse::<BOUND>(worst, radius);
            }
            if let Some(loose) = bodies[class].loose {
                worst = worse::<BOUND>(worst, loose);
            }
        }
        worst
    }

    fn mean_square(&self, scene: &Scene, scratch: &mut RadiusScratch) -> Option<f64> {
        let square = |this: &Self, scratch: &mut RadiusScratch| this.radius::<false>(scene, scratch).value.powi(2);
        let Ok(Followed::Equal { frame, held }) = &self.followed else {
            return matches!(self.followed, Ok(Followed::Certain)).then(|| square(self, scratch));
        };
        self.refresh(scene, scratch);
        let RadiusScratch { nodes, bodies, equal, .. } = &mut *scratch;
        let quotient = self.quotient(scene, nodes);
        if quotient.sampling.is_silent(quotient.time) {
            // The laws use no arriving sample, so random links have no effect on the bodies.
            return Some(square(self, scratch).max(*held));
        }
        // The second moment contains the moments of forceless held samples too, with the radius `held`, and of loose devices.
        let found = frame.radius(&quotient, equal)?.max(*held);
        Some(bodies.iter().filter_map(|bodies| bodies.loose).fold(found, |found, loose| found.max(loose.value.powi(2))))
    }

    /// Returns the system of the classes' averages with the numbers of `scene`.
    fn quotient<'a>(&'a self, scene: &Scene, nodes: &'a [Node]) -> Lifted<'a> {
        let structure = &self.structure;
        let armed = |class: usize| structure.touching[class] && knows_origin(scene, self.representative(class));
        // An arm's stiffness is a number of the scene, so the tie is decided anew for each set of numbers.
        let tied = self.tied || (0..nodes.len()).any(armed);
        Lifted { tied, ..structure.quotient(scene, nodes) }
    }

    /// Returns the representative peer of a class: the first member.
    fn representative(&self, class: usize) -> usize {
        self.structure.classes[class][0]
    }

    /// Updates the nodes in `scratch` to the numbers of `scene`. Step maps are computed again only for changed bodies.
    fn refresh(&self, scene: &Scene, scratch: &mut RadiusScratch) {
        let classes = self.structure.classes.len();
        let loose = |class: usize| self.structure.has_loose_devices(class).then(|| loose_device(&self.structure, scene, class).0);
        if scratch.nodes.len() != classes {
            scratch.nodes = self.structure.nodes(scene);
            let bodies = |class: usize| Bodies {
                object: scene.copy_config(self.representative(class)).plant(),
                device: scene.device_plant(self.representative(class)),
                law: scene.law(self.representative(class)),
                loose: loose(class),
            };
            scratch.bodies = (0..classes).map(bodies).collect();
            return;
        }
        for class in 0..classes {
            let place = self.representative(class);
            let clock = &scene.peers[place].clock;
            let (node, bodies) = (&mut scratch.nodes[class], &mut scratch.bodies[class]);
            let object = scene.copy_config(place).plant();
            if bodies.object != object {
                bodies.object = object;
                node.object = Body::new(object, scene.integrator, clock);
            }
            let device = scene.device_plant(place);
            if bodies.device != device {
                bodies.device = device;
                bodies.loose = loose(class);
                node.device = node.device.map(|_| Body::new(device, scene.integrator, clock));
            }
            node.operator = self.structure.operator(scene, class);
            node.coupling = scene.coupling(place);
            let law = scene.law(place);
            if bodies.law != law {
                bodies.law = law;
                node.law = self.structure.law(scene, class);
            }
            // `and` keeps the absence of a wall: a combination away from the walls has none, whatever the enclosure.
            node.wall = node.wall.and(scene.object.enclosure).map(|wall| Gains { stiffness: wall.stiffness, damping: wall.damping });
        }
    }
}

/// Returns the radius of a lifted system, and writes the monodromy matrix to `matrix`.
fn part<const BOUND: bool>(stack: Option<&StackFrame>, lifted: &Lifted<'_>, matrix: &mut Matrix, workspace: &mut Workspace) -> Radius {
    let error = match (stack, StackNode::of(lifted)) {
        (Some(stack), Some(node)) => stack.monodromy::<BOUND>(node, matrix, || lifted.error()),
        _ => {
            let frame = lifted.frame(&mut Autonomous);
            // As for a part of one scene: of a matrix with seen places the bound says nothing.
            if BOUND
                && lifted.has_operators()
                && let Ok(delayed) = frame.delayed_loop()
            {
                return delayed.bounded_radius_watched(frame.error, &Unwatched).unwrap_or(Radius::UNKNOWN);
            }
            *matrix = frame.monodromy();
            frame.error
        }
    };
    if BOUND { workspace.bounded_radius(matrix, error) } else { Radius { value: workspace.radius(matrix), error: 0.0 } }
}

/// Prepares the radii of a scene: one per combination of contacts and piece. `scenes` are the same scene with different numbers.
pub(crate) fn scene_radii(scenes: &[&Scene]) -> Result<Vec<SceneRadius>, AnalysisError> {
    if scenes[0].topology.is_some() {
        return Ok(vec![SceneRadius { component: None, kind: Kind::Graph(Box::new(GraphRadius::new(scenes[0])?)) }]);
    }
    let network = NominalNetwork::of(scenes[0])?;
    let pieces = match split(scenes[0]) {
        Ok(pieces) => pieces,
        Err(why) => {
            let turning = TurningRadius::new(scenes, &network, why)?;
            return Ok(vec![SceneRadius { component: None, kind: Kind::Turning(Box::new(turning)) }]);
        }
    };
    // The general path cannot follow walls, so without a law the combinations at a wall are left out.
    let is_law = linear_law(scenes[0], 0).is_some();
    let combinations = pairs(&pieces, &mut false)?.into_iter().map(|(_, combination)| combination);
    let followed = combinations.filter(|combination| is_law || !combination.contacts.at_wall);
    followed.map(|combination| SceneRadius::new(scenes, &network, &combination)).collect()
}
