"""Many searches in step: each asks for values one after the other, and what all of them wait for is computed at once.

A search is an ordinary function that calls `ask`. It runs in a thread of its own, which waits for each answer; the
answers are computed by the caller alone, when every search that has not ended waits for one.
"""

from functools import partial
from queue import SimpleQueue
from threading import Thread

NAME = "search"  # of the threads


class _EndedError(Exception):
    """The caller answers no more."""


def in_step(searches, answers_to):
    """Results of many searches, whose questions are answered together.

    Parameters
    ----------
    searches : sequence of callable
        Each takes a function `ask`: question -> answer, and returns a result.
    answers_to : callable
        Dict: number of a search -> its question; returns the answers in this order.

    Returns
    -------
    list
        Of each search its result, or the exception that it raised.
    """
    arrivals = SimpleQueue()  # (number of a search, whether it asks, its question or result)
    replies = [SimpleQueue() for _ in searches]
    threads = [
        Thread(
            target=_run, args=(search, partial(_ask, arrivals, reply, number), arrivals, number), name=NAME, daemon=True
        )
        for number, (search, reply) in enumerate(zip(searches, replies, strict=True))
    ]
    for thread in threads:
        thread.start()
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


def _ask(arrivals, reply, number, question):
    """The answer to a question of a search, which waits for it."""
    arrivals.put((number, True, question))
    answer = reply.get()
    if isinstance(answer, _EndedError):
        raise answer
    return answer


def _run(search, ask, arrivals, number):
    """Run one search to its end."""
    try:
        result = search(ask)
    except Exception as error:
        result = error
    arrivals.put((number, False, result))
