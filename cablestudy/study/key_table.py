"""Table of the command keys."""

from dataclasses import asdict, fields

from cablestudy.errors import SceneError
from cablestudy.scene.fields import suggestion
from cablestudy.scene.keys import Key, keys_of
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
    found = [key for key in known if not beginning or f"{key.key}.".startswith(f"{beginning}.")]
    if not found:
        raise SceneError(f"{beginning}: unknown key ({suggestion(beginning, [key.key for key in known])})")
    return Table(tuple(Field(field.name, field.name) for field in fields(Key)), [asdict(key) for key in found])
