#!/usr/bin/env python3
"""A peer of a live session that simulates its device: the smallest program on the Python package's folder `peer`, which has protocol, copy, coordination.

The simulated device is a damped mass under a constant force of a hand. With --inertia the object turns, and the device grasps it at --grasp. Every tick
is written out here, because a simulated device needs no gate; a device in somebody's hand belongs into cohaptic.join(), as docs/own-device.md shows.
Python 3.10 or later, standard library only. The protocol is in docs/live-protocol.md, the equations are in docs/model.md and docs/rotation.md.

    python3 udp_peer.py 127.0.0.1:7000 --session 42 --place 1 --peers 3 --force 0.5 --duration 5

The folder python/cohaptic/peer of the repository is used where it stands, or as a folder `peer` beside this file, or from the installed package.
At the end it prints one line of JSON. SI units everywhere.
"""

import argparse
import importlib
import importlib.util
import json
import math
import sys
import time
from pathlib import Path

STALE_AFTER = 0.1  # a sender not heard for so long counts as stale [s]


def load_peer():
    """The folder `peer`, which needs nothing of the rest of the package."""
    here = Path(__file__).resolve().parent
    for folder in (here / "peer", here.parents[1] / "python/cohaptic/peer" if len(here.parents) > 1 else here):
        if (folder / "__init__.py").is_file():
            spec = importlib.util.spec_from_file_location("peer", folder / "__init__.py", submodule_search_locations=[str(folder)])
            module = sys.modules["peer"] = importlib.util.module_from_spec(spec)
            spec.loader.exec_module(module)
            return module
    try:
        return importlib.import_module("cohaptic.peer")
    except ModuleNotFoundError:
        sys.exit("udp_peer: copy the folder python/cohaptic/peer of the repository beside this file, or install the package cohaptic")


peer = load_peer()


def run(client, options):
    """Moves device and copy for the duration, in ticks at fixed times. Returns the number of ticks and the device."""
    me, k = client.peer, 0
    tick_s = me.session.tick_ns * 1e-9
    device = peer.Body(options.device_mass, options.device_damping, tick_s, me.reading)
    ticks = round(options.duration / tick_s)
    began = time.monotonic_ns()
    for k in range(ticks):
        client.wait_for(k, began)
        client.exchange(k)
        me.tick(k, device.states)
        pushes = k * me.session.tick_ns < options.force_for * 1e9
        device.move([force + (options.force if pushes and axis == 0 else 0.0) for axis, force in enumerate(me.on_hand)])
        me.check()
    return ticks, device


def summary(me, ticks, device):
    now = time.monotonic_ns()
    others = [
        {"sender": place, "received": o.received, "late": o.late, "stale": o.heard_at is None or now - o.heard_at > STALE_AFTER * 1e9}
        for place, o in sorted(me.others.items())
    ]
    return {
        "place": me.session.place,
        "ticks": ticks,
        "sent": me.sent,
        "joinings": me.joinings,
        "ignored": me.ignored,
        "position": [position for position, _ in me.copy.states],
        "velocity": [velocity for _, velocity in me.copy.states],
        "device": [position for position, _ in device.states],
        "device_velocity": [velocity for _, velocity in device.states],
        "orientation": list(me.turn.attitude.quaternion) if me.turn else None,
        "others": others,
    }


def gains(text):
    stiffness, damping = (float(part) for part in text.split(","))
    return stiffness, damping


def triple(text):
    x, y, z = (float(part) for part in text.split(","))
    return x, y, z


def parse():
    parser = argparse.ArgumentParser(description="A peer of a live session of cohaptic.")
    parser.add_argument("door", help="HOST:PORT of the session; an IPv6 address in brackets")
    parser.add_argument("--session", type=int, required=True, help="the seed of the scene")
    parser.add_argument("--place", type=int, required=True, help="place of this peer among the peers of the scene, from 0")
    parser.add_argument("--key-file", help="64 hexadecimal digits; then the session tells axes, peers and periods")
    parser.add_argument("--axes", type=int, default=1, choices=[1, 2, 3])
    parser.add_argument("--peers", type=int, default=2, help="how many peers the scene has [%(default)s]")
    parser.add_argument("--tick-ms", type=float, default=1.0, help="[%(default)s]")
    parser.add_argument("--update-ms", type=float, default=8.0, help="[%(default)s]")
    parser.add_argument("--duration", type=float, default=10.0, help="s [%(default)s]")
    parser.add_argument("--patience", type=float, default=10.0, help="how long to wait for a welcome, s [%(default)s]")
    parser.add_argument("--force", type=float, default=0.0, help="of the hand, along x, N [%(default)s]")
    parser.add_argument("--force-for", type=float, default=math.inf, help="how long the hand pushes, s [always]")
    parser.add_argument("--object-mass", type=float, default=0.45, help="of the whole object; each copy has its share, kg [%(default)s]")
    parser.add_argument("--object-damping", type=float, default=0.0, help="of each copy, N·s/m [%(default)s]")
    parser.add_argument("--inertia", type=triple, metavar="X,Y,Z", help="of the whole object, about its own axes: it turns, kg·m² [it does not]")
    parser.add_argument("--grasp", type=triple, default=(0.0, 0.0, 0.0), metavar="X,Y,Z", help="from its centre, in its own axes, m [0,0,0]")
    parser.add_argument("--device-mass", type=float, default=0.1, help="kg [%(default)s]")
    parser.add_argument("--device-damping", type=float, default=5.0, help="N·s/m [%(default)s]")
    parser.add_argument("--coupling", type=gains, default=(3500.0, 5.0), metavar="K,B", help="N/m, N·s/m [3500,5]")
    parser.add_argument("--law", default="AP", choices=["AP", "PD"], help="[%(default)s]")
    parser.add_argument("--coordination", type=gains, default=(300.0, 5.0), metavar="K,B", help="N/m, N·s/m [300,5]")
    parser.add_argument("--exchange-every", type=int, default=1, help="ticks from one exchange with the device to the next [%(default)s]")
    parser.add_argument("--exchange-age", type=int, default=0, choices=[0, 1], help="1 if the device is read one exchange late [%(default)s]")
    return parser.parse_args()


def main():
    options = parse()
    session = peer.Session(
        options.session,
        options.place,
        options.peers,
        options.axes,
        options.inertia is not None,
        round(options.tick_ms * 1e6),
        round(options.update_ms * 1e6),
    )
    try:
        mechanics = peer.Mechanics(
            coupling=options.coupling,
            coordination=options.coordination,
            law=options.law,
            object_mass=options.object_mass,
            object_damping=options.object_damping,
            inertia=options.inertia,
            grasp=options.grasp,
            exchange_every=options.exchange_every,
            exchange_age=options.exchange_age,
        )
        key = peer.read_key(options.key_file) if options.key_file else None
        with peer.Client(options.door, session, mechanics, key=key, patience=options.patience) as client:
            ticks, device = run(client, options)
    except (OSError, ValueError, ArithmeticError) as error:
        sys.exit(f"udp_peer: {error}")
    print(json.dumps(summary(client.peer, ticks, device)))


if __name__ == "__main__":
    main()
