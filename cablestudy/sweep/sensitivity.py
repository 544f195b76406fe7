"""sweep --sensitivity: how much of the variance of a column each sampled key explains, alone and with all others.

With f(A), f(B) the values at two independent samples and f(AB_i) those at A with key i taken from B (the design of
Saltelli),

    first order S_i = mean(f(B) (f(AB_i) - f(A))) / V,    total T_i = mean((f(A) - f(AB_i))^2) / (2 V),

V the variance of f(A) and f(B) together. The intervals are percentiles of a bootstrap over the points; as all of it is
made of means, the points are first put into at most 1024 blocks of about equally many, which are drawn instead.
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.errors import Mistake, SceneError
from cablestudy.scene.sampling import FEWEST
from cablestudy.study.prepare import columns_of
from cablestudy.study.table import Field, Table
from cablestudy.sweep.rows import written

RESAMPLES = 1000
BLOCKS = 1024
CONFIDENCE = 0.95
CONSTANT = 1e-12  # relative: below it a column does not vary
DUST = 1e-12  # an index below it is none


@dataclass(frozen=True)
class Indices:
    """Sobol's indices of one column, each of shape (keys, 3): estimate, lower and upper end of its interval. [-]"""

    first: np.ndarray
    total: np.ndarray


def indices(f_a, f_b, f_ab, seed=0):
    """Sobol's indices from the values of a Saltelli design.

    Parameters
    ----------
    f_a, f_b : array_like, shape (n,)
        At both samples.
    f_ab : array_like, shape (keys, n)
        At the first one with key i taken from the second.
    seed : int
        Of the bootstrap.

    Returns
    -------
    Indices or None
        None when the values do not vary.
    """
    values = np.vstack([f_a, f_b, f_ab]).astype(float)
    scale = np.abs(values).max()
    if np.ptp(values) <= CONSTANT * scale:
        return None
    values = values / scale
    values -= values[:2].mean()  # the mean plays no part, and squares of it would cost digits
    a, b, ab = values[0], values[1], values[2:]
    terms = np.vstack([a, b, a**2 + b**2, b * (ab - a), (a - ab) ** 2])
    points = a.size
    blocks = min(points, BLOCKS)
    sums = np.add.reduceat(terms, np.arange(blocks) * points // blocks, axis=1)
    sizes = np.diff(np.append(np.arange(blocks) * points // blocks, points))
    # numbers of times that each block is drawn; the first line is the sample itself
    drawn = np.random.default_rng(seed).multinomial(blocks, np.full(blocks, 1 / blocks), RESAMPLES)
    drawn = np.vstack([np.ones(blocks), drawn])
    means = drawn @ sums.T / (drawn @ sizes)[:, None]
    keys = len(ab)
    variance = means[:, 2] / 2 - (means[:, 0] + means[:, 1]) ** 2 / 4
    if variance[0] <= 0:
        return None
    usable = variance > 0  # a draw of equal values says nothing
    shares = means[usable, 3:] / variance[usable, None]
    shares[:, keys:] /= 2
    shares[np.abs(shares) < DUST] = 0.0
    ends = np.percentile(shares[1:], [50 * (1 - CONFIDENCE), 50 * (1 + CONFIDENCE)], axis=0)
    found = np.vstack([shares[:1], ends]).T
    return Indices(found[:keys], found[keys:])


class Sensitivity:
    """The indices of a study's columns.

    Parameters
    ----------
    study : Study
        With a `sample` of the method saltelli.

    Raises
    ------
    SceneError
        The study has no such sample, or no column that has indices.
    """

    def __init__(self, study):
        sample = study.sample
        if sample is None or sample.method != "saltelli":
            where = study.where(("sample",) if sample is None else ("sample", "method"))
            wanted = "--sensitivity needs a sample of the method saltelli, which gives count x (keys + 2) cases"
            raise SceneError(Mistake(where, "", wanted))
        if sample.count < FEWEST:
            message = f"--sensitivity needs at least {FEWEST} points, got {sample.count}"
            raise SceneError(Mistake(study.where(("sample", "count")), "", message))
        self.study = study
        self.columns = [column for column in columns_of(study) if column.needs != "run"]
        if not self.columns:
            where = study.where(("columns",))
            raise SceneError(Mistake(where, "", "--sensitivity: none of the columns depends on the scene alone"))

    def table(self, rows):
        """The table of the indices.

        Parameters
        ----------
        rows : iterable of dict
            Of all cases, in the order of the study.

        Returns
        -------
        table : Table
            For each step of the other entries, each column, each sampled key: a row; cells are empty where there is no
            index.
        notes : list of str
            Why not.
        """
        study, sample = self.study, self.study.sample
        values = np.full((len(self.columns), study.count), np.nan)
        headers = [column.header for column in self.columns]
        for place, row in enumerate(rows):
            values[:, place] = [np.nan if row.get(header) is None else row[header] for header in headers]
        lengths = [len(entry) for entry in study.entries]
        values = np.moveaxis(values.reshape(-1, *lengths), 1 + study.sample_entry, -1)
        values = values.reshape(len(headers), -1, sample.count, sample.pages)
        groups, found, notes = self._groups(lengths), [], []
        for group, shown in enumerate(groups):
            among = ", ".join(f"{key}={value}" for key, value in shown.items())
            for header, cells in zip(headers, values[:, group], strict=True):
                about = f"{header}{f' ({among})' if among else ''}: no indices,"
                estimate, empty = None, int(np.isnan(cells).sum())
                if empty:
                    notes.append(f"{about} {empty} of {cells.size} cases have no value")
                else:
                    estimate = indices(cells[:, 0], cells[:, -1], cells[:, 1:-1].T, sample.seed)
                    if estimate is None:
                        notes.append(f"{about} the column does not vary")
                for key, name in enumerate(sample.over):
                    found.append({**shown, "column": header, "parameter": name, **_cells(estimate, key)})
        fields = [Field(key, key) for key in groups[0]]
        fields += [Field("column", "column"), Field("parameter", "parameter")]
        fields += [Field(name, name.replace("_", " ")) for name in _cells(None, 0)]
        return Table(tuple(fields), found), notes

    def _groups(self, lengths):
        """What the entries beside the sample have in each of their combinations, as written."""
        study, place = self.study, self.study.sample_entry
        sampled = set(study.sample.over)
        cases = np.arange(study.count).reshape(lengths).take([0], axis=place).reshape(-1)
        return [
            {key: value for key, value in written(study.overrides(int(case))).items() if key not in sampled}
            for case in cases
        ]


def _cells(estimate, key):
    names = [f"{kind}{end}" for kind in ("first_order", "total") for end in ("", "_low", "_high")]
    if estimate is None:
        return dict.fromkeys(names)
    return dict(zip(names, map(float, (*estimate.first[key], *estimate.total[key])), strict=True))
