"""The loop of a sweep: chunks are computed by whoever works, their rows go to the journal as they come."""

from contextlib import closing

from cablestudy.sweep.interrupt import Interrupts
from cablestudy.sweep.parallel import local
from cablestudy.sweep.supply import Supply


def fill(study, columns, cases, journal, workers=local, tell=None, fail_fast=False, explain=False):
    """Compute the cases that a journal lacks.

    Parameters
    ----------
    study : Study
    columns : list of Column
    cases : range
        From 0.
    journal : Journal
    workers : callable
        Supply -> iterator of Done, in any order: `parallel.local`, `cluster.scheduled`.
    tell : callable, optional
        Is told after each chunk how many cases are done.
    fail_fast : bool
        Stop after the first chunk with a case that has no answer.
    explain : bool
        Keep the notes.

    Raises
    ------
    KeyboardInterrupt
        Ctrl-C or SIGTERM; what is done is in the journal.
    """
    known = sum(case in journal for case in cases)
    kinds = [(journal.missing(cases), [column.header for column in columns])]
    if journal.parts:
        there = journal.part_columns()
        kinds.append((journal.incomplete(cases), [c.header for c in columns if c.header not in there]))
    supply = Supply(study, kinds, len(cases) - known, explain)
    with Interrupts() as interrupts, closing(workers(supply)) as results:
        failed = journal.failed
        for done in results:
            with interrupts.sheltered():
                journal.append(done.lines)
            known += done.count
            if tell:
                tell(known)
            if fail_fast and journal.failed > failed:
                return
