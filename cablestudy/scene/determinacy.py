"""Check that cables state as much as the statics of their suspension need: equations and unknowns are counted."""

from cablestudy.scene.words import counted, first_of

STATED = ("unstretched_length", "preload", "sag", "tension_to", "tension")
ROTATIONS = ("roll", "pitch", "yaw")
LISTED = 8  # names in a message


def determinacy_mistakes(scene):
    """Mistakes where too little is stated, or something to no purpose.

    Parameters
    ----------
    scene : SuspensionScene

    Returns
    -------
    list of (tuple, str)
        Path and message.
    """
    silent = silent_cables(scene)
    if scene.solve_for == "pose":
        return _of_pose(scene, silent)
    if not silent:
        return [(("solve_for",), "lengths: every cable states one already, so that nothing is left to find")]
    reference = scene.tensions.reference if scene.tensions else None
    lacking = [name for name in silent if name not in reference] if isinstance(reference, dict) else []
    if lacking:
        message = f"missing key: one for each cable that states nothing: {first_of(lacking, LISTED)}"
        return [(("tensions", "reference"), message)]
    motions = {name: body.free for name, body in scene.bodies.items()}
    turning = found_rotations(scene)
    equations = sum(map(len, motions.values()))
    unknowns = len(silent) + sum(map(len, turning.values()))
    if unknowns >= equations:
        return []
    more = equations - unknowns
    message = f"lengths: {_counted(equations, 'equation', motions)}, and " + _counted(
        unknowns, "unknown", {"lengths of": silent, **turning}
    )
    return [(("solve_for",), f"{message}: add cables, or state nothing of {more} more")]


def silent_cables(scene):
    """List of the names of the cables that do not state their length in any way."""
    return [name for name, cable in scene.cables.items() if cable.stated is None]


def found_rotations(scene):
    """Body -> tuple of the rotations that come from equilibrium with `solve_for: lengths`.

    Those of bodies whose attitude is `free`; those of all where the lengths are fewer than the other equations.
    """
    turning = {name: body.turning for name, body in scene.bodies.items() if body.attitude == "free"}
    equations = sum(len(body.free) for body in scene.bodies.values())
    if len(silent_cables(scene)) + sum(map(len, turning.values())) < equations:
        return {name: body.turning for name, body in scene.bodies.items()}
    return turning


def _of_pose(scene, silent):
    found = []
    if silent:
        count = f"{len(silent)} of {len(scene.cables)} cables give none: {first_of(silent, LISTED)}"
        message = f"missing key: one of {', '.join(STATED)} (solve_for: pose needs one of each cable; {count})"
        found.append((("cables", silent[0]), message))
    if scene.tensions is not None:
        found.append((("tensions",), "belongs to solve_for: lengths; with pose each cable states its own"))
    return found


def _counted(count, noun, names):
    """For example `9 equations (gondola: x, y, z)`."""
    listed = "; ".join(f"{name} {first_of(inside, LISTED)}" for name, inside in names.items() if inside)
    return f"{counted(count, noun)} ({listed})"
