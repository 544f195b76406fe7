"""Numbers that bound the times, sizes and roundings of `sweeps`, each with its reason."""


class SweepsTolerances:
    """Bounds of sweeps: each is named by what it bounds."""

    __slots__ = ()  # nothing can be set on its object

    # --------------------------------------------------------------------------------------------- chunks

    # of the processor, that a chunk should take: its rows share what they have in common, such as an equilibrium; what
    # is not stored is lost where a run ends [s]
    chunk_time: float = 4.0
    chunk_cases: int = 5000  # in a chunk: bounds the memory that rows in flight take
    chunk_growth: float = 4  # of the size from one chunk to the next: the first cases may be the cheap ones
    # of the processor, for a chunk, compared with which a search for garbage takes little time [s]
    collected_time: float = 1.0

    # ------------------------------------------------------------------------------ processes and workers

    trial_time: float = 0.3  # of computing in this process, after which the time of the whole work is estimated [s]
    parallel_time: float = 3.0  # of work that is worth the start of other processes [s]
    processes_per_core: int = 4  # at most: more of them only take memory
    chunks_per_worker: int = 2  # in flight, so that none waits for the next
    worker_deaths: int = 3  # one after the other without a result between them, which end a run
    # without a result, after which the number of workers is asked for again: they may be lost with a scheduler [s]
    result_wait: float = 10.0
    scheduler_wait: float = 15  # until a scheduler must have answered [s]

    # ------------------------------------------------------------------------------------------- database

    lock_wait: float = 1.0  # for a lock of the database [s]
    lock_pause: float = 0.05  # longest, between two attempts to get it [s]
    cached_steps: int = 100_000  # of what varies, whose text in the CSV is kept: more than any grid has along one axis

    # ------------------------------------------------------------------------------------------- progress

    first_bar: float = 1.0  # before the first bar [s]
    bar_interval: float = 0.2  # between two bars [s]
    line_interval: float = 30.0  # between two lines [s]
    long_sweep: float = 60.0  # a sweep with more left has its first line early, once its estimate is fair: [s]
    early_line: float = 3.0  # after so long [s],
    early_rows: int = 20  # and so many rows
    bar_width: int = 24  # characters
    # between two reports, beyond what the rows took: then the workers only began, which comes once [s]
    workers_begin: float = 0.5
    rate_time: float = 1.0  # of computing that tells a rate [s]

    # ------------------------------------------------------------------------------------------- messages

    listed: int = 10  # failures, rows, columns or mistakes that a message names
    replayed_failures: int = 3  # whose command is given
    failure_kinds: int = 5  # kinds of failures that are counted each
    cell_characters: int = 200  # of a cell in a message
    condition_characters: int = 10_000  # of the condition of --where

    # ------------------------------------------------------------------------- comparison and sensitivity

    agreement: float = 1e-6  # of a stored number and the computed one, relative, where nothing else is given
    # of the values, a column that does not vary; of the variance, an index; of a printed value, a difference from it
    rounding: float = 1e-12
    resamples: int = 1000  # of a bootstrap: 25 of them beyond each end of an interval
    resampled_blocks: int = 1024  # of points, drawn as one: bounds the numbers of a bootstrap to about a million
    confidence: float = 0.95  # of an interval of Sobol's indices


SWEEPS = SweepsTolerances()
