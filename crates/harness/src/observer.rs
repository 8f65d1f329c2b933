//! The observer of a run.

use cohaptic_peer::rotation::Attitude;
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{PacketRecord, Path};

use crate::arrays::Ticks;
use crate::live::InputRow;

/// The most instants, or ticks in arrays, between two calls of [`Observer::keep_going`].
pub(crate) const MOST_INSTANTS_BETWEEN_QUESTIONS: u32 = 1024;

/// Ticks of peers, or packets, between two calls of [`Observer::keep_going`] at most, unless more happen at one instant: a part of a second.
pub(crate) const MOST_WORK_BETWEEN_QUESTIONS: usize = 1 << 22;

/// Instants, or ticks in arrays, between two calls of [`Observer::keep_going`]: a power of two. `work`: ticks of peers, or packets, at an instant at most.
pub(crate) fn instants_between_questions(work: usize) -> u32 {
    let instants = u32::try_from(MOST_WORK_BETWEEN_QUESTIONS / work.max(1)).unwrap_or(u32::MAX);
    // Rounded down to a power of two, so that no tick of a small scene pays for a division.
    1 << instants.clamp(1, MOST_INSTANTS_BETWEEN_QUESTIONS).ilog2()
}

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

    /// Whether [`Observer::on_tick`] or [`Observer::on_ticks`] is to be called. Asked at the start; the answer must stay.
    fn wants_ticks(&self) -> bool {
        false
    }

    /// Whether [`Observer::on_packet`] is to be called. Asked once, at the start.
    fn wants_packets(&self) -> bool {
        false
    }

    /// Whether [`Observer::on_step`] is to be called. Asked once, at the start.
    fn wants_steps(&self) -> bool {
        false
    }

    /// Whether [`Observer::on_instant`] is to be called. Asked once, at the start.
    fn wants_instants(&self) -> bool {
        false
    }

    /// Whether [`Observer::on_send`] is to be called. Asked once, at the start.
    fn wants_sends(&self) -> bool {
        false
    }

    /// Whether [`Observer::on_hold`] is to be called. Asked once, at the start.
    fn wants_holds(&self) -> bool {
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

    /// All peers have computed their forces at an instant at which all of them tick: [`Observer::on_tick`] of each, in one call.
    ///
    /// A run of which only ticks and instants are wanted calls this where it needs no events and all peers tick together; all others call
    /// [`Observer::on_tick`]. An observer with an `on_ticks` of its own, which may look at less than whole rows, must come to the same with either.
    ///
    /// # Errors
    ///
    /// Ends the run.
    fn on_ticks(&mut self, ticks: &Ticks<'_>) -> Result<(), Self::Error> {
        ticks.each(|row| self.on_tick(row))
    }

    /// A packet, or a copy that a link made of one, has arrived or was dropped.
    ///
    /// # Errors
    ///
    /// Ends the run.
    fn on_packet(&mut self, _row: &PacketRow) -> Result<(), Self::Error> {
        Ok(())
    }

    /// A peer has moved from a tick to its next one.
    ///
    /// # Errors
    ///
    /// Ends the run.
    fn on_step(&mut self, _row: &StepRow<'_>) -> Result<(), Self::Error> {
        Ok(())
    }

    /// All peers that tick at an instant have ticked.
    ///
    /// # Errors
    ///
    /// Ends the run.
    fn on_instant(&mut self, _row: &InstantRow) -> Result<(), Self::Error> {
        Ok(())
    }

    /// A peer has sent a sample.
    ///
    /// # Errors
    ///
    /// Ends the run.
    fn on_send(&mut self, _row: &SendRow) -> Result<(), Self::Error> {
        Ok(())
    }

    /// A peer holds a newer sample of another one, from its next tick on, which may be at this instant.
    ///
    /// # Errors
    ///
    /// Ends the run.
    fn on_hold(&mut self, _row: &HoldRow) -> Result<(), Self::Error> {
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

    /// Called about every thousand instants, of thousands of peers up to every instant, for progress and interruption; `false` ends the run early, in good order.
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
    /// How the peer is turned, if the object turns.
    pub turn: Option<TurnRow<'a>>,
}

/// The turning part of one peer at one tick.
#[derive(Clone, Copy, Debug)]
pub struct TurnRow<'a> {
    /// The attitude of its copy.
    pub object: &'a Attitude,
    /// The attitude of its device; `None` for one that does not turn.
    pub device: Option<&'a Attitude>,
    /// r×RᵀFC + τC: the torque of device and coupling on the copy, in its body axes \[N·m\].
    pub coupling_torque: &'a [f64; 3],
    /// τT, in the body axes of the copy, on which it acts with the opposite sign \[N·m\].
    pub coordination_torque: &'a [f64; 3],
}

/// One peer over one step of its copy, from a tick to the next one of this peer. Slices have as many entries as the scene has axes.
///
/// Of a client of a server, which has no copy, it is the step of the device, and F is the coupling force that the server returns or the client computes.
#[derive(Clone, Copy, Debug)]
pub struct StepRow<'a> {
    /// The instant of the tick at which the step begins.
    pub at: Instant,
    /// The peer.
    pub peer: usize,
    /// Its copy of the object at the beginning of the step.
    pub before: StateRow<'a>,
    /// Its copy of the object at the end of the step.
    pub after: StateRow<'a>,
    /// The sum of all forces that are held on the copy over the step \[N\]: FC − F and the walls. Damping is no held force.
    pub held_force: &'a [f64],
    /// F \[N\], the held part of the coordination force as it is applied, which acts on the copy with the opposite sign: all of FT but the damping of the strategy.
    pub coordination_force: &'a [f64],
    /// β, by how much the strategy damps the copy over the step [N·s/m].
    pub own_damping: f64,
    /// The turn of the copy over the step, if the object turns.
    pub turn: Option<TurnStepRow>,
}

/// The turn of one copy over one of its steps, all in its body axes.
#[derive(Clone, Copy, Debug)]
pub struct TurnStepRow {
    /// How long the step takes.
    pub span: std::time::Duration,
    /// Angular velocity at the beginning [rad/s].
    pub before: [f64; 3],
    /// Angular velocity at the end [rad/s].
    pub after: [f64; 3],
    /// The integral of the angular velocity over the step \[rad\].
    pub travel: [f64; 3],
    /// The sum of all torques that are held on the copy over the step \[N·m\]. Damping is no held torque.
    pub held_torque: [f64; 3],
    /// The held part of the torque of the coordination as it is applied, which acts with the opposite sign \[N·m\].
    pub coordination_torque: [f64; 3],
    /// β about each axis, by how much the strategy damps the turn over the step [N·m·s/rad].
    pub own_damping: [f64; 3],
}

/// An instant at which at least one peer has ticked.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct InstantRow {
    /// The instant.
    pub at: Instant,
    /// The largest distance along an axis between two copies of the object at their latest ticks \[m\].
    pub discrepancy: f64,
}

/// One sample that a peer sends.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SendRow {
    /// The instant.
    pub at: Instant,
    /// The sender.
    pub peer: usize,
    /// The packets that are offered to the network, each with the sample.
    pub packets: u64,
    /// The size of each packet.
    pub size: Bytes,
}

/// One sample that a peer holds from now on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct HoldRow {
    /// The instant at which it was taken in: that of a tick of some peer, at or after the arrival.
    pub at: Instant,
    /// The sender.
    pub from: usize,
    /// The peer that holds it.
    pub to: usize,
    /// The instant at which it was sampled, and sent.
    pub sampled: Instant,
}

/// What became of one packet between two peers, whose places are those of the nodes, or of one copy of it.
pub type PacketRow = PacketRecord<Path>;

/// Sees nothing, and costs nothing.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct NoObserver;

impl Observer for NoObserver {
    type Error = std::convert::Infallible;
}

/// All of an observer but its error, by an observer in a field; `map` makes of the result of each call what it is here.
macro_rules! observe_by_field {
    ($field:ident) => {
        $crate::observer::observe_by_field! { $field, |_: &mut Self, result| result }
    };
    ($field:ident, $map:expr) => {
        fn wants_ticks(&self) -> bool {
            self.$field.wants_ticks()
        }

        fn wants_packets(&self) -> bool {
            self.$field.wants_packets()
        }

        fn wants_steps(&self) -> bool {
            self.$field.wants_steps()
        }

        fn wants_instants(&self) -> bool {
            self.$field.wants_instants()
        }

        fn wants_sends(&self) -> bool {
            self.$field.wants_sends()
        }

        fn wants_holds(&self) -> bool {
            self.$field.wants_holds()
        }

        #[inline(always)]
        fn on_tick(&mut self, row: &$crate::TickRow<'_>) -> Result<(), Self::Error> {
            let result = self.$field.on_tick(row);
            ($map)(self, result)
        }

        fn on_packet(&mut self, row: &$crate::PacketRow) -> Result<(), Self::Error> {
            let result = self.$field.on_packet(row);
            ($map)(self, result)
        }

        #[inline(always)]
        fn on_step(&mut self, row: &$crate::StepRow<'_>) -> Result<(), Self::Error> {
            let result = self.$field.on_step(row);
            ($map)(self, result)
        }

        #[inline(always)]
        fn on_instant(&mut self, row: &$crate::InstantRow) -> Result<(), Self::Error> {
            let result = self.$field.on_instant(row);
            ($map)(self, result)
        }

        fn on_send(&mut self, row: &$crate::SendRow) -> Result<(), Self::Error> {
            let result = self.$field.on_send(row);
            ($map)(self, result)
        }

        fn on_hold(&mut self, row: &$crate::HoldRow) -> Result<(), Self::Error> {
            let result = self.$field.on_hold(row);
            ($map)(self, result)
        }

        fn on_input(&mut self, row: &$crate::live::InputRow<'_>) -> Result<(), Self::Error> {
            let result = self.$field.on_input(row);
            ($map)(self, result)
        }

        fn on_ticks(&mut self, ticks: &$crate::Ticks<'_>) -> Result<(), Self::Error> {
            let result = self.$field.on_ticks(ticks);
            ($map)(self, result)
        }

        fn keep_going(&mut self, now: cohaptic_units::Instant) -> bool {
            self.$field.keep_going(now)
        }
    };
}
pub(crate) use observe_by_field;

/// The observer has ended the run; [`Erased`] keeps its error.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Ended;

/// Any observer. The loops of a run are compiled for this one, and once more for measures: a call through a table for each row costs less than the row, but a
/// tenth of the instructions of all measures of three peers.
pub(crate) type AnyObserver<'o> = dyn Observer<Error = Ended> + 'o;

/// An observer without its error, which is kept.
pub(crate) struct Erased<'o, O: Observer> {
    observer: &'o mut O,
    error: Option<O::Error>,
}

impl<'o, O: Observer> Erased<'o, O> {
    /// What `run` gives, or the error with which the observer has ended it.
    pub(crate) fn run<T>(observer: &'o mut O, run: impl FnOnce(&mut AnyObserver<'_>) -> Result<T, Ended>) -> Result<T, O::Error> {
        Self::run_as_itself(observer, |observer| run(observer))
    }

    /// [`Erased::run`], where `run` is compiled for this observer.
    pub(crate) fn run_as_itself<T>(observer: &'o mut O, run: impl FnOnce(&mut Self) -> Result<T, Ended>) -> Result<T, O::Error> {
        let mut erased = Self { observer, error: None };
        let result = run(&mut erased);
        match (result, erased.error) {
            (Ok(value), _) => Ok(value),
            (Err(Ended), Some(error)) => Err(error),
            (Err(Ended), None) => unreachable!("only an error of the observer ends a run"),
        }
    }

    fn keep(&mut self, result: Result<(), O::Error>) -> Result<(), Ended> {
        result.map_err(|error| {
            self.error = Some(error);
            Ended
        })
    }
}

impl<O: Observer> Observer for Erased<'_, O> {
    type Error = Ended;

    observe_by_field! { observer, Self::keep }
}

/// An observer that may be missing.
impl<O: Observer> Observer for Option<O> {
    type Error = O::Error;

    fn wants_ticks(&self) -> bool {
        self.as_ref().is_some_and(O::wants_ticks)
    }

    fn wants_packets(&self) -> bool {
        self.as_ref().is_some_and(O::wants_packets)
    }

    fn wants_steps(&self) -> bool {
        self.as_ref().is_some_and(O::wants_steps)
    }

    fn wants_instants(&self) -> bool {
        self.as_ref().is_some_and(O::wants_instants)
    }

    fn wants_sends(&self) -> bool {
        self.as_ref().is_some_and(O::wants_sends)
    }

    fn wants_holds(&self) -> bool {
        self.as_ref().is_some_and(O::wants_holds)
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), O::Error> {
        self.as_mut().map_or(Ok(()), |observer| observer.on_tick(row))
    }

    fn on_ticks(&mut self, ticks: &Ticks<'_>) -> Result<(), O::Error> {
        self.as_mut().map_or(Ok(()), |observer| observer.on_ticks(ticks))
    }

    fn on_packet(&mut self, row: &PacketRow) -> Result<(), O::Error> {
        self.as_mut().map_or(Ok(()), |observer| observer.on_packet(row))
    }

    fn on_step(&mut self, row: &StepRow<'_>) -> Result<(), O::Error> {
        self.as_mut().map_or(Ok(()), |observer| observer.on_step(row))
    }

    fn on_instant(&mut self, row: &InstantRow) -> Result<(), O::Error> {
        self.as_mut().map_or(Ok(()), |observer| observer.on_instant(row))
    }

    fn on_send(&mut self, row: &SendRow) -> Result<(), O::Error> {
        self.as_mut().map_or(Ok(()), |observer| observer.on_send(row))
    }

    fn on_hold(&mut self, row: &HoldRow) -> Result<(), O::Error> {
        self.as_mut().map_or(Ok(()), |observer| observer.on_hold(row))
    }

    fn on_input(&mut self, row: &InputRow<'_>) -> Result<(), O::Error> {
        self.as_mut().map_or(Ok(()), |observer| observer.on_input(row))
    }

    fn keep_going(&mut self, now: Instant) -> bool {
        self.as_mut().is_none_or(|observer| observer.keep_going(now))
    }
}

/// Two observers side by side; the first sees everything first, and either can end the run. Errors of the second become those of the first.
impl<A: Observer<Error: From<B::Error>>, B: Observer> Observer for (A, B) {
    type Error = A::Error;

    fn wants_ticks(&self) -> bool {
        self.0.wants_ticks() || self.1.wants_ticks()
    }

    fn wants_packets(&self) -> bool {
        self.0.wants_packets() || self.1.wants_packets()
    }

    fn wants_steps(&self) -> bool {
        self.0.wants_steps() || self.1.wants_steps()
    }

    fn wants_instants(&self) -> bool {
        self.0.wants_instants() || self.1.wants_instants()
    }

    fn wants_sends(&self) -> bool {
        self.0.wants_sends() || self.1.wants_sends()
    }

    fn wants_holds(&self) -> bool {
        self.0.wants_holds() || self.1.wants_holds()
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Self::Error> {
        self.0.on_tick(row)?;
        Ok(self.1.on_tick(row)?)
    }

    fn on_ticks(&mut self, ticks: &Ticks<'_>) -> Result<(), Self::Error> {
        // Rows of all peers are work, which one that does not want them is to be spared.
        if self.0.wants_ticks() {
            self.0.on_ticks(ticks)?;
        }
        if self.1.wants_ticks() {
            self.1.on_ticks(ticks)?;
        }
        Ok(())
    }

    fn on_step(&mut self, row: &StepRow<'_>) -> Result<(), Self::Error> {
        self.0.on_step(row)?;
        Ok(self.1.on_step(row)?)
    }

    fn on_instant(&mut self, row: &InstantRow) -> Result<(), Self::Error> {
        self.0.on_instant(row)?;
        Ok(self.1.on_instant(row)?)
    }

    fn on_send(&mut self, row: &SendRow) -> Result<(), Self::Error> {
        self.0.on_send(row)?;
        Ok(self.1.on_send(row)?)
    }

    fn on_hold(&mut self, row: &HoldRow) -> Result<(), Self::Error> {
        self.0.on_hold(row)?;
        Ok(self.1.on_hold(row)?)
    }

    fn on_packet(&mut self, row: &PacketRow) -> Result<(), Self::Error> {
        self.0.on_packet(row)?;
        Ok(self.1.on_packet(row)?)
    }

    fn on_input(&mut self, row: &InputRow<'_>) -> Result<(), Self::Error> {
        self.0.on_input(row)?;
        Ok(self.1.on_input(row)?)
    }

    fn keep_going(&mut self, now: Instant) -> bool {
        // Both are asked, so that both can show progress.
        let first = self.0.keep_going(now);
        self.1.keep_going(now) && first
    }
}
