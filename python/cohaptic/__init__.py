"""Emulation and analysis of people who feel and move one virtual object together over a bad network.

A scene is read from a file or a text, run in virtual time, and analysed:

>>> import cohaptic
>>> scene = cohaptic.Scene('''
... scene        = { duration = "1s", count = 2 }
... object       = { mass = 0.45 }
... coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
... peer         = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
... link         = { delay = "8ms" }
... ''')
>>> scene.run().summary["ticks"]
1000
>>> scene.stability().verdict
'stable'
>>> scene.set("link.delay", "24ms").stability().verdict
'unstable'
"""

from cohaptic.campaign import Campaign, campaign
from cohaptic.compare import Comparison, compare
from cohaptic.errors import AnalysisError, CohapticError, SceneError, UnreadableError
from cohaptic.fit import fit
from cohaptic.law import Held, Law, Peer, State
from cohaptic.link import CAUSES, Copies, Event, Link, Sent, profile
from cohaptic.peer import Device, Joined, Reading, join
from cohaptic.run import Picture, Run
from cohaptic.scene import Check, Expectation, Scene
from cohaptic.stability import Admittance, Boundary, ContactMode, Crossing, Map, Part, Radius, Stability
from cohaptic.table import Table

__all__ = [
    "CAUSES",
    "Admittance",
    "AnalysisError",
    "Boundary",
    "Campaign",
    "Check",
    "CohapticError",
    "Comparison",
    "ContactMode",
    "Copies",
    "Crossing",
    "Device",
    "Event",
    "Expectation",
    "Held",
    "Joined",
    "Law",
    "Link",
    "Map",
    "Part",
    "Peer",
    "Picture",
    "Radius",
    "Reading",
    "Run",
    "Scene",
    "SceneError",
    "Sent",
    "Stability",
    "State",
    "Table",
    "UnreadableError",
    "campaign",
    "compare",
    "fit",
    "join",
    "profile",
]
