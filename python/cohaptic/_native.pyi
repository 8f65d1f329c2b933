import typing

import numpy
from _typeshed import SupportsGetItem
from os import PathLike
from typing import Any, SupportsFloat, SupportsIndex, final

__all__ = ["Campaign", "CampaignAnswer", "Delays", "Drawing", "Held", "Link", "Run", "Scene", "State", "Table", "admittance", "boundary", "causes", "eigenvalues", "is_profile", "map", "monodromy", "profile", "stability"]

@final
class Campaign:
    """
    A campaign or a comparison that was checked, any runs of which can be made in any process.
    """
    def __new__(cls, /, text: str, file: str | PathLike[str], overrides: SupportsGetItem[int, str], vary: SupportsGetItem[int, str], runs: SupportsIndex, threads: SupportsIndex, strategies: str | None = None, roster: str | None = None) -> Campaign:
        """
        Keys are varied as by `cohaptic campaign --vary`. With strategies it is a comparison of these, as by `cohaptic compare --strategies`. Without a roster, all
        combinations are checked.
        """
    def answer(self, /, rows: "list[list[int | float | str | None]]", verdicts: "bool", threads: "int") -> "CampaignAnswer":
        """
        What the rows of all runs come to. Combinations are judged on that number of threads, 0 for one a core: those of a comparison always, those of a campaign with
        `verdicts`.
        """
    @property
    def roster(self, /) -> str:
        """
        Everybody who takes part, for the same campaign in another process.
        """
    def rows(self, /, start: "int", end: "int") -> "list[list[int | float | str | None]]":
        """
        The rows of the runs from one number up to another, on this thread.
        """
    @property
    def runs(self, /) -> int:
        """
        How many runs there are.
        """
    def stop(self, /) -> None:
        """
        Ends every computation of rows, now and later.
        """

@final
class CampaignAnswer:
    """
    What all runs of a campaign or of a comparison come to.
    """
    def picture(self, /, file: str) -> str:
        """
        The picture of that file name as SVG.
        """
    @property
    def summary(self, /) -> str:
        """
        As JSON.
        """
    @property
    def table(self, /) -> Table: ...

@final
class Delays:
    """
    A source of measurements.
    """
    def fit(self, /, offset: SupportsFloat | SupportsIndex | None, least: SupportsFloat | SupportsIndex | None, skew: bool, tick: SupportsFloat | SupportsIndex | None, cut: bool, hold_out: SupportsFloat | SupportsIndex | None) -> str:
        """
        Estimates the link, and gives the document of `cohaptic fit --json`. `offset`, `least` and `tick` are in seconds.
        """
    @staticmethod
    def of(sent: "numpy.ndarray", delays: "numpy.ndarray") -> "Delays":
        """
        Delays \\[s\\] of packets sent at those instants \\[s\\]; NaN of packets that were lost.
        """
    @staticmethod
    def read(file: str | PathLike[str], receiver: str | PathLike[str] | None = None, port: SupportsIndex | None = None, direction: str | None = None, split: SupportsFloat | SupportsIndex | None = None, instant_bytes: SupportsIndex | None = None, walk: bool = False) -> Delays:
        """
        Reads a table of delays, a log of fates or a file of another program, or the captures of both ends. `direction` is `up`, `down` or `rtt`; `split` is the
        share of the round trip that is the delay. `instant_bytes` leave at each instant of a line, and `walk` asks for a walk of the rate.
        """

@final
class Drawing:
    """
    A picture as SVG.
    """
    def __new__(cls, /, svg: str) -> Drawing:
        """
        One that is drawn already.
        """
    def __reduce__(self, /) -> tuple[type, tuple[str]]:
        """
        For other processes it is drawn.
        """
    def svg(self, /) -> str:
        """
        All of it.
        """

@final
class Held:
    """
    The newest samples from the others.
    """
    def __len__(self, /) -> int: ...
    @property
    def mean(self, /) -> State:
        """
        Their mean.
        """
    @property
    def positions(self, /) -> "numpy.ndarray":
        """
        A row for each other peer, in the order of the scene \\[m\\].
        """
    @property
    def velocities(self, /) -> "numpy.ndarray":
        """
        A row for each other peer, in the order of the scene [m/s].
        """

@final
class Link:
    """
    A link: a model, and one that runs step by step.
    """
    def __new__(cls, /, keys: SupportsGetItem[int, str], seed: SupportsIndex, sender: str, receiver: str) -> Link:
        """
        A link of these keys, each `KEY=VALUE`. Seed and ends are the address of its random numbers.
        """
    def change(self, /, now: SupportsFloat | SupportsIndex, keys: SupportsGetItem[int, str]) -> None:
        """
        Replaces the model from now \\[s\\] on, with its packets on the way.
        """
    def handle_packet(self, /, now: SupportsFloat | SupportsIndex, size: SupportsIndex, payload: Any, ecn: bool) -> None:
        """
        Offers a packet now \\[s\\].
        """
    def measure(self, /, said: str, packets: SupportsIndex, every: SupportsFloat | SupportsIndex, size: SupportsIndex, ecn: bool) -> str:
        """
        Sends a steady stream over a link that is new, one packet every so often \\[s\\], and gives the document of `cohaptic link --json`. `said`: the link as it was said.
        """
    @property
    def next(self, /) -> float | None:
        """
        The instant at which something happens next \\[s\\]: `poll` of this number gives it. `None` if nothing is on the way.
        """
    def poll(self, /, now: "float") -> "list[tuple[typing.Any, int, int, float, float, str, int, bool, bool]]":
        """
        Lets time pass until then \\[s\\], and gives what has happened.
        """
    def send(self, /, times: "numpy.ndarray", sizes: "numpy.ndarray", ecn: "bool") -> "tuple[typing.Any, ...]":
        """
        Sends packets at those times \\[s\\] over a link that is new, and lets everything arrive.
        """

@final
class Run:
    """
    A run: its summary, and the rows that were kept.
    """
    def __new__(cls, /, scene: "Scene", threads: "int", general: "bool", trajectory: "bool", packets: "bool", law: "typing.Any | None" = None) -> Run:
        """
        Runs a scene. `law`: makes the coordination law of each peer; `None` for that of the scene.
        """
    def links(self, /) -> Table: ...
    @property
    def packets(self, /) -> Table | None: ...
    def picture(self, /, file: str) -> str:
        """
        The picture of that file name as SVG.
        """
    @property
    def summary(self, /) -> str:
        """
        As JSON.
        """
    @property
    def title(self, /) -> str: ...
    @property
    def trajectory(self, /) -> Table | None: ...

@final
class Scene:
    """
    A checked scene.
    """
    def __new__(cls, /, text: str, file: str | PathLike[str], overrides: SupportsGetItem[int, str]) -> Scene:
        """
        Reads a scene from a text; `file` stands in messages, and its folder is where files that the scene names are looked for. Overrides are `KEY=VALUE`.
        """
    @property
    def axes(self, /) -> int: ...
    def check(self, /, general: bool) -> tuple[list[str], str, list[str]]:
        """
        Failures, expectations as JSON, and notes.
        """
    @property
    def duration(self, /) -> float:
        """
        In seconds.
        """
    def explain(self, /) -> str:
        """
        What the scene makes the program model, as JSON.
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
    Where a copy is, and how fast it is, along each axis.
    """
    @property
    def position(self, /) -> "numpy.ndarray":
        """
        In metres.
        """
    @property
    def velocity(self, /) -> "numpy.ndarray":
        """
        In metres a second.
        """

@final
class Table:
    """
    Columns of one length. A column of NumPy is a view of the memory that Arrow gets.
    """
    def __arrow_c_schema__(self, /) -> "typing.Any":
        """
        The schema, by the Arrow PyCapsule protocol.
        """
    def __arrow_c_stream__(self, /, requested_schema: "typing.Any | None" = None) -> "typing.Any":
        """
        The rows, by the Arrow PyCapsule protocol.
        """
    def __len__(self, /) -> int: ...
    def address(self, /, name: str) -> int:
        """
        Where the numbers of a column are.
        """
    def categories(self, /, name: str) -> list[str] | None:
        """
        The names that the codes of a column stand for; `None` for a column of numbers.
        """
    def column(self, /, name: "str") -> "numpy.ndarray":
        """
        The numbers of a column without a copy; of a column of names their codes.
        """
    @property
    def names(self, /) -> list[str]:
        """
        The names of the columns.
        """
    def unit(self, /, name: str) -> str:
        """
        The unit of a column; empty if it has none.
        """

def admittance(scene: "Scene", peer: "str", frequencies: "list[float] | typing.Callable[[float], list[float]]", axis: "str | None", seen: "str | None") -> "dict[str, typing.Any]":
    """
    The admittance of a peer at frequencies \\[Hz\\], or at those that `spread` makes of the highest one, as a mapping.
    """

def boundary(scene: "Scene", along: "str", tolerance: "float | None", samples: "int | None", threads: "int") -> "dict[str, typing.Any]":
    """
    Every crossing along a key, `KEY=LOW..HIGH`, as a mapping.
    """

def causes() -> list[str]:
    """
    The names of the causes, by code: no cause first.
    """

def eigenvalues(rows: "list[list[float]]") -> "numpy.ndarray":
    """
    The eigenvalues of a square matrix, by falling modulus.
    """

def is_profile(word: str) -> bool:
    """
    Whether a word names a link of the library, such as `starlink/down`.
    """

def map(scene: "Scene", x: "str", y: "str", columns: "int", rows: "int", threads: "int") -> "dict[str, typing.Any]":
    """
    The radius over a grid of two keys, each `KEY=LOW..HIGH`, as a mapping.
    """

def monodromy(scene: "Scene", law: "typing.Any | None" = None) -> "tuple[numpy.ndarray, list[tuple[str, str]], float, float, int, float]":
    """
    The monodromy matrix.
    """

def profile(name: str) -> str:
    """
    The document of a link of the library: `starlink`, `starlink@1`.
    """

def stability(scene: "Scene", method: "str", law: "typing.Any | None" = None) -> "dict[str, typing.Any]":
    """
    The verdict on the scene, as a mapping.
    """
