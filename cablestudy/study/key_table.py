"""Table of the command keys."""

from dataclasses import asdict, fields

from cablestudy.errors import SceneError
from cablestudy.scene.fields import suggestion
from cablestudy.scene.keys import ANY, Key, keys_of
from cablestudy.study.table import Field, Table


def key_table(kind, beginning=""):
    """Table of the keys of a file.

    Parameters
    ----------
    kind : {"scene", "suspension", "study"}
    beginning : str
        Only the key of this name and those below it.

    Raises
    ------
    SceneError
        No key begins so.
    """
    known = keys_of(kind)
    found = [key for key in known if not beginning or _is_below(key.key, beginning)]
    if not found:
        raise SceneError(f"{beginning}: unknown key ({suggestion(beginning, [key.key for key in known])})")
    return Table(tuple(Field(field.name, field.name) for field in fields(Key)), [asdict(key) for key in found])


def _is_below(key, beginning):
    """Whether a key is the one asked for or below it; `bodies.camera.mass` is `bodies.NAME.mass`."""
    parts, asked = key.split("."), beginning.split(".")
    alike = all(part in (word, *ANY) for part, word in zip(parts, asked, strict=False))
    return alike and len(asked) <= len(parts)
