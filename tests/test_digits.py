"""The rows of stored studies have the digits that they have alone, together, in another order, and in shards."""

import pickle

import pytest
from campaign import campaign
from command import CONFIGS, ROOT

from cablestudy.scene.study import read_study
from cablestudy.statics import equilibria
from cablestudy.sweeps.chunks import Chunk, compute
from cablestudy.sweeps.fingerprint import versions

STUDIES = {path.stem: path for folder in (CONFIGS, CONFIGS / "suspensions") for path in sorted(folder.glob("*.yaml"))}
STORED = [path.stem for path in sorted((ROOT / "results").glob("*.csv")) if path.stem in STUDIES]
# a closed form, load cases, failures, elements, a cable and bodies that move, limits: one of each
SHORT = "preload", "guy-preload", "line-cases", "extremes-cases", "fast-focal", "zipline-travel"


@pytest.mark.parametrize("name", campaign(STORED, SHORT))
def test_rows_of_a_stored_study_do_not_depend_on_their_neighbours(name):
    """Cells, errors, status and keys, to the last bit: what a sweep writes into its database."""
    study = read_study(STUDIES[name])
    columns = tuple(column for column in study.columns if not column.startswith("solve_time"))

    def records(cases):
        """Case -> its record, of cases that one chunk computes without equilibria of chunks before it."""
        equilibria.forget()
        done = compute(Chunk(pickle.dumps(study), versions(), columns, tuple(cases)))
        return dict(zip(cases, done.records, strict=True))

    cases = list(range(study.count))
    together = records(cases)
    assert records(cases[::-1]) == together
    sharded = [records(cases[first::3]) for first in range(min(3, study.count))]
    assert {case: record for shard in sharded for case, record in shard.items()} == together
    alone = cases[:: max(1, study.count // 12)]
    assert {case: records([case])[case] for case in alone} == {case: together[case] for case in alone}
