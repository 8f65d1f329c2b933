#!/usr/bin/env python3
"""Checks a certificate of `cohaptic stability` with no part of the program that wrote it: of `map --prove`, `boundary --prove`, `point --every-number` or `point --switching`.

    python3 check_certificate.py certificate.json

A certificate has a scene, boxes of one or two of its keys (and of 1/(N − 1), if they hold for every number N of peers) or spans of numbers of peers, and for each a verdict with the numbers by which it can be checked. This
program writes down the frame of the scene over each from the equations of docs/model.md, with a bound of every rounding error, and checks that

1. the boxes cover the whole range, once, or spans leave no number out;
2. on a circle all matrices A(z) = W·(z·1 − M)·V of the box are strictly diagonally dominant with the weights of the certificate, where W is the
   inverse of its coordinates V, nearly. Then no M of the box has an eigenvalue on the circle (Gershgorin 1931), and as many inside as A has
   diagonal entries that vanish there;
3. with the circle |z| = 1 that is all of them, in every part of the scene: it is stable; or there is one outside of |z| = 1 in some part: unstable.

In the mean square, and of contacts that open and close, it checks quadratic forms instead: `moments_over_box.py` and `pushes.py` say which.

It needs Python 3.11 or later and nothing else. A scene that is not covered is refused, by name.
"""

import json
import math
import sys
import tomllib
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from itertools import product as tuples

import scene as scenes
from averaging import TopologyBox, enclosures, weights_of
from boxes import KeyBox, NumberBox, classes_of
from circles import Refused, check_part, doubles
from frame_over_box import Part
from moments_over_box import Moments, Span, is_everywhere_positive
from numbers_over_box import EPS, TooLight
from pushes import Multipliers, PushBox, PushFrame, axes_of, is_shape, walls_of, without_pushes
from server_frame import ServerBox, without_server
from scene import Scene
from timing import Timing
from wave_frame import WaveBox, WaveNumberBox, without_waves

KEYS = {
    *("coordination.stiffness", "coordination.damping", "peer.coupling.stiffness", "peer.coupling.damping"),
    *("object.mass", "object.damping", "peer.device.mass", "peer.device.damping"),
}


def tables_with(text: str, overrides) -> dict:
    """The tables of a scene with keys set to values, as the program's --set does."""
    root = tomllib.loads(text)
    for key, value in overrides:
        *path, last = key.split(".")
        table = root
        for name in path:
            table = table.setdefault(name, {})
            if not isinstance(table, dict):
                raise Refused(f"a key that is not covered: {key}")
        table[last] = value
    return root


def override(text: str) -> tuple:
    key, value = text.split("=", 1)
    try:
        return key, tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        return key, value


DELAY = "link.delay"


def check_box(document, box) -> str:
    """The verdict of a box of keys."""
    keys, ranges = document["keys"], box["ranges"]
    free = [place for place, key in enumerate(keys) if key != DELAY]
    text = lambda place, value: (keys[place], f"{Decimal(repr(value)):f}{document['units'][place]}" if keys[place] == DELAY else value)
    with_keys = lambda bits: scene_of(document, [text(place, of_key[place in free and bits >> free.index(place) & 1]) for place, of_key in enumerate(ranges[: len(keys)])])
    corners = [with_keys(bits) for bits in range(2 ** len(free))]
    if DELAY in keys:
        place = keys.index(DELAY)
        last = scene_of(document, [text(key, ranges[key][key == place]) for key in range(len(keys))])
        if events(corners[0]) != events(last):
            raise Refused("samples come into force at other ticks with the longest delay than with the shortest")
    numbers = numbers_of_box(document, ranges[len(keys) :])
    return check_verdict(lambda: box_of(document, corners, numbers), box, corners)


def box_of(document, corners, numbers):
    """The box of scenes with those corners, by how their peers act on each other."""
    _, server, returns_force = without_server(tables_of(document))
    classes = classes_of(corners, lambda name: name == server)
    if server is not None:
        if numbers is not None:
            raise Refused("a server for every number of peers")
        return ServerBox(corners, classes, server, returns_force)
    _, impedance = without_waves(tables_of(document))
    if impedance is not None:
        if numbers is not None:
            raise Refused("waves for every number of peers, in a box of keys")
        return WaveBox(corners, classes, impedance)
    if document.get("topology") is None:
        return KeyBox(corners, classes, numbers)
    if numbers is not None:
        raise Refused("a topology for every number of peers")
    return TopologyBox(corners, classes, *topology_of(document, tuple(peer.name for peer in corners[0].peers)))


def topology_of(document, names):
    """The weights of a topology and its eigenvalues, which are those of all boxes."""
    if "averaging" not in document:
        table, given = tables_of(document)["topology"], document["topology"]
        weights, flat = weights_of(table, names, given["weights"]), doubles(given["eigenvectors"])
        document["averaging"] = weights, enclosures(weights, [flat[start : start + len(names)] for start in range(0, len(flat), len(names))])
    return document["averaging"]


def events(scene):
    """When the samples of each peer come into force at each other, which is later for none if a delay is shorter."""
    timing = Timing(scene)
    of = lambda *link: (timing.held(*link) - timing.t0, [(tick - timing.t0, sent - timing.t0) for tick, sent in timing.in_force(*link)])
    return [of(*link) for link in ([(0, 1)] if None in scene.links else scene.links)]


def ends_of_numbers(document):
    """Between which ends 1/(N − 1) is."""
    every = document["every_number"]
    if every["from"] < 2 or every["to"] is not None and every["to"] < every["from"]:
        raise Refused("numbers of peers that are none")
    return Fraction(0) if every["to"] is None else Fraction(1, every["to"] - 1), Fraction(1, every["from"] - 1)


def numbers_of_box(document, ranges):
    """The ends of 1/(N − 1) of a box, exact where they are those of all of them."""
    if document["every_number"] is None:
        return None
    (ends,) = ranges
    whole = ends_of_numbers(document)
    return [next((exact for exact in whole if float(exact) == end), Fraction(end)) for end in ends]


def check_moments(scene, growing, span):
    """Whether γ·Y − L(Y) is positive definite for every number of a span, Y being so too if it is stable, and not so if it is not: in the mean square (Krein & Rutman 1948)."""
    box = NumberBox(scene, classes_of([scene]), growing, span["from"], span["to"], may_lose=True)
    if len(span["moments"]) != 1:
        raise Refused("expected one second moment")
    (moment,) = span["moments"]
    gamma = moment["factor"]
    frame = Moments(box, span["from"], span["to"], moment["heard"], moment["time"], moment["depth"])
    sizes = frame.sizes()
    if len(moment["blocks"]) != len(sizes):
        raise Refused(f"expected {len(sizes)} kinds of motion")
    blocks = []
    for digits, rows in zip(moment["blocks"], sizes):
        flat = doubles(digits)
        if len(flat) != rows * rows:
            raise Refused(f"expected a moment of {rows} rows")
        block = [flat[row * rows : (row + 1) * rows] for row in range(rows)]
        if block != [list(column) for column in zip(*block)]:
            raise Refused("a moment that is not symmetric")
        blocks.append(block)
    whole = [frame.constant(block) for block in blocks]
    if span["verdict"] == "stable":
        holds = gamma <= 1 and all(map(is_everywhere_positive, whole))
    else:
        holds = gamma > 1 and any(block[place][place] < 0 for block in blocks for place in range(len(block)))
    if not holds:
        raise Refused("a moment, or a factor, that shows something else")
    images = frame.image(*whole)
    for block, image in zip(whole, images):
        left = [[gamma * entry for entry in row] for row in block.mean]
        rounded = [[EPS * abs(entry) for entry in row] for row in left]
        if not is_everywhere_positive(Span(left, frame.constant(left).slopes, rounded).plus(image.negated())):
            raise Refused("a frame leaves more of the second moment than its factor")


def check_span(document, span) -> str:
    """The verdict of a span of numbers of peers."""
    scene = scene_of(document)
    _, server, _ = without_server(tables_of(document))
    _, impedance = without_waves(tables_of(document))
    if server is not None or span["moments"] and impedance is not None:
        raise Refused("a server for every number of peers, or waves in the mean square")
    if span["moments"]:
        check_moments(scene, document["growing"], span)
        check_devices([scene])
        return span["verdict"]
    try:
        numbers = scene, classes_of([scene]), document["growing"], span["from"], span["to"]
        return check_verdict(lambda: NumberBox(*numbers) if impedance is None else WaveNumberBox(*numbers, impedance), span, [scene])
    except TooLight:
        # The numbers before are checked all the same.
        return "undecided"


def scene_of(document, values=()) -> Scene:
    root = tables_with(document["scene"], [*map(override, document["overrides"]), *values])
    if document.get("topology") is not None or root.get("topology", {}).get("kind") == "full":
        root.pop("topology", None)
    root, impedance = without_waves(without_server(root)[0])
    scene = scenes.read(root, document["scene"])
    # Waves damp each copy.
    return scene if impedance is None else replace(scene, damping=Fraction(scene.damping) + impedance)


def check_verdict(make, certified, scenes) -> str:
    verdict = certified["verdict"]
    if verdict == "undecided":
        return verdict
    over = make()
    found = set()
    for part in certified["parts"]:
        frame = over.part(part).frame()
        within, size, kind, least = check_part(frame, part)
        if verdict == "unstable" and (least < 1 or kind == "around-zero" and within == size):
            raise Refused("no eigenvalue is shown to be outside of the unit circle")
        if verdict == "stable" and (kind != "around-zero" or part["circle"][1] > 1 or within < size):
            raise Refused("not all eigenvalues are shown to be within the unit circle")
        found |= over.names(part)
    known = over.known()
    if not found <= known:
        raise Refused("a part of the certificate is none of the scene")
    if verdict == "unstable" and not found:
        raise Refused("there is no part that grows")
    if verdict == "stable":
        if found != known:
            raise Refused("a part of the scene is missing")
        check_devices(scenes)
    if verdict not in ("stable", "unstable"):
        raise Refused(f"a verdict that is none: {verdict}")
    return verdict


def check_devices(scenes):
    """Refuses devices that touch nothing and do not come to rest."""
    for peer in (peer for scene in scenes for peer in scene.peers):
        damping = peer.device_damping + (peer.arm[1] if peer.arm else 0.0)
        if not peer.touches and not damping > 0:
            raise Refused(f"the device of {peer.name} touches nothing and has no damping")


def check_motion(document, motion) -> str:
    """The verdict on contacts along an axis that open and close."""
    if motion["verdict"] == "undecided":
        return "undecided"
    if motion["verdict"] != "stable" or not 0 < motion["factor"] <= 1:
        raise Refused("a verdict that is not covered")
    root, pushes = without_pushes(tables_of(document), motion["axis"])
    walls = walls_of(tables_of(document))
    scene = scenes.read(root, document["scene"])
    box = PushBox(scene, pushes)
    multipliers = Multipliers(box, motion, pushes, walls)
    found = set()
    for part in motion["parts"]:
        members = list(map(tuple, part["members"]))
        frame = PushFrame(box, part["difference"], members, part["states"], motion["heard"], motion["time"], pushes, walls)
        rows = len(frame.states) + len(frame.contacts)
        flat = doubles(part["shape"])
        if len(flat) != rows * rows:
            raise Refused("a form of another size")
        shape = [flat[row * rows : (row + 1) * rows] for row in range(rows)]
        of_contacts = [multipliers.of[members[c][0], kind] for c, kind in frame.contacts]
        if not is_shape(shape) or not frame.falls(shape, of_contacts, multipliers.shared, list(map(len, members)), motion["factor"]):
            raise Refused("a form that is not shown to fall")
        found.add((part["difference"], tuple(members)))
    for part in motion["rest"]:
        members = tuple(map(tuple, part["members"]))
        within, size, kind, _ = check_part(Part(box, part["difference"], members, part["states"], part["heard"], part["time"]).frame(), part)
        if kind != "around-zero" or part["circle"][1] > 1 or within < size or walls or any(scene.peers[first].name in pushes for first, *_ in members):
            raise Refused("not all eigenvalues are shown to be within the unit circle")
        found.add((part["difference"], members))
    if found != {(True, (members,)) for members in box.classes if len(members) > 1} | {(False, tuple(box.classes))}:
        raise Refused("a part of the scene is missing")
    check_devices([scene])
    return "stable"


def tables_of(document) -> dict:
    return tables_with(document["scene"], map(override, document["overrides"]))


def check_switching(document) -> str:
    if not document["motions"]:
        raise Refused("no motion")
    words = [checked(check_motion, document, motion, motion["motion"] or "the motion") for motion in document["motions"]]
    proven = [motion["axis"] for motion in document["motions"] if motion["verdict"] == "stable"]
    if len(proven) == len(words) and proven != axes_of(tables_of(document)):
        raise Refused("an axis along which contacts push is missing, or stands there twice")
    return "contacts that open and close: " + ", ".join(words)


def check_cover(document):
    """Refuses boxes that do not cover the range once: each is the range, or a part of a box that is no box, with all sides halved. A delay is divided into stretches
    between which there is no nanosecond, and 1/(N − 1) into pieces of its own for each box of keys."""
    keys, ranges = document["keys"], document["ranges"]
    pieces = {}
    for box in document["boxes"]:
        pieces.setdefault(tuple(map(tuple, box["ranges"][: len(keys)])), []).append(box["ranges"][len(keys) :])
    for of_keys, of_numbers in pieces.items():
        if document["every_number"] is None:
            chained = of_numbers == [[]]
        else:
            of_numbers = sorted(ends for (ends,) in of_numbers)
            low, high = map(float, ends_of_numbers(document))
            chained = (of_numbers[0][0], of_numbers[-1][1]) == (low, high) and all(one[1] == other[0] for one, other in zip(of_numbers, of_numbers[1:]))
        if not chained:
            raise Refused(f"numbers of peers are left out, or a box stands there twice: {of_keys}")
    left = set(pieces)
    for whole in beginnings(document, left):
        waiting = [whole]
        while waiting:
            box = waiting.pop()
            if box in left:
                left.remove(box)
                continue
            halves = [[side] if key == DELAY else [(side[0], sum(side) / 2), (sum(side) / 2, side[1])] for key, side in zip(keys, box)]
            if not left or not all(low < high for sides in halves if len(sides) > 1 for low, high in sides):
                raise Refused(f"nothing covers {box}")
            waiting += tuples(*halves)
    if left:
        raise Refused(f"beyond the range, or twice: {left.pop()}")


def beginnings(document, boxes):
    """The range, for each stretch of delays if one of the keys is a delay."""
    whole = tuple(map(tuple, document["ranges"]))
    if DELAY not in document["keys"]:
        return [whole]
    place = document["keys"].index(DELAY)
    stretches = sorted({box[place] for box in boxes})
    nanoseconds = lambda value: scenes.nanoseconds(f"{Decimal(repr(value)):f}{document['units'][place]}")
    ends = [(nanoseconds(low), nanoseconds(high)) for low, high in stretches]
    if (stretches[0][0], stretches[-1][1]) != whole[place] or any(one[1] + 1 != other[0] for one, other in zip(ends, ends[1:])):
        raise Refused("delays are left out, or stand there twice")
    return [(*whole[:place], stretch, *whole[place + 1 :]) for stretch in stretches]


def check(document) -> str:
    """What a certificate shows, in words; refuses what does not hold."""
    kind = document["schema"].split("/")
    if kind == ["cohaptic", "stability-certificate"]:
        return check_boxes(document)
    if kind == ["cohaptic", "stability-number-certificate"]:
        return check_spans(document)
    if kind == ["cohaptic", "stability-switching-certificate"]:
        return check_switching(document)
    raise Refused("not a certificate of a region, of numbers of peers or of contacts")


def checked(one, all_of, place, words) -> str:
    """The verdict on a piece, or a refusal that says which."""
    try:
        return one(all_of, place)
    except (Refused, ValueError, KeyError) as refused:
        raise Refused(f"{words}, {place['verdict']}: {refused}") from None


def check_boxes(document) -> str:
    for key in document["keys"]:
        if key not in KEYS | {DELAY}:
            raise Refused(f"a key that is not covered: {key}; expected gains, masses, dampings and link.delay")
    sides = len(document["keys"]) + (document.setdefault("every_number", None) is not None)
    if any(len(box["ranges"]) != sides for box in document["boxes"]):
        raise Refused("a box with sides that are not those of the keys and of the numbers of peers")
    check_cover(document)
    # A side without a length counts as one: a single delay, a single number of peers.
    area = lambda box: math.prod(Fraction(high) - Fraction(low) or 1 for low, high in box["ranges"])
    shares = {"stable": Fraction(0), "unstable": Fraction(0), "undecided": Fraction(0)}
    for number, box in enumerate(document["boxes"], start=1):
        shares[checked(check_box, document, box, f"box {number} of {len(document['boxes'])}, {box['ranges']}")] += area(box)
    whole = sum(shares.values())
    return f"{len(document['boxes'])} boxes hold: " + ", ".join(f"{name} {float(100 * share / whole):.3f} %" for name, share in shares.items())


def check_spans(document) -> str:
    found = []
    for span in document["spans"]:
        low, high = span["from"], span["to"]
        if found and found[-1][1] != low - 1 or high is not None and high < low:
            raise Refused(f"numbers of peers are left out before {low}, or stand there twice")
        verdict = checked(check_span, document, span, f"from {low} to {high} peers")
        if found and found[-1][2] == verdict:
            low = found.pop()[0]
        found.append((low, high, verdict))
    words = [f"{verdict} from {low} on" if high is None else f"{verdict} from {low} to {high}" for low, high, verdict in found]
    return f"{len(document['spans'])} spans of numbers hold: " + ", ".join(words)


def main():
    if len(sys.argv) != 2:
        sys.exit("usage: python3 check_certificate.py CERTIFICATE.json")
    with open(sys.argv[1], encoding="utf-8") as file:
        document = json.load(file)
    try:
        print(check(document))
    except Refused as refused:
        sys.exit(f"refused: {refused}")


if __name__ == "__main__":
    main()
