"""Other threads go on while Rust computes, and Ctrl-C is heard."""

import os
import signal
import subprocess
import sys
import threading

import pytest
from conftest import TWO

from cohaptic import Link, Scene

LONG = TWO.replace('"500ms"', '"100h"').replace('"24ms"', '"8ms"')


def test_other_threads_go_on() -> None:
    counts: list[int] = []
    ended = threading.Event()
    scene = Scene(TWO.replace('"500ms"', '"60s"'))

    def count() -> None:
        number = 0
        while not ended.is_set():
            number += 1
        counts.append(number)

    other = threading.Thread(target=count)
    other.start()
    for _ in range(5):
        scene.run(record=False)
        Link("delay 20ms 5ms").send(range(100_000))
    ended.set()
    other.join()
    # Without release it would have had a turn between two calls alone.
    assert counts[0] > 1000


# Each computes for hours.
ENDLESS = {
    "run": "scene.run(record=False)",
    "law": "scene.run(record=False, law=Spring)",
    "map": "scene.map(x='coordination.stiffness=0..6000', y='coordination.damping=0..50', grid=(3000, 3000))",
    "campaign": "cohaptic.campaign(cohaptic.Scene(LONG.replace('100h', '10s')), runs=1_000_000)",
}


@pytest.mark.parametrize("what", ENDLESS)
def test_ctrl_c_is_heard(what: str) -> None:
    program = f"""
import cohaptic, sys
LONG = {LONG!r}
class Spring:
    def __init__(self, peer): self.peer = peer
    def command(self, own, held, t):
        # Damped, so that nothing overflows, which would end the run.
        return self.peer.stiffness * (own.position - held.mean.position) + self.peer.damping * (own.velocity - held.mean.velocity)
scene = cohaptic.Scene(LONG)
print("ready", flush=True)
try:
    {ENDLESS[what]}
except KeyboardInterrupt:
    print("heard", flush=True)
    sys.exit(7)
"""
    child = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None
    assert child.stdout.readline() == "ready\n"
    # Whether the computation has begun or not by now, the signal is heard.
    threading.Event().wait(0.5)
    os.kill(child.pid, signal.SIGINT)
    try:
        rest, _ = child.communicate(timeout=60)
    finally:
        child.kill()
    assert (rest, child.returncode) == ("heard\n", 7)
