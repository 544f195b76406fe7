"""Numbers of scenes of one cable that differ from those of their twins (`twins`)."""

import math
from dataclasses import dataclass

import numpy as np
import twins
from solved import columns_with_keys, end_force, response, solve, solve_all
from twins import blown, chosen_case, held, number, swinging, without

# of a suspension of a cable `cable` and a body `gondola`
BY_NAME = (
    "frequency_1", "frequency_2", "frequency_5", "gondola.frequency_1", "gondola.frequency_x", "gondola.share_x",
    "gondola.frequency_static_1", "gondola.x", "gondola.z", "gondola.yaw", "gondola.mass", "gondola.stiffness_xx",
    "gondola.stiffness_yy", "gondola.stiffness_zz", "gondola.stiffness_rxrx", "gondola.linear_range_x", "cable_mass",
    "cable.mass", "cable.tension_from", "cable.tension_to", "cable.max_tension", "cable.stretched_length",
    "cable.inplane_frequency_2", "cable.end_stiffness_along",
)  # fmt: skip
BY_NAME_IN_WIND = (
    "gondola.rms", "gondola.rms_x", "gondola.rms_y", "gondola.rms_rz", "gondola.rms_x_open_loop",
    "gondola.rms_velocity", "gondola.rms_velocity_open_loop", "cable.rms_tension", "cable.least_tension",
    "cable.midspan_rms",
)  # fmt: skip
ROUNDING = 1e-9  # relative difference that is none
INTEGRATED = 5e-7  # that of a root of a variance: one cable integrates variances to 1e-6
PLACE_OF_PEAK = 1e-7  # that of the frequency of a maximum: about the root of rounding
VARIANCES = {*twins.VARIANCES, *BY_NAME_IN_WIND}
MODES = 8
KINDS = {"inplane": MODES, "outofplane": MODES, "axial": 2}
OF_MODES = [f"{kind}_frequency_{number + 1}" for kind, count in KINDS.items() for number in range(count)]
SYMMETRIC = [f"symmetric_frequency_{number + 1}" for number in range(3)]
MOVED, UNMOVED = ("deflection", "linear_deflection", "nonlinearity"), 1e-9  # by loads: less is rounding of places [m]
OF_FORM = ("sag", "sag_ratio", "lowest_point")
STILL = 1e-3  # RMS below which one is rounding of others [mm], [mm/s], [N]


@dataclass(frozen=True)
class Difference:
    """One number of a scene and of its twin that differ by more than both state.

    Attributes
    ----------
    scene : str
        Its name.
    lossy : bool
        Whether its cable has a loss factor.
    column : str
        Of one cable.
    one, twin : float or None
    size : float
        Difference over the larger one; 1 where one side alone has a number. [-]
    stated : float
        Sum of the errors that both state. [-]
    """

    scene: str
    lossy: bool
    column: str
    one: float | None
    twin: float | None
    size: float
    stated: float


def is_lossy(scene):
    """Whether the cable of a scene has a loss factor."""
    return number(scene["cable"].get("damping", {}).get("loss_factor", 0.0), "") > 0


def is_one_bar(scene):
    """Whether the cable of a scene is one straight bar, which has no form: its stated error of OF_FORM is 100 %."""
    return scene.get("model", {}).get("elements") == 1 and scene["model"].get("order", 1) == 1


def has_loads(scene):
    """Whether there are point loads on the cable, or on that of the chosen load case."""
    return bool(scene["cable"].get("loads") or chosen_case(scene).get("loads"))


def bound_of(scene):
    """Largest error that a side may state: thrice what the scene asks for; of bars that of a coarse mesh. [-]"""
    model = scene.get("model", {})
    return 0.3 if "elements" in model else 3 * number(model.get("accuracy", 1e-4), "")


def difference(name, scene, column, numbers, errors, scale=0.0):
    """The `Difference` of two numbers, None where they agree to ROUNDING and to the errors that both sides state.

    Where one side alone has a number, the column says so: that is a difference of another kind.

    Parameters
    ----------
    name : str
        Of the scene.
    scene : mapping
    column : str
    numbers, errors : tuple of 2 float
        Of one cable and of the twin; None where there is none.
    scale : float
        Size below which a number is rounding of others, as of a coupling stiffness.
    """
    one, twin = numbers
    stated = sum(min(error or 0.0, bound_of(scene)) for error in errors)
    if one is None or twin is None:
        side = "one cable" if one is None else "twin"
        found = Difference(name, is_lossy(scene), f"{column}, {side} refuses", one, twin, 1.0, stated)
        return None if one is twin else found
    size = abs(one - twin) / max(abs(one), abs(twin), scale) if one != twin else 0.0
    rounding = INTEGRATED if column in VARIANCES else PLACE_OF_PEAK if column == "sensitivity_frequency" else ROUNDING
    agrees = size <= rounding + stated
    return None if agrees else Difference(name, is_lossy(scene), column, one, twin, size, stated)


def compare(scenes, columns):
    """Yield the `Difference` to the twin whose body is held of each column that differs.

    Parameters
    ----------
    scenes : dict
        Name -> scene of one cable.
    columns : dict
        Column of one cable -> that of the twin.
    """
    one = solve_all(list(scenes.values()), list(columns), estimate=not columns.keys().isdisjoint(twins.LOADED))
    many = solve_all([held(scene) for scene in scenes.values()], list(columns.values()))
    for (name, scene), own, other in zip(scenes.items(), one, many, strict=True):
        yield from _differences(name, scene, own, other, columns)


def _differences(name, scene, own, other, columns):
    diagonal = [own.values.get(f"end_stiffness{end}") for end in ("", "_zz")]
    for column, twin in columns.items():
        if column in MOVED and own.values["deflection"] is not None and abs(own.values["deflection"]) < UNMOVED:
            continue
        if own.values[column] is None and (other.errors[twin] or 0.0) > bound_of(scene) / 3:
            continue  # one cable refuses what it cannot have to the accuracy that is asked for
        scale = math.sqrt(abs(math.prod(diagonal))) if column == "end_stiffness_xz" and None not in diagonal else 0.0
        numbers, errors = (own.values[column], other.values[twin]), (own.errors[column], other.errors[twin])
        if found := difference(name, scene, column, numbers, errors, scale):
            yield found


def compare_statics(scenes):
    """Statics and stiffness at end 2, in the chosen load case; all scenes of equal columns together."""
    groups = {}
    for name, scene in scenes.items():
        groups.setdefault(tuple(static_columns(scene)), {})[name] = scene
    for group in groups.values():
        yield from compare(group, static_columns(next(iter(group.values()))))


def static_columns(scene):
    """The static columns that a scene has, and those of its twin: dict."""
    names = [name for name in twins.STATIC if not (is_one_bar(scene) and name in OF_FORM)]
    return {name: twins.STATIC[name] for name in columns_with_keys(scene, names)}


def compare_linear_ranges(scenes):
    """The movement up to which the cable restores the gondola linearly, by static forces over distances."""
    yield from compare(scenes, twins.LINEAR)


def compare_modes(scenes):
    """The lowest modes with fixed ends: by kind, and whatever their kind, frequencies in ascending order.

    These also by the names of suspensions, of the cable without its gondola.
    """
    of_cable = {name: f"cable.{name}" for name in (*OF_MODES, *SYMMETRIC)}
    one = solve_all(list(scenes.values()), list(of_cable))
    names = [f"frequency_{number + 1}" for number in range(MODES)]
    many = solve_all([held(scene) for scene in scenes.values()], [*names, *of_cable.values()])
    bare = solve_all([without(scene, "gondola", "winch") for scene in scenes.values()], names)
    for (name, scene), own, other, alone in zip(scenes.items(), one, many, bare, strict=True):
        # of a cable with loads which modes count as symmetric depends on the model
        kinds = {one: twin for one, twin in of_cable.items() if one in OF_MODES or not has_loads(scene)}
        yield from _differences(name, scene, own, other, kinds)
        yield from _differences(name, scene, alone, other, {column: column for column in names})
        pairs = [(own.values[kind], own.errors[kind]) for kind in OF_MODES if own.values[kind] is not None]
        pairs = (sorted(pairs, key=lambda pair: pair[0]) + [(None, None)] * MODES)[:MODES]
        for (value, error), column in zip(pairs, names, strict=True):
            numbers, errors = (value, other.values[column]), (error, other.errors[column])
            if found := difference(name, scene, "modes", numbers, errors):
                yield found


def compare_gondola(scenes):
    """The gondola's mode: its frequency, its share, and its damping ratio, with the air on the gondola."""
    for name, scene in scenes.items():
        own, other = solve(scene, *twins.COUPLED), solve(swinging(scene), *twins.COUPLED.values())
        yield from _differences(name, scene, own, other, twins.COUPLED)


def wind_columns(scene):
    """Columns of the loop and of the gondola in the wind on it, and those of the twin: dict."""
    found = twins.LOOP | twins.OPEN_WIND | twins.WIND
    steady = "wind" in chosen_case(scene)  # whose force is in the mean displacement of one cable alone
    found |= twins.PEAK if scene["wind"].get("mean") is False and not steady else {}
    found |= twins.IMAGED if "exposure" in scene else {}
    found |= twins.CORRECTED if "correction" in scene else {}
    return found | twins.BOTH if {"exposure", "correction"} <= set(scene) else found


def compare_loop(scenes, by_name=()):
    """The winch loop, and the gondola in the wind on it.

    Of the scenes named in `by_name` also columns of suspensions, which a scene of one cable has by the same names.
    """
    for name, scene in scenes.items():
        columns = wind_columns(scene)
        same = dict.fromkeys(BY_NAME + BY_NAME_IN_WIND) if name in by_name else {}
        own = solve(scene, *columns, *same)
        other = solve(swinging(scene), *dict.fromkeys([*columns.values(), *same]))
        yield from _differences(name, scene, own, other, columns)
        yield from _differences(name, scene, own, other, {column: column for column in same})


def compare_open_wind(scenes):
    """The gondola in the wind on it, of scenes without a winch."""
    columns = {one: twin.removesuffix("_open_loop") for one, twin in twins.OPEN_WIND.items()}
    for name, whole in scenes.items():
        scene = without(whole, "winch")
        own, other = solve(scene, *columns), solve(swinging(scene), *columns.values())
        yield from _differences(name, scene, own, other, columns)


def compare_cable_wind(scenes):
    """The gondola, or a bare cable, in a coherent wind on the cable: the larger one of wind across and along.

    Without damping by the air, which one cable takes as the same in all directions.
    """
    for name, whole in scenes.items():
        scene = whole | {"wind": whole["wind"] | {"aerodynamic_damping": False}}
        columns = twins.CABLE_WIND if "gondola" in scene else twins.BARE_CABLE
        unlike = twins.OF_TENSION if "elements" in scene["model"] else ()  # by their mean tensions
        columns = {one: columns[one] for one in columns_with_keys(scene, list(columns)) if one not in unlike}
        own = solve(scene, *columns)
        sides = [solve(blown(scene, across), *columns.values()) for across in (True, False)]
        for column, twin in columns.items():
            found = [side.values[twin] for side in sides]
            worst = None if None in found else min(found) if column == "least_tension" else max(found)
            error = max((side.errors[twin] or 0.0) for side in sides)
            numbers, errors = (own.values[column], worst), (own.errors[column], error)
            if one := difference(name, scene, column, numbers, errors, STILL):
                yield one


FREQUENCIES = np.geomspace(0.02, 60.0, 40)  # [Hz]


def compare_state_space(scenes):
    """The gondola by a force on it and by a winch that reels, over frequency, with all modes of few elements.

    The winch of one cable moves an end along x. One that reels the cable of the twin in is held against the state space
    of the cable alone, whose ends move in all directions, and the equation of the gondola. A delay or a controller is
    no part of it, nor is the wind.
    """
    for name, whole in scenes.items():
        scene = without(whole, "wind")
        twin = swinging(scene)
        right = response(scene, ("force_gondola", "gondola_position"), FREQUENCIES, with_="gondola")
        found = response(twin, ("gondola.force_x", "gondola.x"), FREQUENCIES)
        yield from _over_frequency(name, scene, "response to a force", found, right)
        if not is_lossy(scene):  # whose equivalent depends on what moves with the cable
            twin["winches"]["cable"].pop("direction")
            found = response(twin, ("winch.cable", "gondola.x"), FREQUENCIES)
            yield from _over_frequency(name, scene, "response to the winch", found, by_reeling(scene))


def _over_frequency(name, scene, column, found, right):
    size = float((np.abs(found - right) / np.abs(right)).max())
    if size > ROUNDING:
        yield Difference(name, is_lossy(scene), column, None, None, size, 0.0)


def by_reeling(scene):
    """Displacement of the gondola per length that the winch reels in, by the state space of the cable alone, (f,)."""
    plain = without(scene, "gondola", "winch", "wind", "correction", "exposure")
    stretch, tangent = reeled(scene)
    end = "end_2" if scene["winch"].get("location") == "gondola" else "end_1"
    moved = np.array([response(plain, (f"{end}_{axis}", "force_end_2_x"), FREQUENCIES) for axis in "xyz"])
    s, own = 2j * math.pi * FREQUENCIES, response(plain, ("end_2_x", "force_end_2_x"), FREQUENCIES)
    return -stretch * (tangent @ moved) / (number(scene["gondola"]["mass"], "kg") * s**2 + own)


def reeled(scene):
    """How far an end of the cable moves per length that a winch there reels in, 1 + T/EA, and the outward tangent."""
    force = end_force(scene, 2 if scene["winch"].get("location") == "gondola" else 1)
    tension = float(np.linalg.norm(force))
    stiffness = solve(scene, "axial_stiffness").values["axial_stiffness"]
    return 1 + tension / stiffness, -force / tension
