"""Rows of a study that states a goal (`find`): in each case its key is solved for first, by searches in step.

Each search asks for values one after the other, and what all of them wait for is computed at once. A search is an
ordinary function that calls `ask`. It runs in a thread of its own, which waits for each answer; the answers are
computed by the caller alone, when every search that has not ended waits for one.
"""

from functools import partial
from queue import SimpleQueue
from threading import Thread

import numpy as np

from cablestudy.errors import CablestudyError, NoSolutionError
from cablestudy.scene.words import counted, first_of
from cablestudy.study.case_table import CaseTable
from cablestudy.study.find import KeyValues, column_values, solve
from cablestudy.study.goal import goal_of_study
from cablestudy.study.scene_kind import kind_of
from cablestudy.study.study_rows import evaluate_tables
from cablestudy.study.table_rows import batched
from cablestudy.study.tolerances import STUDY

NAME = "search"  # of the threads of searches in step


def evaluate_found(study, tables, columns, explain=False, estimate=False):
    """Compute the columns of a study that states a goal: in each case the key of the goal is solved for first.

    Parameters
    ----------
    study : Study
        With a goal (`find`): a column, its value, and the key that is solved for.
    tables : list of CaseTable
        The cases of the study.
    columns : sequence of Column
        One of them may be the key.
    explain, estimate : bool
        Whether to return notes, and to estimate errors in any case, see `study_rows.evaluate_tables`.

    Returns
    -------
    dict
        Number of a case of the study -> (numbers, status, errors, notes), as from `study_rows.evaluate_tables`. The
        numbers of a case without exactly one solution are None, and its status is the reason.
    """
    goal = goal_of_study(study)
    others = [column for column in columns if column.needs != "find"]
    index_of_key = next((k for k, column in enumerate(columns) if column.needs == "find"), None)
    empty = [None] * sum(column.name != "status" for column in columns)
    key_values, solved, rows = {}, [], {}  # case -> value of the key; its table; (numbers, status, errors, notes)
    cases = [case for table in tables for case in table.cases.tolist()]
    for case, solution in zip(cases, _solutions(study, goal, tables, cases), strict=True):
        if isinstance(solution, CablestudyError):
            rows[case] = empty, solution.without_places, {}, ()
        else:
            key_values[case], scene = solution
            solved.append(CaseTable(np.array([case]), scene, {}))
    evaluated = evaluate_tables(solved, others, explain, estimate)
    for case, (numbers, status, errors, notes) in evaluated.items():
        if index_of_key is not None:
            numbers = [*numbers[:index_of_key], key_values[case], *numbers[index_of_key:]]
        rows[case] = numbers, status, errors, notes
    return rows


def _solutions(study, goal, tables, cases):
    """Value of the key and scene of each case, or the CablestudyError that says why there is none: list.

    Searches of a column that costs little go in step: the values that all of them try next are one table of cases.
    """
    searches = [partial(_only_solution, study, goal, case) for case in cases]
    if not tables or not kind_of(tables[0].scene).is_cheap(goal.column):
        return [_outcome(search) for search in searches]
    solutions = []
    for batch in batched(range(len(cases)), STUDY.rows_at_once):
        values_of = partial(_values_in_cases, study, goal, [cases[index] for index in batch])
        solutions += in_step([searches[index] for index in batch], values_of)
    for solution in solutions:
        if isinstance(solution, Exception) and not isinstance(solution, CablestudyError):
            raise solution
    return solutions


def _outcome(search):
    """The result of a search by itself, or its CablestudyError."""
    try:
        return search(None)
    except CablestudyError as error:
        return error


def _only_solution(study, goal, case, column_at):
    """The only value of the key of a case, and its scene; NoSolutionError where there are several.

    `column_at` is as for `find.solve`.
    """
    solutions = solve(goal, study.document_of(case), column_at)
    count = len(solutions.values)
    if count > 1:
        listed = first_of(list(map(goal.of_key, solutions.values)), STUDY.shown_values)
        values = f"{counted(count, 'value')} of {goal.key.name}"
        raise NoSolutionError(f"{goal}: {values}: {listed} (find.between chooses one)")
    return solutions.values[0], solutions.scenes[0]


def _values_in_cases(study, goal, cases, values_of_searches):
    """Compute the column of the goal for many searches at once, each in its own case and at its own values of the key.

    `cases` has the number of the case of each search, `values_of_searches` the values that it tries now: number of the
    search -> shape (k,). Returns for each of these numbers in the column, NaN where there is none, and status texts.
    """
    counts = [len(values) for values in values_of_searches.values()]
    key_values = KeyValues(study.document_of, goal, np.concatenate(list(values_of_searches.values())), study.entries)
    steps = np.arange(len(key_values.values))  # a case of `key_values`: that of the study, and the step of its key
    case_of_step = np.repeat([cases[number] for number in values_of_searches], counts)
    numbers, statuses = column_values(goal, key_values, case_of_step * len(steps) + steps)
    ends = np.cumsum(counts).tolist()
    parts = [slice(end - count, end) for count, end in zip(counts, ends, strict=True)]
    return [(numbers[part], statuses[part]) for part in parts]


# ------------------------------------------------------------------------------------------------ many searches in step


class _EndedError(Exception):
    """The caller answers no more."""


def in_step(searches, answers_to):
    """Run many searches side by side, so that the questions that they ask at one time are answered by one call.

    Each search runs in a thread of its own. It waits until all searches have asked a question or have ended.

    Parameters
    ----------
    searches : sequence of callable
        Each takes a function `ask` (question -> answer), and returns a result.
    answers_to : callable
        Dict of number of a search -> its question; returns the answers in the order of the dict.

    Returns
    -------
    list
        Of each search its result, or the exception that it raised.
    """
    arrivals = SimpleQueue()  # (number of a search, whether it asks, its question or result)
    replies = [SimpleQueue() for _ in searches]

    def run(number, search):
        def ask(question):
            arrivals.put((number, True, question))
            answer = replies[number].get()
            if isinstance(answer, _EndedError):
                raise answer
            return answer

        try:
            result = search(ask)
        except Exception as error:
            result = error
        arrivals.put((number, False, result))

    for number, search in enumerate(searches):
        Thread(target=run, args=(number, search), name=NAME, daemon=True).start()
    results, running = [None] * len(searches), set(range(len(searches)))
    try:
        while running:
            questions = {}
            for _ in range(len(running)):
                number, asks, content = arrivals.get()
                if asks:
                    questions[number] = content
                else:
                    results[number] = content
            running = set(questions)
            questions = dict(sorted(questions.items()))
            for number, answer in zip(questions, answers_to(questions) if questions else (), strict=True):
                replies[number].put(answer)
    finally:
        for number in running:  # where the computation of answers has failed
            replies[number].put(_EndedError())
    return results
