"""The rows of a study as series, each with a look of its own: colour, mark and dashes, or a place on a colour bar."""

from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from matplotlib.lines import Line2D

from cablestudy.plots.quantity import quantities_varied
from cablestudy.plots.style import DASHES, GREY, SERIES, colours_of_names, colours_over, spaced_logarithmically
from cablestudy.plots.words import shortened

MARKS = "os^DvP"
MARKED_DASHES = (*DASHES, (0, (1, 3)))  # of lines with these marks
LONGEST_LABEL = 80  # characters of an entry of a legend
NAMED_SERIES = len(SERIES)  # series that are told apart by a legend of their own
MANY_SERIES = 12  # series from which lines are thin
BAR_NAMES = 24  # names beside a colour bar


@dataclass
class Series:
    """Rows of a study's table that one line joins, or one kind of mark shows."""

    rows: list
    levels: tuple  # for each `Factor` the position, among its levels, of the value that all of these rows have
    label: str  # entry of the legend
    look: dict = field(default_factory=dict)  # colour, mark and dashes


@dataclass(frozen=True)
class Factor:
    """Quantities of a study that vary together and tell series apart."""

    quantities: list  # of DrawnQuantity
    levels: list  # the different sets of values that they take, in order of appearance; a value for each quantity

    @property
    def words(self):
        """Words for what varies."""
        return ", ".join(quantity.words for quantity in self.quantities)

    def text(self, level):
        """One of its levels, without words."""
        return ", ".join(q.level(value) for q, value in zip(self.quantities, self.levels[level], strict=True))

    @property
    def numbers(self):
        """The levels as numbers; None where they are none."""
        if len(self.quantities) > 1 or self.quantities[0].categories is not None:
            return None
        numbers = [level[0] for level in self.levels]
        return None if None in numbers else np.array(numbers)


def series_of(study, every, rows, *drawn):
    """Divide the rows of a study into the series of a picture: each is one line, or one kind of mark.

    Each entry of a study varies one key, or several keys together. Two groups of entries vary along a series: those
    whose keys are drawn, and the random sample of keys, if there is one. Without either, the last entry varies. All
    other entries have one value in a series: they tell the series apart.

    `every` and `rows` are all rows of the study's table, and those with an answer, `drawn` the quantities along x and
    perhaps y or as colour. Returns the list of `Series`, and the list of `Factor`: the entries that tell series apart,
    with the different values that they take (levels).
    """
    entries = quantities_varied(study, every)
    within = _entries_of(entries, drawn) + ([] if study.sample is None else [entries[study.sample_entry]])
    across = [entry for entry in entries if entry not in (within or entries[-1:])]
    factors = [factor for factor in (_factor(entry, rows) for entry in across) if len(factor.levels) > 1]
    categories = drawn[0] if len(drawn) == 1 and drawn[0].categories is not None else None
    groups = _grouped(rows, factors, categories)
    companions = _companions(within, drawn) if any(turn for _, turn in groups) else []  # where categories repeat
    in_common = [[_common(quantity, members) for quantity in companions] for members in groups.values()]
    labels = [_label(factors, levels, words) for (levels, _), words in zip(groups, in_common, strict=True)]
    if companions and len(set(labels)) < len(labels):  # these do not tell all series apart
        labels = [_label(factors, levels, [f"row {turn + 1} of each {categories.words}"]) for levels, turn in groups]
    members = zip(groups.items(), labels, strict=True)
    return [Series(rows, levels, label) for ((levels, _), rows), label in members], factors


def _entries_of(entries, drawn):
    """The entries to which something that is drawn belongs."""
    names, keys = {quantity.name for quantity in drawn}, {quantity.key for quantity in drawn}
    return [entry for entry in entries if any(q.name in names or q.key in keys for q in entry)]


def _companions(within, drawn):
    """The first two keys that vary within a series and are not drawn."""
    keys = {quantity.key for quantity in drawn}
    return [q for entry in within for q in entry if q.key and q.key not in keys][:2]


def _label(factors, levels, further):
    """Label of a series: its levels, and further words."""
    parts = [f"{factor.words} {factor.text(level)}" for factor, level in zip(factors, levels, strict=True)]
    return shortened(", ".join([*parts, *further]), LONGEST_LABEL)


def _grouped(rows, factors, categories):
    """Distribute the rows of a table over the series of a plot: dict of (levels, turn) -> list of rows.

    Rows in which all factors have the same values are one series. Its key `levels` has one int for each factor: the
    index of the row's value in `factor.levels`. `turn` is 0, except where x has `categories`, a quantity whose values
    are names: a series then has each name once, and the second row with the same levels and name goes to the series
    with turn 1, and so on.
    """
    position_of_level = [{level: number for number, level in enumerate(factor.levels)} for factor in factors]
    groups, seen = {}, Counter()
    for row in rows:
        values = [_level(factor.quantities, row) for factor in factors]
        levels = tuple(positions[value] for positions, value in zip(position_of_level, values, strict=True))
        turn = 0
        if categories is not None:
            turn = seen[levels, row.get(categories.name)]
            seen[levels, row.get(categories.name)] += 1
        groups.setdefault((levels, turn), []).append(row)
    return groups


def _level(quantities, row):
    """Values of some quantities in a row, as a tuple."""
    return tuple(quantity.value(row) for quantity in quantities)


def _factor(entry, rows):
    """The first keys of an entry that tell its steps apart, and their levels in order of appearance."""
    steps = len({_level(entry, row) for row in rows})
    for count in range(1, len(entry) + 1):
        levels = list(dict.fromkeys(_level(entry[:count], row) for row in rows))
        if len(levels) == steps:
            break
    return Factor(entry[:count], levels)


def _common(quantity, rows):
    """Words for the value of a quantity that all rows share, or that there is none."""
    values = {quantity.text(row) for row in rows}
    return f"{quantity.words} {values.pop()}" if len(values) == 1 else f"each with its own {quantity.words}"


def give_looks(series, factors, joined):
    """Give each series of a picture its `look`, colour, mark and line style, and make the legend for them.

    A factor is a quantity that tells series apart, its levels are its values. Up to NAMED_SERIES series have a colour
    and a mark each. Of more series, the factor with most levels decides the colour, on a colour bar if its levels are
    many, and the next factor the mark and the line style. Series that differ in further factors look alike: the legend
    says so. `joined` says whether lines join the points.

    Returns the entries of the legend, a list of (artist, str), and the contents of a colour bar, or None: a
    ScalarMappable, its label, and places and names of ticks where they are no numbers.
    """
    many = len(series) > MANY_SERIES
    for line in series:
        line.look = {"ms": 3.0 if many else 4.5, "lw": 1.0 if many else 1.6, "marker": "o", "ls": "-"}
    if len(series) <= NAMED_SERIES:
        for line, colour, mark in zip(series, SERIES, MARKS, strict=False):
            line.look |= {"color": colour, "marker": mark}
        return [(Line2D([], [], **_if_joined(line.look, joined)), line.label or "computed") for line in series], None
    if not factors:
        return _turns(series)
    main, *others = sorted(range(len(factors)), key=lambda k: -len(factors[k].levels))
    entries, bar = _colours(series, factors, main)
    if others and len(factors[others[0]].levels) <= len(MARKS):
        entries += _marks(series, factors, others.pop(0), joined)
    entries += [(Line2D([], [], ls="none"), _entry_of_equal_looks(factors[k])) for k in others]
    return entries, bar


def _if_joined(look, joined):
    """A look, without the line where points are not joined."""
    return look if joined else look | {"ls": "none"}


def _legend_entry(factor, level):
    """Entry of a legend for a level of a factor."""
    return shortened(f"{factor.words} {factor.text(level)}", LONGEST_LABEL)


def _entry_of_equal_looks(factor):
    """Entry of a legend for a factor by whose levels series look alike."""
    first, last = factor.text(0), factor.text(len(factor.levels) - 1)
    return shortened(f"one for each {factor.words}: {first} … {last}", LONGEST_LABEL)


def _colours(series, factors, k):
    """Entries of a legend or a colour bar for a factor, whose levels are the colours of the series."""
    factor, numbers = factors[k], factors[k].numbers
    count = len(factor.levels)
    if count <= NAMED_SERIES:
        colours, bar = SERIES, None
        entries = [(Line2D([], [], color=SERIES[level], lw=3), _legend_entry(factor, level)) for level in range(count)]
    elif numbers is not None:
        mappable, entries = colours_over(numbers, spaced_logarithmically(np.unique(numbers))), []
        colours, bar = mappable.to_rgba(numbers), (mappable, factor.quantities[0].label)
    else:
        ticks, entries = range(0, count, -(-count // BAR_NAMES)), []
        names, mappable = [shortened(factor.text(level), 24) for level in ticks], colours_of_names(count)
        colours, bar = mappable.to_rgba(np.arange(count)), (mappable, shortened(factor.words), ticks, names)
    for line in series:
        line.look["color"] = colours[line.levels[k]]
    return entries, bar


def _marks(series, factors, k, joined):
    """Entries of a legend for a factor, whose levels are the marks and dashes of the series."""
    looks = [{"marker": mark, "ls": dashes} for mark, dashes in zip(MARKS, MARKED_DASHES, strict=True)]
    for line in series:
        line.look |= looks[line.levels[k]]
    samples = [Line2D([], [], color=GREY, ms=4.5, **_if_joined(look, joined)) for look in looks]
    return [(samples[level], _legend_entry(factors[k], level)) for level in range(len(factors[k].levels))]


def _turns(series):
    """A colour bar for series that begin where a category comes again."""
    mappable = colours_over(np.arange(1, len(series) + 1), logarithmic=False)
    for number, line in enumerate(series, 1):
        line.look["color"] = mappable.to_rgba(number)
    return [], (mappable, "which time the name comes")
