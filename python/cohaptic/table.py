"""Tables: columns that NumPy and Arrow share."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from cohaptic import _native


class Table:
    """Columns by their names, as read-only NumPy arrays that are not copied.

    Tables have the Arrow PyCapsule protocol. ``pyarrow.table(t)``, ``polars.DataFrame(t)``, ``pandas.DataFrame.from_arrow(t)`` and queries of DuckDB read a
    table over the same memory. DuckDB finds the table by the name of its Python variable. A column of names is stored as codes, and is a dictionary
    column in Arrow.

    >>> from cohaptic import Scene
    >>> scene = Scene('''
    ... scene = { duration = "16ms", count = 2 }
    ... object.mass = 0.45
    ... coordination = { strategy = "average-position", stiffness = 1000.0, update = "8ms" }
    ... peer = { device = { mass = 0.1 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
    ... ''')
    >>> packets = scene.run().packets
    >>> list(packets)
    ['link', 'sequence', 'sent', 'arrived', 'fate']
    >>> packets["sent"]
    array([0.   , 0.   , 0.008, 0.008])
    >>> packets.decode("link")[:2].tolist()
    ['peer1->peer2', 'peer2->peer1']
    """

    def __init__(self, native: _native.Table) -> None:
        self._native = native

    def __getitem__(self, name: str) -> np.ndarray:
        return self._native.column(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._native.names)

    def __contains__(self, name: object) -> bool:
        return name in self._native.names

    def keys(self) -> list[str]:
        """Returns the names of the columns. ``dict(table)`` maps these names to the arrays."""
        return self._native.names

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self._native)

    def categories(self, name: str) -> list[str] | None:
        """Returns the names for which the codes of a column stand; ``None`` for a column of numbers."""
        return self._native.categories(name)

    def decode(self, name: str) -> np.ndarray:
        """Returns a column of names as an array of texts, a copy. Returns a column of numbers unchanged."""
        names = self.categories(name)
        return self[name] if names is None else np.array(names, dtype=object)[self[name]]

    def unit(self, name: str) -> str:
        """Returns the unit of the column of a varied key: ``ms`` or ``%`` as in its values, ``N/m`` for a stiffness; empty for other columns."""
        return self._native.unit(name)

    def to_pandas(self) -> Any:
        """Returns a copy of the table as a ``pandas.DataFrame``, with categorical columns of names. The package ``pandas`` must be installed.

        ``frame.attrs["units"]`` maps columns to their units.
        """
        import pandas  # type: ignore[import-untyped]

        def column(name: str) -> Any:
            names = self.categories(name)
            return self[name] if names is None else pandas.Categorical.from_codes(self[name], categories=names)

        frame = pandas.DataFrame({name: column(name) for name in self}, copy=True)
        frame.attrs["units"] = {name: unit for name in self if (unit := self.unit(name))}
        return frame

    def address(self, name: str) -> int:
        """Returns the address in memory of the numbers of a column. The NumPy array and Arrow share this memory."""
        return self._native.address(name)

    def __arrow_c_schema__(self) -> object:
        """Returns the schema, by the Arrow PyCapsule protocol."""
        return self._native.__arrow_c_schema__()

    def __arrow_c_stream__(self, requested_schema: Any | None = None) -> object:
        """Returns the rows, by the Arrow PyCapsule protocol."""
        return self._native.__arrow_c_stream__(requested_schema)

    def __repr__(self) -> str:
        return f"<Table of {self.rows} rows: {', '.join(self)}>"
