"""Imports point one way, and each library is imported where the house rules allow it; read from the source."""

import ast
import graphlib
import re
import sys
from functools import cache
from pathlib import Path

import layers
import pytest

import cablestudy

ROOT = Path(cablestudy.__file__).parent
# what each layer may import from cablestudy:
# cli > pages > interface > sweeps | plots > study > motion > control > wind > system > statics | scene > cable > errors
ALLOWED = {
    "errors": set(),
    "interrupts": set(),
    "activity": set(),
    "threads": set(),
    "cable": {"cable", "errors"},
    "scene": {"scene", "errors"},  # what the user wrote; it need not know what is computed from it
    "statics": {"statics", "cable", "errors"},
    "system": {"system", "statics", "cable", "errors"},
    "control": {"control", "system", "statics", "cable", "errors"},
    "wind": {"wind", "system", "statics", "cable", "errors"},
    "motion": {"motion", "activity", "control", "system", "statics", "wind", "scene", "cable", "errors"},
    "study": {"study", "motion", "activity", "control", "system", "statics", "wind", "scene", "cable", "errors"},
    "plots": {"plots", "study", "motion", "control", "wind", "statics", "scene", "cable", "errors"},
    "sweeps": {"sweeps", "activity", "interrupts", "threads", "study", "scene", "errors", "version"},
    "interface": {"interface", "sweeps", "plots", "study", "motion", "activity", "threads", "scene", "errors"},
    "pages": {"pages", "interface", "sweeps", "plots", "study", "scene", "errors", "version"},
    # the commands are a thin layer: what they print, the interface computes
    "cli": {"cli", "pages", "interface", "interrupts", "activity", "threads", "errors", "version"},
    "version": set(),
    "__init__": {"version"},
    "__main__": {"cli"},
}
NUMPY_ALONE = {"numpy", "scipy"}
LIBRARIES = {"cable": NUMPY_ALONE, "statics": NUMPY_ALONE, "system": NUMPY_ALONE, "errors": set()}
# reading a file needs no arrays; who draws the points of a sample imports them there and then
WITHOUT_ARRAYS, DRAWS = "scene", ("scene", "sampling.py")
MODULES = sorted(ROOT.rglob("*.py"))


def layer_of(path):
    return path.relative_to(ROOT).parts[0].removesuffix(".py")


@cache
def nodes(path):
    """All nodes of the syntax tree of a module, its own first."""
    return tuple(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))


def imports(path, inside=True):
    """Every imported name with dots, relative ones made absolute; inside functions too, for type checkers alone not."""
    package = ("cablestudy", *path.relative_to(ROOT).parts[:-1])
    functions = [node for node in nodes(path) if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))]
    hidden = set() if inside else {inner for function in functions for inner in ast.walk(function)}
    for_types = [node for node in nodes(path) if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"]
    hidden |= {inner for condition in for_types for inner in ast.walk(condition)}
    for node in nodes(path):
        if node in hidden:
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = ".".join(package[: len(package) - node.level + 1]) if node.level else ""
            module = ".".join(part for part in (base, node.module) if part)
            if module == "cablestudy":
                yield from (f"cablestudy.{alias.name}" for alias in node.names)
            else:
                yield module


def test_imports_point_one_way():
    assert {layer_of(path) for path in MODULES} <= ALLOWED.keys()
    wrong = [(str(path), name) for path in MODULES for name in imports(path) if not may_import(path, name)]
    assert wrong == []


def may_import(path, name):
    """Whether a module may import a name with dots."""
    layer, (first, *rest) = layer_of(path), name.split(".")
    if first == "cablestudy":
        return bool(rest) and rest[0] in ALLOWED[layer]  # not the whole package
    if first == "matplotlib" and layer != "plots":
        return False
    if first == "click" and layer != "cli":
        return False
    return layer not in LIBRARIES or first in sys.stdlib_module_names or first in LIBRARIES[layer]


def module_of(path):
    """Name with dots of a module, or of the package whose `__init__.py` it is."""
    return ".".join(("cablestudy", *path.relative_to(ROOT).with_suffix("").parts)).removesuffix(".__init__")


def test_no_modules_import_each_other_in_a_circle():
    """Imports inside functions counted: `graphlib` finds the circle that there is."""
    modules = {module_of(path): path for path in MODULES}
    graph = {}
    for module, path in modules.items():
        names = {name for name in imports(path) if name in modules}
        for node in nodes(path):
            if isinstance(node, ast.ImportFrom) and node.module in names:  # from package import module
                names |= {f"{node.module}.{alias.name}" for alias in node.names} & modules.keys()
        graph[module] = names - {module, "cablestudy"}
    assert sum(map(len, graph.values())) > 100
    graphlib.TopologicalSorter(graph).prepare()  # raises CycleError


def test_the_scene_layer_has_no_arrays():
    for path in (ROOT / WITHOUT_ARRAYS).rglob("*.py"):
        allowed = path.relative_to(ROOT).parts == DRAWS
        names = {name.split(".")[0] for name in imports(path, inside=not allowed)}
        assert not names & {"numpy", "scipy"}, path


def test_there_is_something_to_check():
    drawing = set(imports(ROOT.joinpath(*DRAWS))) - set(imports(ROOT.joinpath(*DRAWS), inside=False))
    assert drawing == {"warnings", "numpy.random", "scipy.stats"}
    assert {"errors", "cable", "scene", "study", "sweeps", "cli"} <= {layer_of(path) for path in MODULES}
    assert "numpy" in set(imports(ROOT / "cable" / "assembly.py"))


def test_what_pip_installs_is_the_whole_program():
    """`packages.find` of pyproject.toml takes folders that have an __init__.py."""
    folders = {path.parent for path in ROOT.rglob("*.py")}
    assert len(folders) > 9
    assert all((folder / "__init__.py").exists() for folder in folders)


ARITHMETIC = (ast.BinOp, ast.UnaryOp, ast.operator, ast.unaryop)
# packages whose numbers stand in their tolerances
NUMERIC = ("scene", "cable", "statics", "system", "control", "wind", "motion", "study", "sweeps", "pages")
NO_TOLERANCE = {  # indices, numbers of mathematics and physics, factors of units, versions and names of formats
    "SMALLER_PART", "GAUSS_POINTS", "NO_SET", "TERMS", "GOING_ON", "GROUND", "STROUHAL", "VON_KARMAN_EXACT",
    "MM", "UM", "MILLI", "PERCENT", "PAPER", "ICE_DENSITY", "EXACT", "RESULTS_VERSION", "FORMAT", "APPLICATION",
}  # fmt: skip


def numbers(path):
    """Names of the constants of a module that are one number."""
    for node in nodes(path)[0].body:
        if isinstance(node, ast.Assign):
            parts = [one for one in ast.walk(node.value) if not isinstance(one, ARITHMETIC)]
            plain = all(isinstance(one, ast.Constant) and type(one.value) in (int, float) for one in parts)
            if plain or ast.unparse(node.value) in ("2 * np.pi", "-np.inf"):
                yield from (one.id for one in node.targets if isinstance(one, ast.Name))


def test_numbers_of_a_package_stand_in_its_tolerances():
    found = set()
    for path in MODULES:
        own = path.relative_to(ROOT)
        if own.parts[0] in NUMERIC and own.name != "tolerances.py" and "plots" not in own.parts:
            found |= {name for name in numbers(path) if not name.startswith("_")}
    assert {name for name in found - NO_TOLERANCE if name.isupper()} == set()


@pytest.mark.parametrize("package", NUMERIC)
def test_each_tolerance_has_a_reason_and_is_used(package):
    """Each stands with a comment behind it or above it, and another module reads it."""
    lines = (ROOT / package / "tolerances.py").read_text(encoding="utf-8").splitlines()
    fields = [
        (place, line.split(":")[0].strip()) for place, line in enumerate(lines) if re.match(r"    [a-z_]+: ", line)
    ]
    assert len(fields) > 10
    assert [name for place, name in fields if "  # " not in lines[place] and "    # " not in lines[place - 1]] == []
    text = "".join(path.read_text(encoding="utf-8") for path in MODULES)
    assert [name for _, name in fields if f"{package.upper()}.{name}" not in text] == []


def test_a_class_name_has_one_meaning():
    """But for the classes of the Python interface, which have the names that users know: none is defined twice."""
    places = {}
    for path in MODULES:
        for node in nodes(path):
            if isinstance(node, ast.ClassDef):
                places.setdefault(node.name, []).append(str(path.relative_to(ROOT)))
    assert len(places) > 200
    assert {name: paths for name, paths in places.items() if len(paths) > 1} == {}


KNOW_BOTH_KINDS = {  # who reads a scene, and the two tables of what is particular to each kind
    "scene/scene.py", "scene/suspension.py", "scene/one_cable.py", "scene/study.py", "study/scene_kind.py",
    "interface/__init__.py",
}  # fmt: skip


def test_only_who_reads_a_scene_asks_whether_it_has_one_cable_or_many():
    """All others take what `study.scene_kind`, or the class of the interface, has for such a scene."""
    asking = {}
    for path in MODULES:
        known, place = [], path.relative_to(ROOT).as_posix()
        for node in nodes(path):
            if isinstance(node, ast.ImportFrom) and node.module.startswith("cablestudy.scene"):
                known += [alias.name for alias in node.names]
            if isinstance(node, ast.Name | ast.Attribute):
                known.append(node.id if isinstance(node, ast.Name) else node.attr)
        if {"SuspensionScene", "is_suspension"} & set(known):
            asking[place] = known
    assert asking.keys() == KNOW_BOTH_KINDS


def test_a_public_docstring_says_what_comes_out():
    """It begins with a noun or a verb, not with "What ...", "Whether ...", "The same ...", "See ..." or "As ..."."""
    for path in MODULES:
        for node in nodes(path):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
                name = getattr(node, "name", "module")
                private = name.startswith("_") and not name.endswith("__")
                first = (ast.get_docstring(node) or "").partition("\n")[0]
                assert private or not re.match(r"(What|Whether|The same|See|As)\b", first), (path, name, first)


def test_a_module_that_a_text_names_is_there():
    """In backquotes, as `statics.rest` or `motion/plant`; packages that are keys of scenes too are left out."""
    named = re.compile(r"`((?:statics|system|motion|study|sweeps)(?:[./][a-z_]+)+)[`.(]")
    texts = {path: path.read_text(encoding="utf-8") for path in (*MODULES, *(ROOT.parent / "docs").glob("*.md"))}
    names = [(path.name, re.split("[./]", name)) for path, text in texts.items() for name in named.findall(text)]
    assert len(names) > 20
    for path, (package, module, *_) in names:
        place = ROOT / package / module
        assert place.is_dir() or place.with_suffix(".py").exists(), (path, package, module)


def test_the_picture_of_the_packages_is_that_of_the_imports():
    assert layers.PICTURE.read_text(encoding="utf-8") == layers.picture(), "python docs/layers.py draws it anew"
    assert "pictures/layers.svg" in (ROOT.parent / "ARCHITECTURE.md").read_text(encoding="utf-8")


def test_all_arrows_lead_down():
    graph = layers.imported()
    assert graph["cli"]
    assert graph["statics"] == {"cable", "errors"}
    for place, name in enumerate(layers.ORDER):
        assert graph[name] <= set(layers.ORDER[place + 1 :]), name


def test_a_package_is_drawn_with_its_purpose():
    assert all(len(layers.purpose(name)) > 15 for name in layers.ORDER)
