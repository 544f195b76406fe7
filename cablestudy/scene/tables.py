"""What every mapping of a file has in common: unknown keys refused, exclusive groups checked."""

from typing import ClassVar

from pydantic import BaseModel, ConfigDict, model_validator
from pydantic_core import PydanticCustomError

from cablestudy.scene.layers import ALTERNATIVES


def group_mistakes(table, given, optional=False):
    """Keys that exclude each other, or of which one is missing.

    Parameters
    ----------
    table : str
        A key of `layers.ALTERNATIVES`; any other has no groups.
    given : collection of str
        The keys that are there.
    optional : bool
        Whether a row may be left out altogether.

    Returns
    -------
    list of (tuple, str)
        Path inside the table (empty: the table itself), and what is wrong there.
    """
    found = []
    for groups in ALTERNATIVES.get(table, ()):
        names = ", ".join(group[0] for group in groups)
        present = [key for group in groups for key in group if key in given]
        used = [group for group in groups if any(key in given for key in group)]
        if len(used) > 1:
            first = present[0]
            found.extend(
                ((key,), f"given together with {first}: give exactly one of {names}")
                for group in used
                if first not in group
                for key in group
                if key in given
            )
        elif used and used[0][0] not in given:
            found.append(((), f"missing key: {used[0][0]} ({present[0]} goes with it)"))
        elif not used and not optional:
            found.append(((), f"missing key: one of {names}"))
    return found


class Table(BaseModel):
    """A mapping of the file. Subclasses add `together` for what the keys must be to each other.

    Attributes
    ----------
    table : str
        Its dotted key in the file, where it has exclusive groups.
    optional_groups : bool
        Whether none of a group may be given.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", revalidate_instances="never")
    table: ClassVar[str] = ""
    optional_groups: ClassVar[bool] = False

    def together(self):
        """Mistakes of keys that are right alone, as (path inside the table, message)."""
        return ()

    @model_validator(mode="after")
    def _check_together(self):
        given = ()
        if self.table:
            given = [key for key in self.model_fields_set if getattr(self, key) is not None]
        found = group_mistakes(self.table, given, self.optional_groups) or list(self.together())
        if found:
            text = "; ".join(": ".join((".".join(map(str, path)), message)).strip(": ") for path, message in found)
            raise PydanticCustomError("cablestudy", "{text}", {"text": text, "found": found})
        return self
