"""Names in a suspension, what the ends of its cables refer to, and whether the cables hold it."""

from cablestudy.scene.fields import suggestion
from cablestudy.scene.layers import item_of, mapping_at
from cablestudy.scene.tolerances import SCENE
from cablestudy.scene.units import show


def written_connections(value):
    """Arguments of `connection_mistakes` from the plain values of a file, in which anything may be wrong."""
    points, winches, actuators = (mapping_at(value, (key,)) for key in ("points", "winches", "actuators"))
    bodies = {name: mapping_at(body, ("attachments",)) for name, body in mapping_at(value, ("bodies",)).items()}
    # two ends of each cable and link as written, None where there is none
    cables, links = (
        {name: (item_of(line, "from"), item_of(line, "to")) for name, line in mapping_at(value, (key,)).items()}
        for key in ("cables", "links")
    )
    return points, bodies, cables, winches, actuators, links


def connection_mistakes(points, bodies, ends, winches, actuators, links):
    """Find the mistakes in the connections of a suspension: wrong names, wrong ends, winches of unknown cables.

    An end of a cable or link is the name of a point, or BODY.ATTACHMENT: an attachment is a named place on a body.
    `bodies` are name -> mapping with the names of attachments as keys; `ends` and `links` are name of a cable or link
    -> its two ends, of which only those that are text are checked; `winches` are names of cables that have one.

    Returns path in the scene file, such as ("cables", "north", "from"), and message of each mistake, a list.
    """
    tables = (("points", "point", points), ("bodies", "body", bodies), ("cables", "cable", ends))
    mistakes = _name_mistakes((*tables, ("actuators", "actuator", actuators), ("links", "link", links)))
    for kind, table in (("cable", ends), ("link", links)):
        for name, pair in table.items():
            mistakes += _end_mistakes(kind, name, pair, points, bodies, suggest=len(mistakes) < SCENE.listed_mistakes)
    unknown = [name for name in winches if name not in ends]
    return mistakes + [(("winches", name), f"unknown cable ({suggestion(name, ends)})") for name in unknown]


def _name_mistakes(tables):
    """Path and message of names that are not allowed, or given twice; a table is (its key, kind of thing, names)."""
    mistakes, kind_of_name = [], {}
    for key, kind, names in tables:
        for name in names:
            path = (key, name)
            mistakes += [(path, message) for message in wrong_name(name)]
            if name in kind_of_name:
                mistakes.append((path, f"a name must be unique, and there is a {kind_of_name[name]} of this name"))
            kind_of_name.setdefault(name, kind)
    return mistakes


def wrong_name(name):
    """Message on a name that is not allowed: a list, empty where it is right."""
    if "." in name:
        return ["a name must not contain a dot: BODY.ATTACHMENT is an end, and columns are named NAME.COLUMN"]
    if name.startswith("-") or not name.replace("-", "_").isidentifier():
        return [f"a name begins with a letter and consists of letters, digits, _ and -, got {show(name)}"]
    return []


def _end_mistakes(kind, name, pair, points, bodies, suggest):
    """Path and message of wrong ends of a cable or link, the `kind`; only ends that are text are looked at."""
    mistakes = []
    for key, end in zip(("from", "to"), pair, strict=True):
        message = _wrong_end(kind, end, points, bodies, suggest) if isinstance(end, str) else ""
        if message:
            mistakes.append(((f"{kind}s", name, key), message))
    if isinstance(pair[0], str) and pair[0] == pair[1] and not mistakes:
        mistakes.append(((f"{kind}s", name, "to"), f"both ends are at {pair[1]}"))
    return mistakes


def _wrong_end(kind, end, points, bodies, suggest):
    """Message on an end, as text, that is neither a point nor an attachment of a body; empty where it is right.

    `suggest`: whether the message on an unknown end suggests a similar name, which takes long in large files. The other
    parameters are those of `connection_mistakes` and `_end_mistakes`.
    """
    if end in points:
        return ""
    body, dot, attachment = end.partition(".")
    if body in bodies:
        attachments = [f"{body}.{name}" for name in bodies[body]]
        if attachment in bodies[body]:
            return ""
        if not attachments:
            return f"{body} is a body without attachments: give it some, bodies.{body}.attachments: {{NAME: [x, y, z]}}"
        if not dot:
            return f"{body} is a body: a {kind} ends at one of its attachments ({', '.join(attachments)})"
        return f"{body} has no attachment {show(attachment)} ({suggestion(attachment, bodies[body])})"
    if body in points:
        return f"{body} is a point, which has no attachments"
    known = [*points, *(f"{body}.{name}" for body, attachments in bodies.items() for name in attachments)]
    hint = suggestion(end, known) if suggest and known else "there is no such point or body"
    return f"unknown end {show(end)} ({hint})"


def unsupported(movable, partly_held, owners):
    """Find bodies and free points that would fall: no chain of cables connects them with the ground or a held body.

    Parameters
    ----------
    movable : sequence of str
        Names of the free points, and of the bodies with at least one free motion.
    partly_held : sequence of str
        Names of the bodies with at least one motion that is not free: they count as held.
    owners : sequence of (str or None, str or None)
        For each cable, and each link that carries a force in the reference state, what its two ends are attached to:
        name of a body or free point, None for the ground.

    Returns
    -------
    list of (str, str)
        Name, and message that says why it would fall.
    """
    neighbours = {name: set() for name in (None, *movable, *partly_held)}
    for pair in owners:
        for owner, other in (pair, pair[::-1]):
            neighbours.setdefault(owner, set()).add(other)
    held = {None, *partly_held, *(neighbours.keys() - set(movable))}
    to_visit = list(held)
    while to_visit:  # what a cable connects with something that is held is held too
        newly_held = neighbours[to_visit.pop()] - held
        held |= newly_held
        to_visit += newly_held
    problems = []
    for name in movable:
        if not neighbours[name]:
            problems.append((name, "nothing holds it: no cable ends at it"))
        elif name not in held:
            others = ", ".join(sorted(neighbours[name] - {name})) or "itself"
            problems.append((name, f"nothing holds it: its cables lead to nothing that is fixed (only to {others})"))
    return problems
