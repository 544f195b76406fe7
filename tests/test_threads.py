"""Linear algebra takes one thread while the Python interface computes, and as many as before afterwards."""

from functools import wraps

import pytest
from command import CONFIGS
from threadpoolctl import ThreadpoolController, threadpool_info

import cablestudy
from cablestudy.interface.scene import Scene
from cablestudy.threads import VARIABLES, keep_one_thread, one_thread


def threads():
    """Numbers of threads of the libraries for linear algebra: set of int."""
    return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}


@pytest.fixture
def two_threads(monkeypatch):
    """No variable names a number of threads, and linear algebra takes two."""
    import scipy.linalg  # noqa: F401 loads the library of scipy

    for name in VARIABLES:
        monkeypatch.delenv(name, raising=False)
    with ThreadpoolController().limit(limits=2, user_api="blas"):
        assert threads() == {2}
        yield


def test_a_call_takes_one_thread_and_gives_the_others_back(two_threads, monkeypatch):
    found, static = [], Scene.answers["static"]

    @wraps(static)
    def observed(*args, **options):
        found.append(threads())
        return static(*args, **options)

    monkeypatch.setattr(Scene, "answers", {**Scene.answers, "static": observed})
    cablestudy.load(CONFIGS / "guy.yaml").static()
    assert found == [{1}]
    assert threads() == {2}


def test_an_error_gives_the_threads_back(two_threads):
    with pytest.raises(cablestudy.SceneError):
        cablestudy.find(CONFIGS / "guy.yaml", "sag = 2 m", "no.key")
    assert threads() == {2}


def test_blocks_of_two_threads_that_overlap_give_the_threads_back_together(two_threads):
    first, second = one_thread(), one_thread()
    first.__enter__()
    second.__enter__()
    first.__exit__(None, None, None)
    assert threads() == {1}
    second.__exit__(None, None, None)
    assert threads() == {2}


def test_a_worker_keeps_one_thread(two_threads):
    keep_one_thread()
    assert threads() == {1}


def test_a_number_that_the_user_has_chosen_stays(two_threads, monkeypatch):
    monkeypatch.setenv(VARIABLES[0], "2")
    keep_one_thread()
    with one_thread():
        assert threads() == {2}
