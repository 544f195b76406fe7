"""Check that the equilibrium of a suspension is determined: no fewer unknowns than equations, counted by its cables.

A cable may state its unstretched length or what fixes it (preload, sag, tension); a length not stated is an unknown.
"""

from cablestudy.scene.tolerances import SCENE
from cablestudy.scene.words import counted, first_of

STATED = ("unstretched_length", "preload", "sag", "tension_to", "tension")
ROTATIONS = ("roll", "pitch", "yaw")
MOTIONS = ("x", "y", "z", *ROTATIONS)


def determinacy_mistakes(scene):
    """Path and message where too few cables of a `SuspensionScene` state their length, or too many: a list.

    A cable states its length by one of the keys `STATED`. The key `solve_for` of the scene says what is computed:

    - "pose": positions and rotations of the bodies. Each cable must state its length, and the key `tensions` must be
      missing.
    - "lengths": the lengths of the cables that state none. There must be such a cable. If `tensions.reference` is a
      mapping (cable -> force), it must name all of them. The unknowns are these lengths and the rotations that
      `found_rotations` returns. Each free motion of each body gives one equation of equilibrium, and there must not be
      fewer unknowns than equations.
    """
    without_length = cables_without_length(scene)
    if scene.solve_for == "pose":
        return _mistakes_for_pose(scene, without_length)
    if not without_length:
        return [(("solve_for",), "lengths: every cable states one already, so that nothing is left to find")]
    reference = scene.tensions.reference if scene.tensions else None  # one force, or cable -> force
    without_tension = [name for name in without_length if name not in reference] if isinstance(reference, dict) else []
    if without_tension:
        listed = first_of(without_tension, SCENE.listed_names)
        message = f"missing key: one for each cable that states nothing: {listed}"
        return [(("tensions", "reference"), message)]
    motions = {name: body.free for name, body in scene.bodies.items()}  # each gives one equation of equilibrium
    rotations = found_rotations(scene)
    equations = sum(map(len, motions.values()))
    unknowns = len(without_length) + sum(map(len, rotations.values()))
    if unknowns >= equations:
        return []
    counted_equations = _counted(equations, "equation", motions)
    counted_unknowns = _counted(unknowns, "unknown", {"lengths of": without_length, **rotations})
    missing, stating = equations - unknowns, len(scene.cables) - len(without_length)
    other = f"state nothing of {missing} more" if missing <= stating else "state all lengths, with solve_for: pose"
    advice = f"add cables, or {other}"
    return [(("solve_for",), f"lengths: {counted_equations}, and {counted_unknowns}: {advice}")]


def cables_without_length(scene):
    """Names of the cables that state neither a length nor what fixes it, such as a preload or a sag: list of str."""
    return [name for name, cable in scene.cables.items() if cable.stated is None]


def found_rotations(scene):
    """Body -> tuple of the rotations that come from equilibrium with `solve_for: lengths`.

    Those of bodies whose attitude is `free`; those of all where the lengths are fewer than the other equations.
    """
    of_free_attitude = {name: body.turning for name, body in scene.bodies.items() if body.attitude == "free"}
    equations = sum(len(body.free) for body in scene.bodies.values())
    if len(cables_without_length(scene)) + sum(map(len, of_free_attitude.values())) < equations:
        return {name: body.turning for name, body in scene.bodies.items()}
    return of_free_attitude


def _mistakes_for_pose(scene, without_length):
    """Path and message where `solve_for: pose` lacks a length, or has tensions; parameters: names of cables."""
    mistakes = []
    if without_length:
        listed = first_of(without_length, SCENE.listed_names)
        count = f"{len(without_length)} of {len(scene.cables)} cables give none: {listed}"
        needed = f"solve_for: pose needs one of each cable; {count}; solve_for: lengths finds them"
        mistakes.append((("cables", without_length[0]), f"missing key: one of {', '.join(STATED)} ({needed})"))
    if scene.tensions is not None:
        mistakes.append((("tensions",), "belongs to solve_for: lengths; with pose each cable states its own"))
    return mistakes


def _counted(count, noun, names_by_owner):
    """Count of a noun and what is counted, for example `9 equations (gondola x, y, z)`."""
    most = SCENE.listed_names
    listed = "; ".join(f"{owner} {first_of(names, most)}" for owner, names in names_by_owner.items() if names)
    return f"{counted(count, noun)} ({listed})"
