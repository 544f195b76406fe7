"""Names in a suspension, what the ends of its cables refer to, and whether the cables hold it."""

from cablestudy.scene.fields import suggestion
from cablestudy.scene.mistakes import MAX_SHOWN
from cablestudy.scene.units import show

ORIGIN = (0.0, 0.0, 0.0)


def written_connections(value):
    """Points, bodies, ends, winches, actuators and links of a file, whatever is wrong in it.

    Returns
    -------
    points, bodies, ends, winches, actuators, links : dict
        Plain values, see `connection_mistakes`.
    """
    bodies = {name: _mapping(_mapping(body).get("attachments")) for name, body in _mapping(value.get("bodies")).items()}
    ends, links = (
        {name: (_mapping(one).get("from"), _mapping(one).get("to")) for name, one in _mapping(value.get(key)).items()}
        for key in ("cables", "links")
    )
    points, winches, actuators = (_mapping(value.get(key)) for key in ("points", "winches", "actuators"))
    return points, bodies, ends, winches, actuators, links


def _mapping(value):
    return value if isinstance(value, dict) else {}


def connection_mistakes(points, bodies, ends, winches, actuators, links):
    """Mistakes: names that are not allowed, ends that refer to nothing, winches of unknown cables.

    Parameters
    ----------
    points : collection of str
        Their names.
    bodies : dict
        Name -> its attachments, a mapping.
    ends : dict
        Name of a cable -> its two ends; only those that are text are looked at.
    winches : collection of str
        Names of cables.
    actuators : collection of str
        Their names.
    links : dict
        Name of a link -> its two ends, as of cables.

    Returns
    -------
    list of (tuple, str)
        Path and message.
    """
    tables = (("points", "point", points), ("bodies", "body", bodies), ("cables", "cable", ends))
    mistakes = _name_mistakes((*tables, ("actuators", "actuator", actuators), ("links", "link", links)))
    for kind, table in (("cable", ends), ("link", links)):
        for name, pair in table.items():
            mistakes += _end_mistakes(kind, name, pair, points, bodies, len(mistakes) < MAX_SHOWN)
    unknown = [name for name in winches if name not in ends]
    return mistakes + [(("winches", name), f"unknown cable ({suggestion(name, ends)})") for name in unknown]


def _name_mistakes(tables):
    """Names that are not allowed, or given twice, in tables as (key, what it holds, names)."""
    mistakes, kinds = [], {}
    for table, kind, names in tables:
        for name in names:
            mistakes += [((table, name), message) for message in wrong_name(name)]
            if name in kinds:
                mistakes.append(((table, name), f"a name must be unique, and there is a {kinds[name]} of this name"))
            kinds.setdefault(name, kind)
    return mistakes


def wrong_name(name):
    """Mistakes of a name, a list of at most one message."""
    if "." in name:
        return ["a name must not contain a dot: BODY.ATTACHMENT is an end, and columns are named NAME.COLUMN"]
    if name.startswith("-") or not name.replace("-", "_").isidentifier():
        return [f"a name begins with a letter and consists of letters, digits, _ and -, got {show(name)}"]
    return []


def _end_mistakes(kind, name, pair, points, bodies, suggest):
    """Mistakes of the two ends of a cable or link, the `kind`, as far as they are text."""
    found = []
    for key, end in zip(("from", "to"), pair, strict=True):
        message = _wrong_end(kind, end, points, bodies, suggest) if isinstance(end, str) else ""
        if message:
            found.append(((f"{kind}s", name, key), message))
    if isinstance(pair[0], str) and pair[0] == pair[1] and not found:
        found.append(((f"{kind}s", name, "to"), f"both ends are at {pair[1]}"))
    return found


def _wrong_end(kind, end, points, bodies, suggest):
    """What is wrong with an end that is text, or an empty text; without `suggest` nothing similar is searched for."""
    if end in points:
        return ""
    body, dot, attachment = end.partition(".")
    if body in bodies:
        listed = [f"{body}.{name}" for name in bodies[body]]
        if attachment in bodies[body]:
            return ""
        if not listed:
            return f"{body} is a body without attachments: no {kind} can end at it"
        if not dot:
            return f"{body} is a body: a {kind} ends at one of its attachments ({', '.join(listed)})"
        return f"{body} has no attachment {show(attachment)} ({suggestion(attachment, bodies[body])})"
    if body in points:
        return f"{body} is a point, which has no attachments"
    known = [*points, *(f"{body}.{name}" for body, attachments in bodies.items() for name in attachments)]
    hint = suggestion(end, known) if suggest and known else "there is no such point or body"
    return f"unknown end {show(end)} ({hint})"


def attachment_of(points, bodies, end):
    """Holder of an end that exists, and its place there; tables as of `SuspensionScene`, see its `attachment`."""
    if not isinstance(end, str):
        return None, end
    if end in points:
        return (end, ORIGIN) if points[end].free else (None, points[end].at)
    body, _, attachment = end.partition(".")
    return body, bodies[body].attachments[attachment]


def unheld(movable, stands, owners):
    """Bodies and free points that no chain of cables connects with something that stands.

    Parameters
    ----------
    movable : collection of str
        Bodies that may move, and free points.
    stands : collection of str
        Those of them of which some motion is held.
    owners : list of (str or None, str or None)
        What holds the two ends of each cable, and of each link that carries in the reference state; None: the ground.

    Returns
    -------
    list of (str, str)
        Name and message.
    """
    neighbours = {name: set() for name in (None, *movable)}
    for pair in owners:
        for owner, other in (pair, pair[::-1]):
            neighbours.setdefault(owner, set()).add(other)
    reached = {None, *stands, *(neighbours.keys() - set(movable))}
    front = list(reached)
    while front:
        new = neighbours[front.pop()] - reached
        reached |= new
        front += new
    problems = []
    for name in movable:
        if not neighbours[name]:
            problems.append((name, "nothing holds it: no cable ends at it"))
        elif name not in reached:
            others = ", ".join(sorted(neighbours[name] - {name})) or "itself"
            problems.append((name, f"nothing holds it: its cables lead to nothing that is fixed (only to {others})"))
    return problems
