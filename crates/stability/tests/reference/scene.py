"""Reads the part of a scene file that these references use. Whatever is not known is refused, so that no key is overlooked in silence."""

import re
import tomllib
from dataclasses import dataclass, field
from fractions import Fraction

UNITS = {"ns": 1, "us": 10**3, "ms": 10**6, "s": 10**9, "min": 60 * 10**9, "h": 3600 * 10**9}
SMOOTHED, EXTRAPOLATED, LOCAL_LAG = "smoothed-average-position", "extrapolated", "local-lag"
# The laws that have a parameter of their own: its key and its default.
LAWS = {SMOOTHED: ("lag", "10ms"), EXTRAPOLATED: ("horizon", "100ms"), LOCAL_LAG: ("lag", "auto")}


def nanoseconds(text):
    """A duration as whole nanoseconds, rounded once (ties to even)."""
    number, unit = re.fullmatch(r"([0-9.]+)(ns|us|ms|s|min|h)", text).groups()
    return round(Fraction(number) * UNITS[unit])


def chance(value):
    """A probability: the double nearest to what is written."""
    return float(value[:-1]) / 100 if isinstance(value, str) else float(value)


@dataclass
class Peer:
    name: str
    tick: int  # Tc [ns]
    offset: int  # [ns]
    phase: int  # [ticks]
    compute_delay: bool
    touches: bool
    device_mass: float  # mH [kg]
    device_damping: float  # bH [N·s/m]
    coupling: tuple  # KC [N/m], BC [N·s/m], before scaling
    coupling_scaling: bool
    arm: tuple | None  # mass, damping, stiffness


@dataclass
class Link:
    delay: int = 0  # [ns]; the mean with jitter
    loss: object = 0.0  # a probability, or a dict p, r, h, k
    uniform_sd: int = 0  # [ns]


class EqualLinks(dict):
    """Thousands of equal peers have millions of equal links: the one of `None` stands for all."""

    def __missing__(self, ends):
        return self[None]


@dataclass
class Scene:
    text: str
    mass: float
    damping: float
    split: bool
    proportional_derivative: bool
    stiffness: float  # KT
    rate: float  # BT
    inverse_n: bool
    update: int  # Tn [ns]
    peers: list
    links: dict = field(default_factory=dict)  # (from, to) -> Link
    identical: bool = False  # made by `count`
    lag: int | None = None  # of smoothed-average-position [ns]
    horizon: int | None = None  # of extrapolated [ns]
    own_age: int | None = None  # the lag of local-lag [ns]

    def looks_back(self, place):
        """L: how many ticks old the own state is that the law of a peer compares, rounded up."""
        return 0 if self.own_age is None else -(-self.own_age // self.peers[place].tick)


def take(table, *known):
    """Refuses a table with a key that is not known here."""
    unknown = set(table) - set(known)
    if unknown:
        raise ValueError(f"keys not covered: {unknown}")
    return table


def lay_over(below, above):
    """One table over another: key by key, also within tables of the kinds that scenes.md names; hand and contact as a whole."""
    merged = dict(below)
    for key, value in above.items():
        if key in ("device", "coupling", "clock") and key in below:
            value = {**below[key], **value}
        merged[key] = value
    return merged


def peer(name, table):
    take(table, "name", "tick", "compute-delay", "phase", "contact", "device", "coupling", "hand", "clock")
    contact = table.get("contact", "grasp")
    if contact not in ("grasp", "none"):
        raise ValueError("only linear contacts")
    device = take(table["device"], "mass", "damping")
    coupling = take(table.get("coupling", {"stiffness": 0.0}), "stiffness", "damping", "scaling")
    # What a hand does is no part of the motion by itself; the arm that does it is.
    arm = take(table.get("hand", {}), "arm", "force", "follows").get("arm")
    if arm is not None:
        arm = tuple(float(arm[key]) for key in ("mass", "damping", "stiffness"))
    return Peer(
        name=name,
        tick=nanoseconds(table.get("tick", "1ms")),
        offset=nanoseconds(take(table.get("clock", {}), "offset").get("offset", "0s")),
        phase=table.get("phase", 0),
        compute_delay=table.get("compute-delay", 0) == 1,
        touches=contact == "grasp",
        device_mass=float(device["mass"]),
        device_damping=float(device.get("damping", 0.0)),
        coupling=(float(coupling["stiffness"]), float(coupling.get("damping", 0.0))),
        coupling_scaling=coupling.get("scaling", "none") == "inverse-n",
        arm=arm,
    )


def link(table):
    take(table, "delay", "loss", "jitter", "from", "to")
    made = Link(delay=nanoseconds(table.get("delay", "0s")))
    loss = table.get("loss", 0.0)
    if isinstance(loss, dict):
        loss = take(take(loss, "gilbert-elliott")["gilbert-elliott"], "p", "r", "h", "k")
        loss = {"h": 0.0, "k": 1.0, **{key: chance(value) for key, value in loss.items()}}
        loss.setdefault("r", 1 - loss["p"])
    else:
        loss = chance(loss)
    made.loss = loss
    if "jitter" in table:
        jitter = take(table["jitter"], "sd", "distribution")
        if jitter["distribution"] != "uniform":
            raise ValueError("only uniform jitter")
        made.uniform_sd = nanoseconds(jitter["sd"])
    return made


def parse(text):
    """The scene that a text describes."""
    return read(tomllib.loads(text), text)


def read(root, text):
    """The scene that tables describe."""
    root = take(root, "scene", "object", "coordination", "peer", "peers", "link", "links", "expect")
    head = take(root["scene"], "title", "duration", "seed", "count")
    thing = take(root["object"], "mass", "damping", "split-mass")
    coordination = take(root["coordination"], "strategy", "stiffness", "damping", "update", "scaling", *LAWS)
    strategy = coordination["strategy"]
    if strategy not in ("average-position", "proportional-derivative", *LAWS):
        raise ValueError(f"a strategy not covered: {strategy}")
    own_of_laws = {law: take(coordination.get(law, {}), key).get(key, default) for law, (key, default) in LAWS.items()}
    common = root.get("peer", {})
    tables = {f"peer{i + 1}": common for i in range(head.get("count", 0))}
    for entry in root.get("peers", []):
        tables[entry["name"]] = lay_over(common, entry)
    peers = [peer(name, table) for name, table in tables.items()]
    own = {(entry["from"], entry["to"]): entry for entry in root.get("links", [])}
    names = [p.name for p in peers]
    links = {}
    if len(names) > 64 and "peers" not in root and "links" not in root:
        links = EqualLinks({None: link(root.get("link", {}))})
    pairs = ((i, j) for i in range(len(names)) for j in range(len(names)) if i != j) if len(names) <= 64 else ()
    for i, j in pairs:
        links[i, j] = link({**root.get("link", {}), **own.get((names[i], names[j]), {})})
    return Scene(
        text=text,
        mass=float(thing["mass"]),
        damping=float(thing.get("damping", 0.0)),
        split=thing.get("split-mass", True),
        proportional_derivative=strategy == "proportional-derivative",
        stiffness=float(coordination["stiffness"]),
        rate=float(coordination.get("damping", 0.0)),
        inverse_n=coordination.get("scaling", "none") == "inverse-n",
        update=nanoseconds(coordination["update"]),
        peers=peers,
        links=links,
        identical="peers" not in root and "links" not in root,
        lag=nanoseconds(own_of_laws[SMOOTHED]) if strategy == SMOOTHED else None,
        horizon=nanoseconds(own_of_laws[EXTRAPOLATED]) if strategy == EXTRAPOLATED else None,
        own_age=own_age(own_of_laws[LOCAL_LAG], nanoseconds(coordination["update"]), peers, links) if strategy == LOCAL_LAG else None,
    )


def own_age(text, update, peers, links):
    """The lag of local-lag [ns]; of "auto" the delay in whole ticks, rounded up, and half of the ticks to the next sample, rounded down."""
    if text != "auto":
        return nanoseconds(text)
    (tick,), (delay,) = {p.tick for p in peers}, {link.delay for link in links.values()}
    return (-(-delay // tick) + (update // tick - 1) // 2) * tick
