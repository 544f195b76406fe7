"""What a first-time user meets: rows with their names, and messages that say what to write instead."""

import pytest
from command import CONFIGS, rows_of, run

GUY = CONFIGS / "guy.yaml"
CASES = ["everyday", "cold", "hot", "ice", "storm", "ice-and-wind"]


@pytest.mark.parametrize("style", ["csv", "json", "jsonl"])
def test_chosen_columns_keep_what_names_the_rows(style):
    def names(*arguments):
        return [list(row.items())[0] for row in rows_of(run(*arguments, "--format", style).out, style)]

    assert names("static", GUY, "--case", "all", "--columns", "sag") == [("case", case) for case in CASES]
    modes = names("modes", GUY, "--case", "all", "-n", 2, "--columns", "frequency")
    assert modes == [("case", case) for case in CASES for _ in range(2)]
    net = "static", CONFIGS / "suspensions" / "cable-robot.yaml", "--table", "bodies"
    assert names(*net, "--columns", "x") == [("name", "platform")]
    assert list(rows_of(run(*net, "--columns", "x,name", "--format", style).out, style)[0]) == ["x_m", "name"]


def test_markdown_of_chosen_columns_names_the_cases():
    heading = run("static", GUY, "--case", "all", "--columns", "sag", "--quiet").out.splitlines()[0]
    assert [word.strip() for word in heading.strip("|").split("|")] == ["quantity", *CASES, "unit"]
