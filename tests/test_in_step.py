"""Searches in step: each gets the answers that it gets alone, and all questions of a round are answered at once."""

import threading

import pytest
from command import LONGEST

from cablestudy.study.find_rows import NAME, in_step


def halvings(low, high):
    """Search for the square root of 2 by halving an interval."""

    def search(ask):
        ends = low, high
        while ends[1] - ends[0] > 1e-12:
            middle = sum(ends) / 2
            ends = (ends[0], middle) if ask(middle) > 0 else (middle, ends[1])
        return ends

    return search


def square_less_two(questions):
    return [x * x - 2 for x in questions.values()]


def test_each_search_ends_as_it_does_alone():
    searches = [halvings(0.0, 2.0), halvings(1.0, 1.5), halvings(-1.0, 100.0)]
    rounds = []

    def answers_to(questions):
        rounds.append(list(questions))
        return square_less_two(questions)

    found = in_step(searches, answers_to)
    assert found == [search(lambda x: x * x - 2) for search in searches]
    assert rounds[0] == [0, 1, 2]  # in the order of the searches
    assert rounds[-1] == [2]  # of the widest interval, when the others have ended
    assert len(rounds) < 60


def test_searches_without_questions():
    assert in_step([], square_less_two) == []
    assert in_step([lambda ask: 5], square_less_two) == [5]


def test_a_search_that_fails_leaves_the_others():
    def fails(ask):
        ask(1.0)
        raise ValueError("no")

    failed, found = in_step([fails, halvings(0.0, 2.0)], square_less_two)
    assert isinstance(failed, ValueError)
    assert found[0] == pytest.approx(2**0.5, rel=1e-11)


def test_no_search_waits_where_its_answers_cannot_be_computed():
    with pytest.raises(KeyboardInterrupt):
        in_step([halvings(0.0, 2.0)] * 3, lambda questions: (_ for _ in ()).throw(KeyboardInterrupt))
    for thread in threading.enumerate():
        if thread.name == NAME:
            thread.join(timeout=LONGEST)
            assert not thread.is_alive()
