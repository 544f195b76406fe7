"""Base class of the mappings in a file: unknown keys refused, exclusive groups and relations of keys checked."""

from typing import ClassVar

from pydantic import BaseModel, ConfigDict, model_validator
from pydantic_core import PydanticCustomError

from cablestudy.scene.layers import ALTERNATIVES


def group_mistakes(table, given, optional=False):
    """Keys that exclude each other, or of which one is missing, as (path inside the table, message) pairs.

    Parameters
    ----------
    table : str
        A key of `layers.ALTERNATIVES`; any other has no groups.
    given : collection of str
        The keys that are there.
    optional : bool
        Whether a row of alternatives may be left out.
    """
    found, given = [], set(given)
    for groups in ALTERNATIVES.get(table, ()):
        used = [group for group in groups if not given.isdisjoint(group)]
        present = [key for group in used for key in group if key in given]
        if len(used) > 1:
            message = f"given together with {present[0]}: give exactly one of {_first_keys(groups)}"
            found += [((key,), message) for key in present if key not in used[0]]
        elif used and used[0][0] not in given:
            found.append(((), f"missing key: {used[0][0]} ({present[0]} goes with it)"))
        elif not used and not optional:
            found.append(((), f"missing key: one of {_first_keys(groups)}"))
    return found


def _first_keys(groups):
    return ", ".join(group[0] for group in groups)


class Table(BaseModel):
    """A mapping of the file. Subclasses say in `relations` what its keys must be to each other.

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

    def relations(self):
        """What must hold between keys that are right alone.

        Yields
        ------
        list of (tuple, bool or ndarray of bool, callable)
            Path inside the table, whether it holds, and the message when it does not. A list is checked only when all
            before it hold. Numbers may be arrays of many cases, see `study.case_table`.
        """
        return ()

    @model_validator(mode="after")
    def _check_relations(self):
        given = [key for key, value in self.__dict__.items() if value is not None and key in self.model_fields_set]
        found = group_mistakes(self.table, given, self.optional_groups) or self._broken()
        if found:
            text = "; ".join(": ".join((".".join(map(str, path)), message)).strip(": ") for path, message in found)
            raise PydanticCustomError("cablestudy", "{text}", {"text": text, "found": found})
        return self

    def _broken(self):
        """Path and message of the relations that do not hold."""
        for together in self.relations():
            if broken := [(path, message()) for path, holds, message in together if not holds]:
                return broken
        return []
