"""Scenes that the tests of the study layer share, and their twins for the references."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from weakref import finalize

import command
import numpy as np
import pytest
from command import CARLINA, run
from references import bars, catenary_mp, continuous_cable
from solved import solve

from cablestudy.errors import SceneError
from cablestudy.scene.scene import load_scene
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.one_cable.ssm import choose
from cablestudy.study.prepare import prepare
from cablestudy.study.ssm import StateSpaceOptions
from cablestudy.sweeps.chunks import Chunks
from cablestudy.sweeps.driver import compute_here
from cablestudy.sweeps.fingerprint import identity
from cablestudy.sweeps.rows import table_of
from cablestudy.sweeps.store import open_store

AREA, DENSITY, MODULUS, CHORD, LENGTH, GONDOLA = 2.69e-6, 1440.0, 70.3e9, 185.8, 184.4883, 50.0  # Table 1
G = 9.81
GUY = {  # in Python: numbers and texts, lists and tuples
    "cable": {"ends": [[0, 0, 0], (60.0, 0, "80 m")], "material": "guy-strand", "diameter": "16 mm", "preload": "10 %"},
    "cases": {"cold": {"temperature": "-30 degC"}, "hot": {"temperature": "45 degC"}},
}


def scene(*sets, base=CARLINA):
    """A scene of configs/ with changes."""
    return load_scene(base, sets)[1]


@cache
def case_of(*sets):
    """The case of Carlina with changes."""
    return CableCase(scene(*sets))


def choice_of(*sets, base=CARLINA, **options):
    """`CableChoice` of a scene of configs/ with changes, by options of the command `ssm`."""
    return choose(*load_scene(base, sets), StateSpaceOptions(**options))


def scene_of(text, *sets):
    """A scene of either kind from its text, with changes: the file s.yaml of the working directory."""
    Path("s.yaml").write_text(text, encoding="utf-8")
    return load_scene("s.yaml", sets)[1]


def replaced(text, *pairs):
    """A text with the first place of each old part new; pairs (old, new)."""
    for old, new in pairs:
        assert old in text, old
        text = text.replace(old, new, 1)
    return text


def mistakes_of(text, *sets):
    """Lines of all mistakes of such a scene."""
    with pytest.raises(SceneError) as caught:
        scene_of(text, *sets)
    assert caught.value.exit_code == 2
    return [str(mistake) for mistake in caught.value.mistakes]


def cells(scene, *names):
    """Values of columns, by the names given."""
    row = solve(scene, *names)
    assert row.status == "ok", row.status
    return row.values


def tables_of_new(template, names, *options):
    """Tables that `static` prints of a scene of `cablestudy new`: for each its rows by their names, list of dict."""
    run("new", template, "--quiet")
    tables = (command.table_of("static", f"{template}.yaml", "--table", name, *options) for name in names)
    return [{row["name"]: row for row in rows} for rows in tables]


@dataclass(frozen=True)
class Twin:
    """A scene in the terms of the references: span a and rise b, loads as (s, (fx, 0, fz))."""

    a: float
    b: float
    length: float
    area: float = AREA
    loads: tuple = ()

    @property
    def stiffness(self):
        """EA. [N]"""
        return MODULUS * self.area

    @property
    def mass(self):
        """Per length. [kg/m]"""
        return DENSITY * self.area

    @property
    def chord(self):
        """[m]"""
        return float(np.hypot(self.a, self.b))

    def scene(self, *sets):
        """The same as a scene."""
        loads = ", ".join(f"{{at: {s!r}, force: [{f[0]!r}, 0, {f[2]!r}]}}" for s, f in self.loads)
        return scene(
            f"cable.ends=[[0, 0, 0], [{self.a!r}, 0, {self.b!r}]]",
            f"cable.unstretched_length={self.length!r}",
            f"cable.area={self.area!r}",
            f"cable.loads=[{loads}]",
            *sets,
        )

    @property
    def cable(self):
        """Arguments of the references of the continuous cable."""
        return self.a, self.b, self.length, self.stiffness, self.mass, G

    @property
    def bar(self):
        """Length, stiffness and mass, for the references of bars."""
        return self.length, self.stiffness, self.mass

    @property
    def tension_and_sag(self):
        """Mean tension [N] and sag [m] of the elastic catenary, which has no loads."""
        w = self.mass * G
        H, V0 = catenary_mp.solve(self.a, self.b, self.length, self.stiffness, w)
        sag = catenary_mp.sag(H, V0, self.length, self.stiffness, w)
        return float(catenary_mp.mean_tension(H, V0, self.length, w)), float(sag)

    def frequencies(self, count, plane="in"):
        """Of the continuous cable with fixed ends. [Hz]"""
        return continuous_cable.frequencies(*self.cable, count, plane, loads=self.loads)

    def dynamic_stiffness(self, frequency):
        """k_xx of end 2 of the continuous cable. [N/m]"""
        omega = 2 * np.pi * frequency
        return continuous_cable.dynamic_end_stiffness(*self.cable, omega, loads=self.loads)[0, 0]

    def chain(self, elements=40):
        """The same as bars. [Chain]"""
        return _chain(self, elements)


@cache
def _chain(twin, elements):
    """The bars of a twin, in 50 digits."""
    nodes = [(round(s / twin.length * elements), f) for s, f in twin.loads]
    return bars.solve_spatial((twin.a, 0, twin.b), twin.length, twin.stiffness, twin.mass * G, elements, nodes)


PAPER = Twin(CHORD, 0.0, LENGTH)
INCLINED = Twin(175.68, 60.49, LENGTH)
SAGGING = Twin(CHORD, 0.0, 186.0, 24.2e-6)  # 1:45, Table 6


def computed(study):
    """The table of a study, nothing written."""
    columns, reference = prepare(study)
    cases = range(study.count)
    store = open_store("", identity(study, columns), study.count)
    headers = [column.header for column in columns]
    for done in compute_here(Chunks(study, [(cases, headers)], study.count), jobs=1):
        store.add(done.headers, done.records)
    table = table_of(study, columns, reference, store, cases)
    finalize(table.rows, store.close)  # which read from it as long as they are there
    return table
