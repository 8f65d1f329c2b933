//! Printing of [`Netem`] as words, with the same value after reading.

use core::fmt;
use core::num::NonZeroU64;
use core::time::Duration;

use super::{ChanceSpec, CrossSource, CrossSpec, DelaySpec, GemodelSpec, LossSpec, Netem, Percent, RateSpec, SlotGap, SlotSpec, StateSpec};

impl fmt::Display for Netem {
    /// Prints words for `tc`, and after `rate` those of `cross`, in the order of its manual, with every time and rate as an integer. A netem without options prints nothing.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut words = Words { f, separator: "" };
        if let Some(limit) = self.limit {
            words.put(format_args!("limit {limit}"))?;
        }
        if let Some(delay) = &self.delay {
            words.delay(delay)?;
        }
        if let Some(loss) = &self.loss {
            words.loss(loss)?;
        }
        if self.ecn {
            words.put("ecn")?;
        }
        if let Some(corrupt) = &self.corrupt {
            words.chance("corrupt", corrupt)?;
        }
        if let Some(duplicate) = &self.duplicate {
            words.chance("duplicate", duplicate)?;
        }
        if let Some(reorder) = &self.reorder {
            // `gap` follows `reorder`, because a gap alone is refused.
            words.chance("reorder", &reorder.chance)?;
            if let Some(gap) = reorder.gap {
                words.put(format_args!("gap {gap}"))?;
            }
        }
        if let Some(rate) = &self.rate {
            words.rate(rate)?;
        }
        if let Some(cross) = &self.cross {
            words.cross(cross)?;
        }
        if let Some(slot) = &self.slot {
            words.slot(slot)?;
        }
        if let Some(seed) = self.seed {
            words.put(format_args!("seed {seed}"))?;
        }
        Ok(())
    }
}

/// Prints words with spaces in between.
struct Words<'f, 'a> {
    f: &'f mut fmt::Formatter<'a>,
    separator: &'static str,
}

impl Words<'_, '_> {
    fn put(&mut self, word: impl fmt::Display) -> fmt::Result {
        write!(self.f, "{}{word}", self.separator)?;
        self.separator = " ";
        Ok(())
    }

    /// Prints the given percentages. No given percentage follows a missing percentage, so the words read back in order.
    fn put_all(&mut self, percentages: &[Option<Percent>]) -> fmt::Result {
        percentages.iter().flatten().try_for_each(|percent| self.put(percent))
    }

    fn delay(&mut self, delay: &DelaySpec) -> fmt::Result {
        self.put(format_args!("delay {}", Time(delay.time)))?;
        let Some(jitter) = &delay.jitter else { return Ok(()) };
        self.put(Time(jitter.time))?;
        self.put_all(&[jitter.correlation])?;
        match &jitter.distribution {
            Some(distribution) => self.put(format_args!("distribution {}", distribution.name())),
            None => Ok(()),
        }
    }

    fn loss(&mut self, loss: &LossSpec) -> fmt::Result {
        match loss {
            LossSpec::Random(chance) => self.chance("loss", chance),
            LossSpec::State(StateSpec { p13, p31, p32, p23, p14 }) => {
                self.put("loss state")?;
                self.put_all(&[Some(*p13), *p31, *p32, *p23, *p14])
            }
            LossSpec::Gemodel(GemodelSpec { p, r, loss_in_bad, loss_in_good }) => {
                self.put("loss gemodel")?;
                self.put_all(&[Some(*p), *r, *loss_in_bad, *loss_in_good])
            }
        }
    }

    fn chance(&mut self, option: &str, chance: &ChanceSpec) -> fmt::Result {
        self.put(option)?;
        self.put_all(&[Some(chance.percent), chance.correlation])
    }

    fn rate(&mut self, rate: &RateSpec) -> fmt::Result {
        self.put(format_args!("rate {}", Bits(rate.bytes_per_sec)))?;
        let Some(framing) = rate.framing else { return Ok(()) };
        self.put(framing.overhead)?;
        let Some(cell) = framing.cell else { return Ok(()) };
        self.put(cell.size)?;
        match cell.overhead {
            Some(overhead) => self.put(overhead),
            None => Ok(()),
        }
    }

    fn cross(&mut self, cross: &CrossSpec) -> fmt::Result {
        match cross.source {
            CrossSource::Poisson { bytes_per_sec } => self.put(format_args!("cross poisson {}", Bits(bytes_per_sec)))?,
            CrossSource::OnOff { sources, peak, on, off, shape } => {
                self.put(format_args!("cross on-off {sources} {} {} {}", Bits(peak), Time(on), Time(off)))?;
                if let Some(shape) = shape {
                    self.put(shape)?;
                }
            }
        }
        match cross.size {
            Some(size) => self.put(format_args!("size {size}")),
            None => Ok(()),
        }
    }

    fn slot(&mut self, slot: &SlotSpec) -> fmt::Result {
        match &slot.gap {
            SlotGap::Range { min, max } => {
                self.put(format_args!("slot {}", Time(*min)))?;
                if let Some(max) = max {
                    self.put(Time(*max))?;
                }
            }
            SlotGap::Drawn { distribution, delay, jitter } => {
                self.put(format_args!("slot distribution {} {} {}", distribution.name(), Time(*delay), Time(*jitter)))?;
            }
        }
        if let Some(packets) = slot.packets {
            self.put(format_args!("packets {packets}"))?;
        }
        if let Some(bytes) = slot.bytes {
            self.put(format_args!("bytes {bytes}"))?;
        }
        Ok(())
    }
}

/// Prints a time as an integer of the largest unit without a fraction.
struct Time(Duration);

impl fmt::Display for Time {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let nanos = self.0.as_nanos();
        // Zero is a multiple of every unit and prints as seconds: `tc` reads zero alike in all units.
        let units = [(1_000_000_000, "s"), (1_000_000, "ms"), (1_000, "us")];
        let (scale, unit) = units.into_iter().find(|(scale, _)| nanos.is_multiple_of(*scale)).unwrap_or((1, "ns"));
        write!(f, "{}{unit}", nanos / scale)
    }
}

/// Prints a rate as an integer of the largest unit without a fraction.
struct Bits(NonZeroU64);

impl fmt::Display for Bits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let bits = u128::from(self.0.get()) * 8;
        let units = [(1_000_000_000, "gbit"), (1_000_000, "mbit"), (1_000, "kbit")];
        let (scale, unit) = units.into_iter().find(|(scale, _)| bits.is_multiple_of(*scale)).unwrap_or((1, "bit"));
        write!(f, "{}{unit}", bits / scale)
    }
}
