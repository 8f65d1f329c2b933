import typing

import numpy
from _typeshed import SupportsGetItem
from os import PathLike
from typing import Any, SupportsFloat, SupportsIndex, final

__all__ = ["Campaign", "CampaignAnswer", "Delays", "Drawing", "Held", "Link", "Run", "Scene", "State", "Table", "admittance", "boundary", "causes", "eigenvalues", "is_profile", "map", "monodromy", "profile", "stability"]

@final
class Campaign:
    """
    Checked campaign or comparison. Any process can do any of the runs.
    """
    def __new__(cls, /, text: str, file: str | PathLike[str], overrides: SupportsGetItem[int, str], vary: SupportsGetItem[int, str], runs: SupportsIndex, threads: SupportsIndex, strategies: str | None = None, roster: str | None = None) -> Campaign:
        """
        Returns a campaign over keys as for `cohaptic campaign --vary`. With `strategies`, as for `cohaptic compare --strategies`, returns a comparison.
        Without a roster, all combinations are checked.
        """
    def answer(self, /, rows: "list[list[int | float | str | None]]", verdicts: "bool", threads: "int") -> "CampaignAnswer":
        """
        Returns the results of the rows of all runs. The combinations of a comparison are judged, and with `verdicts` the combinations of a campaign. `threads`:
        number of threads for the judgement, 0 for one per core.
        """
    @property
    def roster(self, /) -> str:
        """
        Peers of all runs and left out combinations as a text, for the same campaign in another process.
        """
    def rows(self, /, start: "int", end: "int") -> "list[list[int | float | str | None]]":
        """
        Returns the rows of the runs from `start` to before `end`, computed on this thread.
        """
    @property
    def runs(self, /) -> int:
        """
        Number of runs.
        """
    def stop(self, /) -> None:
        """
        Ends all computations of rows, running and later ones.
        """

@final
class CampaignAnswer:
    """
    Results of all runs of a campaign or of a comparison.
    """
    def picture(self, /, file: str) -> str:
        """
        Returns the picture with the file name `file` as SVG.
        """
    @property
    def summary(self, /) -> str:
        """
        Document of the runs as JSON.
        """
    @property
    def table(self, /) -> Table: ...

@final
class Delays:
    """
    Measurements from files or arrays.
    """
    def fit(self, /, offset: SupportsFloat | SupportsIndex | None, least: SupportsFloat | SupportsIndex | None, skew: bool, tick: SupportsFloat | SupportsIndex | None, cut: bool, hold_out: SupportsFloat | SupportsIndex | None) -> str:
        """
        Estimates the link, and returns the document of `cohaptic fit --json`. `offset`, `least` and `tick` are in seconds.
        """
    @staticmethod
    def of(sent: "numpy.ndarray", delays: "numpy.ndarray") -> "Delays":
        """
        Returns measurements from arrays: the instant of sending \\[s\\] and the delay \\[s\\] of each packet. The delay of a lost packet is NaN.
        """
    @staticmethod
    def read(file: str | PathLike[str], receiver: str | PathLike[str] | None = None, port: SupportsIndex | None = None, direction: str | None = None, split: SupportsFloat | SupportsIndex | None = None, instant_bytes: SupportsIndex | None = None, walk: bool = False) -> Delays:
        """
        Reads a table of delays, a log of fates, a file of another program, or the captures of both ends. `direction` is `up`, `down` or `rtt`. `split` is the
        share of the round trip that is the delay. `instant_bytes` is the number of bytes that leave at each instant of a line. `walk` asks for a walk of the
        rate.
        """

@final
class Drawing:
    """
    Picture as SVG.
    """
    def __new__(cls, /, svg: str) -> Drawing:
        """
        Returns a picture that is drawn already.
        """
    def __reduce__(self, /) -> tuple[type, tuple[str]]:
        """
        Pickles the drawn picture, for other processes.
        """
    def svg(self, /) -> str:
        """
        Returns the whole text of the picture.
        """

@final
class Held:
    """
    Newest samples of the other peers.
    """
    def __len__(self, /) -> int: ...
    @property
    def mean(self, /) -> State:
        """
        Mean of the samples.
        """
    @property
    def positions(self, /) -> "numpy.ndarray":
        """
        Positions of the samples \\[m\\], a row for each other peer in the order of the scene.
        """
    @property
    def velocities(self, /) -> "numpy.ndarray":
        """
        Velocities of the samples [m/s], a row for each other peer in the order of the scene.
        """

@final
class Link:
    """
    Link: the model, and a link of this model that runs step by step.
    """
    def __new__(cls, /, keys: SupportsGetItem[int, str], seed: SupportsIndex, sender: str, receiver: str) -> Link:
        """
        Returns a link of keys, each `KEY=VALUE`. The seed and the names of both ends are the address of the random numbers.
        """
    def change(self, /, now: SupportsFloat | SupportsIndex, keys: SupportsGetItem[int, str]) -> None:
        """
        Replaces the model from the instant `now` \\[s\\] on. Packets on the way stay on the way.
        """
    def handle_packet(self, /, now: SupportsFloat | SupportsIndex, size: SupportsIndex, payload: Any, ecn: bool) -> None:
        """
        Offers a packet at the instant `now` \\[s\\].
        """
    def measure(self, /, said: str, packets: SupportsIndex, every: SupportsFloat | SupportsIndex, size: SupportsIndex, ecn: bool) -> str:
        """
        Sends a steady stream over a new link, a packet each `every` \\[s\\], and returns the document of `cohaptic link --json`. `said`: the link as the
        user wrote it.
        """
    @property
    def next(self, /) -> float | None:
        """
        Instant of the next event \\[s\\]: `poll` with this number returns the event. `None` if no packet is on the way.
        """
    def poll(self, /, now: "float") -> "list[tuple[typing.Any, int, int, float, float, str, int, bool, bool]]":
        """
        Lets time pass until `now` \\[s\\], and returns the events since the last call.
        """
    def send(self, /, times: "numpy.ndarray", sizes: "numpy.ndarray", ecn: "bool") -> "tuple[typing.Any, ...]":
        """
        Sends a packet at each of the times \\[s\\] over a new link, and returns the fates after the last arrival.
        """

@final
class Run:
    """
    Run with its summary and the kept rows.
    """
    def __new__(cls, /, scene: "Scene", threads: "int", general: "bool", trajectory: "bool", packets: "bool", law: "typing.Any | None" = None) -> Run:
        """
        Runs a scene. `law`: function that makes the coordination law of each peer; `None` for the law of the scene.
        """
    def links(self, /) -> Table: ...
    @property
    def packets(self, /) -> Table | None: ...
    def picture(self, /, file: str) -> str:
        """
        Returns the picture with the file name `file` as SVG.
        """
    @property
    def summary(self, /) -> str:
        """
        Document of the run as JSON.
        """
    @property
    def title(self, /) -> str: ...
    @property
    def trajectory(self, /) -> Table | None: ...

@final
class Scene:
    """
    Checked scene.
    """
    def __new__(cls, /, text: str, file: str | PathLike[str], overrides: SupportsGetItem[int, str]) -> Scene:
        """
        Reads a scene from a text. `file` is the name for messages, and its folder is the base of files that the scene names. Overrides are `KEY=VALUE`.
        """
    @property
    def axes(self, /) -> int: ...
    def check(self, /, general: bool) -> tuple[list[str], str, list[str]]:
        """
        Checks the scene. Returns the failures, the expectations as JSON, and the notes.
        """
    @property
    def duration(self, /) -> float:
        """
        Duration \\[s\\].
        """
    def explain(self, /) -> str:
        """
        Returns the modelled parts of the scene and the parts left out, as JSON.
        """
    @property
    def file(self, /) -> str: ...
    @property
    def overrides(self, /) -> list[str]: ...
    @property
    def peers(self, /) -> list[str]: ...
    @staticmethod
    def read(file: str | PathLike[str], overrides: SupportsGetItem[int, str]) -> Scene:
        """
        Reads a scene from a file.
        """
    @property
    def seed(self, /) -> int: ...
    @property
    def text(self, /) -> str: ...
    @property
    def title(self, /) -> str: ...

@final
class State:
    """
    Position and velocity of a copy along each axis.
    """
    @property
    def position(self, /) -> "numpy.ndarray":
        """
        Position \\[m\\], a number for each axis.
        """
    @property
    def velocity(self, /) -> "numpy.ndarray":
        """
        Velocity [m/s], a number for each axis.
        """

@final
class Table:
    """
    Columns of equal length. NumPy arrays are views of the memory that Arrow gets.
    """
    def __arrow_c_schema__(self, /) -> "typing.Any":
        """
        Returns the schema, by the Arrow PyCapsule protocol.
        """
    def __arrow_c_stream__(self, /, requested_schema: "typing.Any | None" = None) -> "typing.Any":
        """
        Returns the rows, by the Arrow PyCapsule protocol.
        """
    def __len__(self, /) -> int: ...
    def address(self, /, name: str) -> int:
        """
        Returns the address of the numbers of a column.
        """
    def categories(self, /, name: str) -> list[str] | None:
        """
        Returns the names for which the codes of a column stand; `None` for a column of numbers.
        """
    def column(self, /, name: "str") -> "numpy.ndarray":
        """
        Returns the numbers of a column without a copy; for a column of names, the codes of the names.
        """
    @property
    def names(self, /) -> list[str]:
        """
        Names of the columns.
        """
    def unit(self, /, name: str) -> str:
        """
        Returns the unit of a column; empty for a column without a unit.
        """

def admittance(scene: "Scene", peer: "str", frequencies: "list[float] | typing.Callable[[float], list[float]]", axis: "str | None", seen: "str | None") -> "dict[str, typing.Any]":
    """
    Returns the admittance of a peer as a mapping: at frequencies \\[Hz\\], or at the frequencies that a function returns for the highest valid
    frequency.
    """

def boundary(scene: "Scene", along: "str", tolerance: "float | None", samples: "int | None", threads: "int") -> "dict[str, typing.Any]":
    """
    Returns every crossing along a key, `KEY=LOW..HIGH`, as a mapping.
    """

def causes() -> list[str]:
    """
    Returns the names of the causes of drops, indexed by code. Code 0 stands for no cause.
    """

def eigenvalues(rows: "list[list[float]]") -> "numpy.ndarray":
    """
    Returns the eigenvalues of a square matrix, in the order of decreasing modulus.
    """

def is_profile(word: str) -> bool:
    """
    Returns whether a word names a link of the library, such as `starlink/down`.
    """

def map(scene: "Scene", x: "str", y: "str", columns: "int", rows: "int", threads: "int") -> "dict[str, typing.Any]":
    """
    Returns the radius over a grid of two keys, each `KEY=LOW..HIGH`, as a mapping.
    """

def monodromy(scene: "Scene", law: "typing.Any | None" = None) -> "tuple[numpy.ndarray, list[tuple[str, str]], float, float, int, float]":
    """
    Returns the monodromy matrix with the names of its states and further facts.
    """

def profile(name: str) -> str:
    """
    Returns the document of a link of the library, such as `starlink` or `starlink@1`.
    """

def stability(scene: "Scene", method: "str", law: "typing.Any | None" = None) -> "dict[str, typing.Any]":
    """
    Returns the verdict on the scene as a mapping.
    """
