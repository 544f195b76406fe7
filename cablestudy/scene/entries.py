"""Variations of a study, from `vary`, `sample` and the options `--vary`: entries, whose combinations are the cases.

An entry is one key with its values, or several keys that take their values together, step by step.
"""

import math
import sys
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from cablestudy.errors import Mistake, Mistakes
from cablestudy.scene.fields import ALL
from cablestudy.scene.layers import replaced_by, split_key
from cablestudy.scene.ranges import read_interval, read_range, read_vary
from cablestudy.scene.sampling import Sampled
from cablestudy.scene.tolerances import SCENE
from cablestudy.scene.units import show

ALTERNATIVE = "alternative"  # in the place of a key: names of several changes, one of which is made in each case
CONTAINED = "cannot vary together with {}: one of them contains the other"


@dataclass(frozen=True)
class Entry:
    """One entry of `vary`: keys that take their values together, one value each per step.

    `columns` has a tuple for each key. The key ALTERNATIVE is no key of the scene: its values are the keys of
    `alternatives`, names of groups of changes, one of which is made at each step.
    """

    columns: tuple[tuple[str, Any, Any], ...]  # dotted key, its values, and index -> place, called only on a mistake
    # name of an alternative -> what it sets: dotted key, value, and place as above
    alternatives: dict[str, tuple[tuple[str, Any, Any], ...]] = field(default_factory=dict)

    def __post_init__(self):
        if not self.columns:
            raise ValueError("an entry without a key")
        if len({len(values) for _, values, _ in self.columns}) > 1:
            listed = ", ".join(f"{key} {len(values)}" for key, values, _ in self.columns)
            raise ValueError(f"keys of one entry go together and need equally many values: {listed}")

    def __len__(self):
        return len(self.columns[0][1])

    @property
    def keys(self):
        """Tuple of its dotted keys, each a column of the table; ALTERNATIVE among them is no key of the scene."""
        return tuple(key for key, _, _ in self.columns)

    @property
    def set_keys(self):
        """Dotted keys that are set at some step: tuple."""
        varied = [key for key in self.keys if key != ALTERNATIVE or not self.alternatives]
        of_alternatives = [key for settings in self.alternatives.values() for key, _, _ in settings]
        return tuple(dict.fromkeys([*varied, *of_alternatives]))

    def always_set(self, key):
        """True if one of `set_keys` is set at every step."""
        keys_of_each = ([other for other, _, _ in settings] for settings in self.alternatives.values())
        return key in self.keys or all(key in keys for keys in keys_of_each)

    def shown(self, index):
        """Key -> value of one step as the table has it: dict."""
        return {key: values[index] for key, values, _ in self.columns}

    def settings(self, index):
        """List of (key, value, place) that one step sets, as `Document.with_sets` takes them."""
        items = []
        for key, values, place in self.columns:
            if key == ALTERNATIVE and self.alternatives:
                items += self.alternatives[values[index]]
            else:
                items.append((key, values[index], partial(place, index)))
        return items

    def steps(self):
        """Indices of the steps worth checking: all, but of ranges and samples only some."""
        if any(isinstance(values, list) for _, values, _ in self.columns):
            return range(len(self))
        return sorted(set().union(*(values.worth_checking(SCENE.checked_steps) for _, values, _ in self.columns)))


def entries_of(table, source, cases):
    """Read what varies in a study file, its keys `vary` and `sample`: tuple of `Entry`, and mistakes (path, message).

    The combinations of the steps of all entries are the cases of the study, at most `SCENE.cases`. `table` is the study
    file as `StudyTable`, `source` as read, for the places of values; `cases` returns the names of the load cases of the
    scene, all of which `case: all` stands for. The entries are those of `vary`, then that of `sample`, without what is
    wrong in them.
    """
    entries, mistakes, varied = [], [], set()
    written = [(("vary", number), mapping, partial(_values, cases)) for number, mapping in enumerate(table.vary)]
    if table.sample:
        written.append((("sample", "over"), table.sample.over, partial(_sampled, table.sample)))
    for path, mapping, read_values in written:
        columns, alternatives, mistakes_of_entry = _read_entry(mapping, path, read_values, source, varied)
        mistakes += mistakes_of_entry
        try:
            entries += [Entry(columns, alternatives)] if columns or not mapping else []
        except ValueError as error:
            mistakes.append((path, str(error)))
    count = math.prod(map(len, entries))
    if count > SCENE.cases:
        mistakes.append((("vary" if table.vary else "sample",), f"{count} cases (at most {SCENE.cases})"))
    while math.prod(map(len, entries)) > sys.maxsize:  # of what follows no case has a number that an array holds
        entries.pop()
    return tuple(entries), mistakes


def _read_entry(mapping, path, read_values, source, varied):
    """Read one entry of `vary`, or the table `over` of `sample`.

    Parameters
    ----------
    mapping : dict
        The entry as written, such as {"cable.sag": ["1 m", "2 m"]}.
    path : tuple
        Keys and indices that lead to it in the study file.
    read_values : callable
        (key, value as written) -> sequence of the values of the key; raises ValueError where they are wrong.
    source : Document or StudyFile
        The study file as read, for the places of values.
    varied : set of str
        Keys of the entries before it; those of this entry are added.

    Returns
    -------
    columns, alternatives
        The attributes of an `Entry`.
    mistakes : list of (path, message)
    """
    columns, alternatives, mistakes = [], {}, []
    for key, written in mapping.items():
        try:
            _check_unvaried(key, varied)
            varied.add(key)
            if key == ALTERNATIVE and path[0] == "vary":
                alternatives, wrong_alternatives = _alternatives(source, (*path, key), written, varied)
                varied |= {other for settings in alternatives.values() for other, _, _ in settings}
                if wrong_alternatives:
                    mistakes += wrong_alternatives
                    continue
                written = list(alternatives)
            columns.append((key, read_values(key, written), partial(_value_place, source, (*path, key))))
        except ValueError as error:
            mistakes.append(((*path, key), str(error)))
    return tuple(columns), alternatives, mistakes


def _check_unvaried(key, varied):
    """Refuse what is no dotted key, and a key that varies already, whole or in part: ValueError."""
    path = split_key(key)
    if key in varied:
        raise ValueError("varies in an entry above already")
    for other in varied:
        if _one_begins_other(path, split_key(other)):
            raise ValueError(CONTAINED.format(other))


def _one_begins_other(path, other):
    """True if one of two paths begins with the other."""
    shorter = min(len(path), len(other))
    return path[:shorter] == other[:shorter]


def _alternatives(source, path, written, varied):
    """Read the alternatives of an entry: the attribute of `Entry`, and mistakes (path, message).

    `written` is what the study file `source` has at the path; ValueError where it is no mapping, or an empty one. No
    alternative may change a key of `varied`, those of this entry and of earlier ones.
    """
    if not isinstance(written, dict):
        raise ValueError(f"expected name: {{key: value, ...}} for each alternative, got {show(written)}")
    if not written:
        raise ValueError("expected at least one alternative, as name: {key: value, ...}")
    alternatives, mistakes = {}, []
    for name, changes in written.items():
        if not name.strip():
            mistakes.append(((*path, name), "an alternative needs a name"))
            continue
        if not isinstance(changes, dict):
            mistakes.append(((*path, name), f"expected {{key: value, ...}}, got {show(changes)}"))
            continue
        settings = []
        for key, value in changes.items():
            try:
                _check_unvaried(key, varied.union(other for other, _, _ in settings))
                settings.append((key, value, partial(source.place, (*path, name, key))))
            except ValueError as error:
                mistakes.append(((*path, name, key), str(error)))
        alternatives[name] = tuple(settings)
    return alternatives, mistakes


def _value_place(source, path, index, of_key=False):
    """Place of one varied value, or of its key; all values of a range have the same."""
    return source.place(path, of_key=True) if of_key else source.place((*path, index))


def _values(cases, key, written):
    """The values of a varied key: a list as it is, a mapping as a range, `case: all` as the names of all cases."""
    if isinstance(written, dict):
        return read_range(written)
    if (key, written) == ("case", ALL):
        return _all_cases(cases())
    if not isinstance(written, list):
        raise ValueError(f"expected a list of values, or a range {{from, to, count}}, got {show(written)}")
    if not written:
        raise ValueError("expected at least one value")
    return written


def _all_cases(cases):
    """List of the names of the load cases of a scene; ValueError where there is none."""
    if not cases:
        raise ValueError(f"{ALL}: the scene has no cases")
    return list(cases)


def _sampled(sample, key, written):
    """The values of a sampled key, from its interval as written."""
    return Sampled(sample, list(sample.over).index(key), read_interval(written))


def entries_of_options(texts, entries, cases):
    """Read the options `--vary` of a command: each is an `Entry`, one more key that varies in a study.

    `texts` are the arguments, for example "cable.sag=1 m:3 m:5"; keys of `entries`, those of the study file, cannot be
    varied again; `cases` is as in `entries_of`. Returns the tuple of the new entries alone. SceneError for all options
    that cannot be read, or whose key varies already; or for more than `SCENE.cases` in all.
    """
    added = []
    with Mistakes() as mistakes:
        for text in texts:
            with mistakes.at(f"--vary {text}"):
                key, values = read_vary(text)
                values = _all_cases(cases()) if (key, values) == ("case", [ALL]) else values
                option = f"--vary {key}"
                varied = [other for entry in (*entries, *added) for other in entry.set_keys]
                reason = next(filter(None, (clash(key, other) for other in varied)), None)
                if reason:
                    mistakes.append(Mistake(option, "", reason))
                added.append(Entry(((key, values, partial(_place_of_option, option)),)))
        count = math.prod(map(len, (*entries, *added)))
        if texts and count > SCENE.cases and not mistakes:
            mistakes.append(Mistake("--vary", "", f"{count} cases (at most {SCENE.cases})"))
    return tuple(added)


def _place_of_option(option, index, of_key=False):  # a lambda could not be pickled
    return option


def clash(key, other):
    """Reason why a key cannot vary, or be solved for, together with another one that varies; None where it can."""
    path, other_path = split_key(key), split_key(other)
    if path == other_path:
        return "varies already"
    if _one_begins_other(path, other_path):
        return CONTAINED.format(other)
    if other_path in replaced_by(key) and path in replaced_by(other):
        return f"cannot vary together with {other}: they exclude each other"
    return None
