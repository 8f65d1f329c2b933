"""The gate between a wanted force and a device in somebody's hand."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum


class Cause(Enum):
    """Causes of zero force, in the order of the checks, and the absence of any."""

    STOPPED = "stopped"
    NOT_READY = "not ready"
    NOT_ARMED = "not armed"
    STALE_READING = "stale reading"
    STALE_SETPOINT = "stale setpoint"
    LOOP_LATE = "loop late"
    NOT_FINITE = "not finite"
    FORCE = "force"
    """No cause: a force passed."""


@dataclass(frozen=True)
class Limits:
    """Limits of every force."""

    force: float = 3.0
    """Largest force [N], at most 20."""
    slew: float = 1000.0
    """Fastest change of a force [N/s]. A force that becomes zero for a cause drops at once."""
    reading_age_ns: int = 10_000_000
    """Age of the newest reading above which the force is zero [ns]."""
    setpoint_age_ns: int = 50_000_000
    """Age of a setpoint, the force that is asked for, above which the force is zero [ns]."""
    gap_ns: int = 20_000_000
    """Pause of the loop above which the next force is zero [ns]."""

    def __post_init__(self) -> None:
        if not 0 <= self.force <= 20:
            raise ValueError(f"the limit of force must be within 0 to 20 N, and is {self.force}")
        if not 0 < self.slew <= 1e6:
            raise ValueError(f"the limit of slew must be within 0 to 1000000 N/s, and is {self.slew}")


@dataclass(frozen=True)
class Moment:
    """State of device and loop when a force is asked for. Times are in ns, or ``None`` for never."""

    now: int
    ready: bool
    armed: bool
    reading_at: int | None
    setpoint_at: int | None


class Gate:
    """The only way of a force to a device. After zero, a force grows from zero at most as fast as the limit of slew allows."""

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        self.counts = dict.fromkeys(Cause, 0)
        self._last = [0.0, 0.0, 0.0]
        self._last_at: int | None = None
        self._stopped = False

    def stop(self) -> None:
        """Makes every later force zero, for good. May be called from any thread, and as often as one likes."""
        self._stopped = True

    @property
    def is_stopped(self) -> bool:
        """Whether the gate was stopped."""
        return self._stopped

    def admit(self, wanted: Sequence[float], moment: Moment) -> tuple[list[float], Cause]:
        """Returns the force that may go to the device [N], and why it is zero.

        Must be called once for each push, because the calls measure the time between pushes.
        """
        passed = 0 if self._last_at is None else moment.now - self._last_at
        self._last_at = moment.now
        cause = self._cause(wanted, moment, passed)
        self.counts[cause] += 1
        if cause is not Cause.FORCE:
            self._last = [0.0, 0.0, 0.0]
            return [0.0, 0.0, 0.0], cause
        force = _shortened(wanted, self.limits.force)
        # Both ends of the change are within the limit of force, and so are all points between the ends.
        change = [to - last for to, last in zip(force, self._last, strict=True)]
        change = _shortened(change, self.limits.slew * (passed / 1e9))
        self._last = [last + part for last, part in zip(self._last, change, strict=True)]
        return list(self._last), cause

    def _cause(self, wanted: Sequence[float], moment: Moment, passed: int) -> Cause:
        def is_old(at: int | None, age: int) -> bool:
            # An instant in the future is not fresh either: a clock that jumps back must not keep an old force.
            return at is None or not 0 <= moment.now - at <= age

        checks = (
            (self._stopped, Cause.STOPPED),
            (not moment.ready, Cause.NOT_READY),
            (not moment.armed, Cause.NOT_ARMED),
            (is_old(moment.reading_at, self.limits.reading_age_ns), Cause.STALE_READING),
            (is_old(moment.setpoint_at, self.limits.setpoint_age_ns), Cause.STALE_SETPOINT),
            (not 0 <= passed <= self.limits.gap_ns, Cause.LOOP_LATE),
            (not all(map(math.isfinite, wanted)), Cause.NOT_FINITE),
        )
        return next((cause for fails, cause in checks if fails), Cause.FORCE)


def _shortened(vector: Sequence[float], longest: float) -> list[float]:
    """Returns a vector of finite components, shortened to the length ``longest`` if it is longer."""
    # The length of finite components can overflow, so the vector is first scaled to components of at most 1.
    largest = max(map(abs, vector))
    if largest == 0:
        return list(vector)
    unit = [part / largest for part in vector]
    length = math.sqrt(sum(part * part for part in unit))
    if largest <= longest / length:
        return list(vector)
    return [part / length * longest for part in unit]
