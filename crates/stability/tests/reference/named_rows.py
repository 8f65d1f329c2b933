"""Frames whose states have names, for laws that send more than the states of copies: what happens at an instant is sums of what has names then."""

from fractions import Fraction

from frame_over_box import Frame, Part
from numbers_over_box import NotCovered, Scalar, combination, difference, row_of, scalar, times

POSITION, VELOCITY = STATE = ("position", "velocity")
BODIES = ("device", "copy")


class Rows(dict):
    """Rows by the names of what they are of."""

    def __missing__(self, name):
        raise NotCovered(f"a sample that is missing: {name}")


class NamedPart(Part):
    """A part of the motion. All clocks are equal, so that everybody sends at the same instant, once in a frame; that sample has the number 0, the one before it −1.

    `references` has for each class whose positions are relative the name of the position that they are counted from. Forces that wait are counted as lengths, multiplied by the compliance [m/N] that the certificate names.
    """

    references = {}

    def __init__(self, box, part):
        super().__init__(box, part["difference"], part["members"], part["states"], None, part["time"])
        self.states = [(*name[:3], STATE[name[3]]) if name[0] == "sample" else name for name in self.states]
        self.compliance = Fraction(part["compliance"])
        if part["heard"] is not None or not self.compliance > 0:
            raise NotCovered("expected whole samples, and a compliance above zero")

    def frame(self) -> Frame:
        size, box = len(self.states), self.box
        rows = Rows({state: self.unit(size, place) for place, state in enumerate(self.states)})
        rows.update({name: self.zeros(size) for name in self.references.values()})
        bodies = {(*body, of) for body in self.bodies() for of in STATE}
        if len(rows) != size + len(set(self.references.values())) or {name for name in rows if name[0] in BODIES} != bodies:
            raise NotCovered("states of bodies that are not those of the scene, or stand there twice")
        for sent, moved in self.instants():
            rows.update({name: combination(of, rows) for name, of in sent.items()})
            of_name = lambda name: moved.get(name, {name: self.constant(1)})
            shift = {c: of_name(name) for c, name in self.references.items()}
            relative = lambda name: difference(of_name(name), shift[name[1]]) if POSITION in name and name[1] in shift else of_name(name)
            after = {name: combination(relative(name), rows) for name in rows if name in moved or POSITION in name}
            rows = Rows({**rows, **after, **{name: self.zeros(size) for name in self.references.values()}})
        older = lambda name: name if name[0] in BODIES else (*name[:2], name[2] + 1, *name[3:])
        if not all(older(name) in rows for name in self.states):
            raise NotCovered("samples that are states without those after them")
        final = [rows[older(name)] for name in self.states]
        return Frame([row.mean for row in final], [[row.slopes[k] for row in final] for k in range(box.count)], [row.radius for row in final])

    def body(self, kind, c):
        return [(kind, c, of) for of in STATE]

    def coupling(self, c, device, thing):
        """FC of a class, for a device and an object of those names."""
        gains = [self.box.gain(self.first[c], name) for name in ("kc", "bc")]
        gains = [scalar(gains[0]), scalar(gains[1].scaled(1 / self.time))]
        return dict(zip([*device, *thing], [*gains, *map(negated, gains)]))

    def moved(self, body, c, state, force):
        """Where a body of a class is after a tick under a force, of where everything is before it."""
        e00, e01, e10, e11, g0, g1 = self.box.step(self.first[c], body)
        t, (x, v) = self.time, state
        only = lambda name: {name: self.constant(1)}
        along = lambda own, by_x, by_v, by_force: added(only(own), {x: scalar(by_x), v: scalar(by_v)}, scaled(force, scalar(by_force)))
        return {x: along(x, e00, e01.scaled(1 / t), g0), v: along(v, e10.scaled(t), e11, g1.scaled(t))}


def negated(number: Scalar) -> Scalar:
    return Scalar(-number.mean, [-slope for slope in number.slopes], number.radius)


def scaled(coefficients, by: Scalar):
    return {name: times(number, by) for name, number in coefficients.items()}


def added(*all_of):
    """Sums of coefficients, by name."""
    total = {}
    for coefficients in all_of:
        for name, number in coefficients.items():
            total[name] = (row_of(total[name]) + row_of(number)).entry(0) if name in total else number
    return total
