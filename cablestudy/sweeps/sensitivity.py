"""sweep --sensitivity: Sobol's indices, the share of a column's variance that each sampled key explains.

With f(A), f(B) the values at two independent samples and f(AB_i) those at A with key i taken from B,

    first order S_i = mean(f(B) (f(AB_i) - f(A))) / V,    total T_i = mean((f(A) - f(AB_i))^2) / (2 V),

V the variance of f(A) and f(B) together: Saltelli et al. (2010), Computer Physics Communications 181, 259, table 2,
estimators (b) and (f). They are those of scipy.stats.sobol_indices, which takes powers of two only and has no seed for
its intervals. The intervals here are percentiles of a bootstrap over the points (Efron and Tibshirani, 1993, ch. 13);
beyond 1024 points, over 1024 blocks of about equally many.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from cablestudy.errors import Mistake, SceneError
from cablestudy.scene.tolerances import SCENE
from cablestudy.study.prepare import columns_of
from cablestudy.study.table import Field, Table
from cablestudy.study.varied_keys import varied_keys
from cablestudy.sweeps.rows import varied_cells
from cablestudy.sweeps.tolerances import SWEEPS


@dataclass(frozen=True)
class Indices:
    """Sobol's indices of one column, each of shape (keys, 3): estimate, lower and upper end of its interval. [-]"""

    first: np.ndarray
    total: np.ndarray


def indices(f_a, f_b, f_ab, seed=0):
    """Sobol's indices S_i and T_i of one column, from its values f at the points of a Saltelli design.

    Parameters
    ----------
    f_a, f_b : array_like, shape (n,)
        f(A), f(B): values at the points of two independent samples A and B.
    f_ab : array_like, shape (keys, n)
        f(AB_i): values at the points of A with key i taken from B.
    seed : int
        Seed of the bootstrap for the intervals.

    Returns
    -------
    Indices or None
        S_i and T_i with intervals of `SWEEPS.confidence`; None if the values do not vary.
    """
    values = np.vstack([f_a, f_b, f_ab]).astype(float)
    scale = np.abs(values).max()
    if np.ptp(values) <= SWEEPS.rounding * scale:
        return None
    values = values / scale
    values -= values[:2].mean()  # avoids cancellation: no index depends on the mean
    a, b, ab = values[0], values[1], values[2:]
    # of a, b, a^2 + b^2, and of the numerators of S_i and T_i; the first row is over all points, others of resamples
    means = _bootstrap_means(np.vstack([a, b, a**2 + b**2, b * (ab - a), (a - ab) ** 2 / 2]), seed)
    variance = means[:, 2] / 2 - (means[:, 0] + means[:, 1]) ** 2 / 4
    if variance[0] <= 0:
        return None
    positive = variance > 0  # a resample of equal values has no indices
    samples = means[positive, 3:] / variance[positive, None]  # first orders, then totals, of each key
    samples[np.abs(samples) < SWEEPS.rounding] = 0.0
    interval = np.percentile(samples[1:], [50 * (1 - SWEEPS.confidence), 50 * (1 + SWEEPS.confidence)], axis=0)
    estimates = np.vstack([samples[:1], interval]).T
    return Indices(estimates[: len(ab)], estimates[len(ab) :])


def _bootstrap_means(terms, seed):
    """Means of terms over all points, then over each of r resamples: shape (j, n) -> (1 + r, j)."""
    points = terms.shape[1]
    blocks = min(points, SWEEPS.resampled_blocks)
    starts = np.arange(blocks) * points // blocks
    sums, sizes = np.add.reduceat(terms, starts, axis=1), np.diff(np.append(starts, points))
    times_drawn = _times_drawn(blocks, seed)
    return times_drawn @ sums.T / (times_drawn @ sizes)[:, None]


@lru_cache(maxsize=1)  # all columns of a table have the same points
def _times_drawn(blocks, seed):
    """How often each block is drawn: once for the estimate, then in each of r resamples, shape (1 + r, blocks)."""
    drawn = np.random.default_rng(seed).multinomial(blocks, np.full(blocks, 1 / blocks), SWEEPS.resamples)
    return np.vstack([np.ones(blocks), drawn])


class Sensitivity:
    """Sobol's indices of the columns of a study that has a `sample` of the method saltelli.

    Columns that have indices are those of numbers that depend on the scene alone: not the time that a row took.
    SceneError where the study has no such sample, or no such column.
    """

    def __init__(self, study):
        sample = study.sample
        if sample is None or sample.method != "saltelli":
            where = study.where(("sample",) if sample is None else ("sample", "method"))
            message = "--sensitivity needs a sample of the method saltelli, which gives count x (keys + 2) cases"
            raise SceneError(Mistake(where, "", message))
        if sample.count < SCENE.sensitivity_points:
            message = f"--sensitivity needs at least {SCENE.sensitivity_points} points, got {sample.count}"
            raise SceneError(Mistake(study.where(("sample", "count")), "", message))
        self.study = study
        self.columns = [
            column for column in columns_of(study, study.case(0)[1]) if column.needs != "run" and not column.text
        ]
        if not self.columns:
            where = study.where(("columns",))
            raise SceneError(Mistake(where, "", "--sensitivity: none of the columns depends on the scene alone"))

    def table(self, table):
        """Compute Sobol's indices of `columns` from the `Table` of all rows: a table, and notes, a list of str.

        They are computed separately for each setting, a combination of values of the keys that vary but are not
        sampled. The table has a row for each setting, each column, and each sampled key: first-order and total index
        with the ends of their intervals; cells without an index are empty. The notes are reasons why columns have no
        indices.
        """
        study, sample, frame = self.study, self.study.sample, table.rows.frame()
        cases = np.arange(study.count).reshape([len(entry) for entry in study.entries])
        # cases of the sample at each step of the other entries, shape (steps, count, pages); the pages are sample A,
        # sample A with one key of B, for each key, and sample B
        groups = np.moveaxis(cases, study.sample_entry, -1).reshape(-1, sample.count, sample.pages)
        unsampled = [varied for varied in varied_keys(study) if varied.key not in sample.over]
        rows, notes = [], []
        for group in groups:
            overrides = study.overrides(int(group[0, 0]))
            cells_of_group = varied_cells(unsampled, overrides)
            setting = ", ".join(f"{varied.key}={overrides[varied.key]}" for varied in unsampled)
            for column in self.columns:
                estimate, reason = self._estimate(frame[column.header].to_numpy()[group])
                if reason:
                    notes.append(f"{column.header}{f' ({setting})' if setting else ''}: no indices, {reason}")
                for i, key in enumerate(sample.over):
                    labels = {"column": column.header, "parameter": key}
                    rows.append({**cells_of_group, **labels, **_index_cells(estimate, i)})
        names = ["column", "parameter", *_index_cells(None, 0)]
        fields = [varied.field for varied in unsampled]
        fields += [Field(name, name.replace("_", " ")) for name in names]
        return Table(tuple(fields), rows), notes

    def _estimate(self, values):
        """Indices of one column in one group, and an empty text; or None and the reason why there are none.

        `values`, shape (count, pages): at the first sample, at it with each key in turn of the second, at the second.
        """
        empty = int(np.isnan(values).sum())
        if empty:
            return None, f"{empty} of {values.size} cases have no value"
        estimate = indices(values[:, 0], values[:, -1], values[:, 1:-1].T, self.study.sample.seed)
        return estimate, "" if estimate else "the column does not vary"


def _index_cells(estimate, key):
    """Header -> cell of the `Indices` of one sampled key, by its number; empty cells where `estimate` is None."""
    names = [f"{kind}{end}" for kind in ("first_order", "total") for end in ("", "_low", "_high")]
    if estimate is None:
        return dict.fromkeys(names)
    return dict(zip(names, map(float, (*estimate.first[key], *estimate.total[key])), strict=True))
