"""What is raised: each class is a :class:`CohapticError`, and that is a :class:`ValueError`."""

from __future__ import annotations

from typing import Any


class CohapticError(ValueError):
    """A scene, a link or an analysis is refused."""


class AnalysisError(CohapticError):
    """A scene has no such analysis."""


class SceneError(CohapticError):
    """A scene or a link makes no sense, at a place.

    >>> from cohaptic import Link, SceneError
    >>> try:
    ...     Link("delay 8 parsecs")
    ... except SceneError as error:
    ...     print(error.key)
    link.netem
    """

    file: str | None
    """The file with the fault; ``None`` if it is in an override."""
    argument: str | None
    """The ``KEY=VALUE`` with the fault; ``None`` if it is in a file."""
    line: int | None
    """The line, from 1."""
    column: int | None
    """The column, from 1, in characters."""
    key: str | None
    """The dotted path of the key."""
    fault: str | None
    """The fault and what was expected, in one line; the text of the exception shows the line of the file too."""

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
        """For executors, whose workers raise in another process."""
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
