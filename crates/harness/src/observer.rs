//! Observers of a run.

use cohaptic_units::Instant;

use crate::arrays::Ticks;
use crate::rows::{HoldRow, InputRow, InstantRow, PacketRow, SendRow, StepRow, TickRow};

/// Observes a run while it happens, in the order of events.
///
/// Peers are indices of [`cohaptic_scene::Scene::peers`]. Rows borrow from the running scene, so an observer copies the kept parts. By default an
/// observer wants no rows. Unwanted rows are not made.
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
    /// Reason for the end of the run, for example a full disk. [`std::convert::Infallible`] for an observer without failures.
    type Error;

    /// Returns whether [`Observer::on_tick`] or [`Observer::on_ticks`] is to be called. Asked at the start; the answer must not change.
    fn wants_ticks(&self) -> bool {
        false
    }

    /// Returns whether [`Observer::on_packet`] is to be called. Asked once, at the start.
    fn wants_packets(&self) -> bool {
        false
    }

    /// Returns whether [`Observer::on_step`] is to be called. Asked once, at the start.
    fn wants_steps(&self) -> bool {
        false
    }

    /// Returns whether [`Observer::on_instant`] is to be called. Asked once, at the start.
    fn wants_instants(&self) -> bool {
        false
    }

    /// Returns whether [`Observer::on_send`] is to be called. Asked once, at the start.
    fn wants_sends(&self) -> bool {
        false
    }

    /// Returns whether [`Observer::on_hold`] is to be called. Asked once, at the start.
    fn wants_holds(&self) -> bool {
        false
    }

    /// Called when a peer has computed its forces at a tick, before the peer moves.
    ///
    /// # Errors
    ///
    /// An error ends the run.
    fn on_tick(&mut self, _row: &TickRow<'_>) -> Result<(), Self::Error> {
        Ok(())
    }

    /// Called when all peers have computed their forces at an instant of a tick of all peers: [`Observer::on_tick`] for each peer, in one call.
    ///
    /// Called only in a run without events and with an observer of ticks and instants only; all other runs call [`Observer::on_tick`]. An observer that
    /// overrides `on_ticks`, for example to read less than whole rows, must get the same result from both.
    ///
    /// # Errors
    ///
    /// An error ends the run.
    fn on_ticks(&mut self, ticks: &Ticks<'_>) -> Result<(), Self::Error> {
        ticks.each(|row| self.on_tick(row))
    }

    /// Called when a packet, or a copy of a packet made by a link, has arrived or was dropped.
    ///
    /// # Errors
    ///
    /// An error ends the run.
    fn on_packet(&mut self, _row: &PacketRow) -> Result<(), Self::Error> {
        Ok(())
    }

    /// Called when a peer has moved from a tick to its next tick.
    ///
    /// # Errors
    ///
    /// An error ends the run.
    fn on_step(&mut self, _row: &StepRow<'_>) -> Result<(), Self::Error> {
        Ok(())
    }

    /// Called after the ticks of all peers at an instant.
    ///
    /// # Errors
    ///
    /// An error ends the run.
    fn on_instant(&mut self, _row: &InstantRow) -> Result<(), Self::Error> {
        Ok(())
    }

    /// Called when a peer has sent a sample.
    ///
    /// # Errors
    ///
    /// An error ends the run.
    fn on_send(&mut self, _row: &SendRow) -> Result<(), Self::Error> {
        Ok(())
    }

    /// Called when a peer holds a newer sample of another peer. The sample takes effect at the receiver's next tick, possibly at the same instant.
    ///
    /// # Errors
    ///
    /// An error ends the run.
    fn on_hold(&mut self, _row: &HoldRow) -> Result<(), Self::Error> {
        Ok(())
    }

    /// Called for each input of a [live session](crate::live) from outside. A replay needs these rows in the same order.
    ///
    /// # Errors
    ///
    /// An error ends the run.
    fn on_input(&mut self, _row: &InputRow<'_>) -> Result<(), Self::Error> {
        Ok(())
    }

    /// Called about every thousand instants, and with thousands of peers up to every instant, for progress and interruption. `false` ends the run early; the
    /// run then returns its results so far.
    fn keep_going(&mut self, _now: Instant) -> bool {
        true
    }
}

/// Observer that wants no rows.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct NoObserver;

impl Observer for NoObserver {
    type Error = std::convert::Infallible;
}

/// Implements all of [`Observer`] except the error by the observer in a field. `map` converts the result of each call.
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

        fn on_input(&mut self, row: &$crate::rows::InputRow<'_>) -> Result<(), Self::Error> {
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

/// Mark of an end of the run by the observer. [`Erased`] keeps the error.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Ended;

/// Any observer, as a trait object. The loops of a run are compiled for this type and once more for measures, since their rows are cheaper than a dynamic call.
pub(crate) type AnyObserver<'o> = dyn Observer<Error = Ended> + 'o;

/// Observer with a uniform error type, for [`AnyObserver`]. Keeps the error of the inner observer.
pub(crate) struct Erased<'o, O: Observer> {
    observer: &'o mut O,
    /// Error of the inner observer, if the inner observer ended the run.
    error: Option<O::Error>,
}

impl<'o, O: Observer> Erased<'o, O> {
    /// Calls `run` with the erased observer and returns its value, or the error of the observer that ended the run.
    pub(crate) fn run<T>(observer: &'o mut O, run: impl FnOnce(&mut AnyObserver<'_>) -> Result<T, Ended>) -> Result<T, O::Error> {
        Self::run_as_itself(observer, |observer| run(observer))
    }

    /// Like [`Erased::run`], with `run` compiled for this type of observer.
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

/// Optional observer. `None` wants no rows.
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

/// Two observers of one run. The first gets every row before the second, and either can end the run. Errors of the second observer are converted to errors of
/// the first.
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
        // Making the rows of all peers is work, so an observer of no ticks is not called.
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
        // Both are asked, even after `false`, so that both can show progress.
        let first = self.0.keep_going(now);
        self.1.keep_going(now) && first
    }
}
