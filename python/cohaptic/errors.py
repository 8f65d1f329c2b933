"""Exceptions of the package. Each class is a :class:`CohapticError`, which is a :class:`ValueError`."""

from __future__ import annotations

from typing import Any


class CohapticError(ValueError):
    """A scene, a link or an analysis is refused."""


class AnalysisError(CohapticError):
    """The analysis does not cover the scene."""


class SceneError(CohapticError):
    """A scene or a link is refused, with the place of the fault.

    >>> from cohaptic import Link, SceneError
    >>> try:
    ...     Link("delay 8 parsecs")
    ... except SceneError as error:
    ...     print(error.key)
    link.netem
    """

    file: str | None
    """File with the fault; ``None`` if the fault is in an override."""
    argument: str | None
    """Override ``KEY=VALUE`` with the fault; ``None`` if the fault is in a file."""
    line: int | None
    """Line of the fault, from 1."""
    column: int | None
    """Column of the fault [characters], from 1."""
    key: str | None
    """Dotted path of the key."""
    fault: str | None
    """Fault and expected form, in one line. The text of the exception also shows the line of the file."""

    def __init__(
        self,
        message: str,
        file: str | None = None,
        argument: str | None = None,
        line: int | None = None,
        column: int | None = None,
        key: str | None = None,
        fault: str | None = None,
    ) -> None:
        super().__init__(message)
        self.file, self.argument, self.line, self.column, self.key, self.fault = (
            file,
            argument,
            line,
            column,
            key,
            fault,
        )

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickles the exception, because workers of executors raise in another process."""
        place = (self.file, self.argument, self.line, self.column, self.key, self.fault)
        return type(self), (self.args[0], *place)


class UnreadableError(SceneError):
    """A file cannot be read."""


def _of_scene(
    message: str,
    file: str | None,
    argument: str | None,
    line: int | None,
    column: int | None,
    key: str | None,
    fault: str | None,
    unreadable: bool,
) -> SceneError:
    made = UnreadableError if unreadable else SceneError
    return made(message, file, argument, line, column, key, fault)
