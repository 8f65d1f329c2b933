//! The observer of a run.

use cohaptic_units::Instant;
use cohaptic_wan::{PacketRecord, Path};

use crate::live::InputRow;

/// Instants, or ticks in arrays, between two calls of [`Observer::keep_going`].
pub(crate) const INSTANTS_BETWEEN_QUESTIONS: u32 = 1024;

/// Sees what happens in a run, while it happens, in the order in which it happens.
///
/// Peers are named by their place in [`cohaptic_scene::Scene::peers`]. The rows borrow from the running scene: copy what you keep. By default an
/// observer wants to see nothing; what it does not want costs nothing.
///
/// ```no_run
/// use std::convert::Infallible;
/// use std::path::Path;
///
/// use cohaptic_harness::{Model, Observer, Simulation, TickRow};
/// use cohaptic_scene::Scene;
///
/// /// The largest coupling force that any user feels.
/// #[derive(Default)]
/// struct LargestForce(f64);
///
/// impl Observer for LargestForce {
///     type Error = Infallible;
///
///     fn wants_ticks(&self) -> bool {
///         true
///     }
///
///     fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
///         self.0 = row.coupling_force.iter().fold(self.0, |largest, force| largest.max(force.abs()));
///         Ok(())
///     }
/// }
///
/// let scene = Scene::read(Path::new("scenarios/network/ideal.toml"), &[])?;
/// let mut largest = LargestForce::default();
/// let summary = Simulation::new(&scene, Model::Least).run(&mut largest)?;
/// println!("{:.2} N in {} ticks", largest.0, summary.ticks);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait Observer {
    /// Why the run must end: a file that cannot be written, for instance. An observer that never fails has [`std::convert::Infallible`].
    type Error;

    /// Whether [`Observer::on_tick`] is to be called. Asked once, at the start.
    fn wants_ticks(&self) -> bool {
        false
    }

    /// Whether [`Observer::on_packet`] is to be called. Asked once, at the start.
    fn wants_packets(&self) -> bool {
        false
    }

    /// A peer has computed its forces at a tick.
    ///
    /// # Errors
    ///
    /// Ends the run.
    fn on_tick(&mut self, _row: &TickRow<'_>) -> Result<(), Self::Error> {
        Ok(())
    }

    /// A packet, or a copy that a link made of one, has arrived or was dropped.
    ///
    /// # Errors
    ///
    /// Ends the run.
    fn on_packet(&mut self, _row: &PacketRow) -> Result<(), Self::Error> {
        Ok(())
    }

    /// Something has come into a [live session](crate::live) from outside: a replay needs the rows seen here, in this order.
    ///
    /// # Errors
    ///
    /// Ends the run.
    fn on_input(&mut self, _row: &InputRow<'_>) -> Result<(), Self::Error> {
        Ok(())
    }

    /// Called about every thousand instants, for progress and interruption; `false` ends the run early, in good order.
    fn keep_going(&mut self, _now: Instant) -> bool {
        true
    }
}

/// Position and velocity along the axes of the scene.
#[derive(Clone, Copy, Debug)]
pub struct StateRow<'a> {
    /// Position \[m\].
    pub position: &'a [f64],
    /// Velocity [m/s].
    pub velocity: &'a [f64],
}

/// One peer at one tick: the state at that instant and the forces computed at it. Slices have as many entries as the scene has axes.
#[derive(Clone, Copy, Debug)]
pub struct TickRow<'a> {
    /// The instant of the tick.
    pub at: Instant,
    /// The peer.
    pub peer: usize,
    /// Its device.
    pub device: StateRow<'a>,
    /// Its copy of the object.
    pub object: StateRow<'a>,
    /// Where its strategy wants the copy to be.
    pub target: StateRow<'a>,
    /// FC \[N\].
    pub coupling_force: &'a [f64],
    /// FT \[N\].
    pub coordination_force: &'a [f64],
}

/// What became of one packet between two peers, whose places are those of the nodes, or of one copy of it.
pub type PacketRow = PacketRecord<Path>;

/// Sees nothing, and costs nothing.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct NoObserver;

impl Observer for NoObserver {
    type Error = std::convert::Infallible;
}

/// Two observers side by side; the first sees everything first, and either can end the run.
impl<A: Observer, B: Observer<Error = A::Error>> Observer for (A, B) {
    type Error = A::Error;

    fn wants_ticks(&self) -> bool {
        self.0.wants_ticks() || self.1.wants_ticks()
    }

    fn wants_packets(&self) -> bool {
        self.0.wants_packets() || self.1.wants_packets()
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Self::Error> {
        self.0.on_tick(row)?;
        self.1.on_tick(row)
    }

    fn on_packet(&mut self, row: &PacketRow) -> Result<(), Self::Error> {
        self.0.on_packet(row)?;
        self.1.on_packet(row)
    }

    fn on_input(&mut self, row: &InputRow<'_>) -> Result<(), Self::Error> {
        self.0.on_input(row)?;
        self.1.on_input(row)
    }

    fn keep_going(&mut self, now: Instant) -> bool {
        // Both are asked, so that both can show progress.
        let first = self.0.keep_going(now);
        self.1.keep_going(now) && first
    }
}
