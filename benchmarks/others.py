"""Section of docs/benchmarks.md: a thousand cables, ours beside OpenSeesPy and MoorPy."""

import gc

from cables import cables as all_cables
from cables import continuous, exact, median, scene_of, seconds, study_of, verdict
from peers import BARS, NoAnswerError, found

REPEATED = 4  # how often ours solves each cable in a round: a sweep's chunk of static rows has some thousand
ROUNDS = 5  # the other programs solve every cable once in all, ours every cable in every round, as a sweep's chunk
WRONG = 1e-2  # relative error of the mean tension beyond which an answer counts as wrong: bars explain a tenth of it
MODES = 10
ACCURACY = 1e-6
PREFIX = {"in": "inplane", "out": "outofplane"}


def columns(*names):
    """Columns by name."""
    from cablestudy.study.columns import find

    return [find(name) for name in names]


def relative(value, truth):
    """Relative error."""
    return abs(value - truth) / abs(truth)


def statics(cables, peers):
    """Lines: static columns."""
    from cablestudy.study.case_table import tables_of
    from cablestudy.study.study_rows import evaluate_tables
    from cablestudy.study.table_rows import has_answer

    names = "horizontal_tension", "max_tension", "preload", "sag", "end_stiffness"
    wanted, study = columns(*names), study_of(cables * REPEATED, ACCURACY, names)
    truth = [exact(cable) for cable in cables]

    def own_rows():
        """Rows of the study, as a sweep computes those of a chunk: number of a row -> numbers, status and errors."""
        return evaluate_tables(tables_of(study, range(study.count))[0], wanted)

    rows = list(own_rows().values())[: len(cables)]
    errors = [
        max(map(relative, numbers, values))
        for (numbers, status, *_), values in zip(rows, truth, strict=True)
        if has_answer(status)
    ]
    answers = {peer.name: [] for peer in peers}

    def solve(peer, part):
        for index in part:
            try:
                answers[peer.name].append((index, peer.static(cables[index])))
            except NoAnswerError:
                answers[peer.name].append((index, None))

    own, theirs = [], {peer.name: [] for peer in peers}
    for turn in range(ROUNDS):
        own.append(study.count / seconds(own_rows))
        part = range(turn, len(cables), ROUNDS)
        for peer in peers:
            theirs[peer.name].append(len(part) / seconds(lambda peer=peer, part=part: solve(peer, part)))
    yield "| program | cables/s | ours over it | median error | largest error | said no | wrong |"
    yield "|---|---:|---:|---:|---:|---:|---:|"
    failed, wrong = len(rows) - len(errors), sum(error > WRONG for error in errors)
    yield f"| cablestudy | {median(own):.0f} | | {median(errors):.1e} | {max(errors):.1e} | {failed} | {wrong} |"
    ratios = []
    for peer in peers:
        rates = theirs[peer.name]
        ratios.append(median([mine / other for mine, other in zip(own, rates, strict=True)]))
        tension = 2 if peer.name == "OpenSeesPy" else 0  # the mean of the bars; MoorPy gives the horizontal one
        known = [(relative(a[1 - tension // 2], truth[i][tension]), a[1]) for i, a in answers[peer.name] if a]
        good = [error for error, least in known if error <= WRONG and least > 0]
        no = len(answers[peer.name]) - len(known)
        yield (
            f"| {peer.name} {peer.version} | {median(rates):.0f} | {ratios[-1]:.0f} | {median(good):.1e} |"
            f" {max(good):.1e} | {no} | {len(known) - len(good)} |"
        )
    yield ""
    aim = f"100000 cables/s: {verdict(median(own) >= 1e5)}; error below 1e-10: {verdict(max(errors) < 1e-10)}"
    if ratios:
        aim += f"; at least 30 times each of the others: {verdict(min(ratios) >= 30)}"
    yield f"Aim: {aim}."


def motion(cables, peers):
    """Lines: statics and ten modes."""
    from cablestudy.study.one_cable.rows import evaluate_cases

    half = MODES // 2
    names = [f"{PREFIX[plane]}_frequency_{k}" for plane in PREFIX for k in range(1, half + 1)]
    wanted = columns("preload", "sag", "end_stiffness", *names)
    scenes = [scene_of(cable, ACCURACY) for cable in cables]
    truth = [{plane: continuous(cable, MODES, plane) for plane in PREFIX} for cable in cables]
    opensees = next((peer for peer in peers if peer.name == "OpenSeesPy"), None)
    own, theirs, errors, answers = [], [], [], []

    def solve(part):
        for index in part:
            try:
                answers.append((index, opensees.modes(cables[index], MODES)))
            except NoAnswerError:
                answers.append((index, None))

    rows = evaluate_cases(scenes, wanted)
    for turn in range(ROUNDS):
        own.append(len(scenes) / seconds(lambda: evaluate_cases(scenes, wanted)))
        if opensees:
            part = range(turn, len(cables), ROUNDS)
            theirs.append(len(part) / seconds(lambda part=part: solve(part)))
    headers, failed = [column.header for column in wanted[3:]], sum(row.failed for row in rows)
    for row, known in zip(rows, truth, strict=True):
        values = [*known["in"][:half], *known["out"][:half]]
        if not row.failed:
            errors.append(max(relative(row.cells[h], value) for h, value in zip(headers, values, strict=True)))
    yield "| program | cables/s | ours over it | median error | largest error | said no | wrong |"
    yield "|---|---:|---:|---:|---:|---:|---:|"
    yield (
        f"| cablestudy, accuracy {ACCURACY:g} | {median(own):.0f} | | {median(errors):.1e} | {max(errors):.1e} |"
        f" {failed} | {sum(error > 10 * WRONG for error in errors)} |"
    )
    aim = f"error below {ACCURACY:g}: {verdict(max(errors) < ACCURACY)}"
    if opensees:
        ratio = median([mine / other for mine, other in zip(own, theirs, strict=True)])
        known = [
            max(
                relative(f, value)
                for f, value in zip(answer, sorted([*truth[i]["in"], *truth[i]["out"]]), strict=False)
            )
            for i, answer in answers
            if answer
        ]
        good = [error for error in known if error <= 10 * WRONG]
        yield (
            f"| OpenSeesPy, {BARS} bars | {median(theirs):.0f} | {ratio:.2f} | {median(good):.1e} | {max(good):.1e} |"
            f" {len(answers) - len(known)} | {len(known) - len(good)} |"
        )
        aim += f"; at least 5 times OpenSeesPy: {verdict(ratio >= 5)}"
    yield ""
    yield f"Aim: {aim}."


def section():
    """Lines of the section."""
    cables, (peers, missing) = list(all_cables()), found()
    gc.freeze()  # as a sweep does: of modules that stay no program's time is taken
    yield (
        f"{len(cables)} cables of the paper's section over a chord of 185.8 m, from 0.4 % slack to 1 % taut and from "
        f"horizontal to 60 degrees, a lattice in both. All in one process on one thread, in {ROUNDS} rounds one after "
        "the other; rates and ratios are medians over the rounds, by CPU time."
    )
    yield ""
    yield from (f"* {peer.name} {peer.version}: {peer.setup}." for peer in peers)
    yield from (f"* {line}" for line in missing)
    yield (
        f"* cablestudy, statics: rows of a study of {REPEATED * len(cables)} cases in one call, from the numbers that "
        "vary to those of the table, as a sweep computes them (`tables_of` and `evaluate_tables`), without its store; "
        f"with modes: `evaluate_cases` of `study/one_cable/rows.py` on {len(cables)} scenes that are read already. "
        "Modules are frozen for the garbage collector, as a sweep does."
    )
    yield ""
    yield (
        "Errors of tension and sag are against 50 digits (the tests' own solver), those of frequencies against the "
        "continuous cable (integral equations, likewise), for every cable. *Said no*: no convergence, and it says so. "
        f"*Wrong*: it reports success with a bar in compression, or with a tension wrong by more than {WRONG:.0%}, or "
        f"a frequency by more than {10 * WRONG:.0%}; the columns of errors leave these out. The error of a chain of "
        "bars is mostly that of its bars, not of the program."
    )
    yield ""
    yield "### Statics"
    yield ""
    yield (
        "Ours: horizontal, largest and mean tension, sag and end stiffness (error: the largest of the first four). "
        "OpenSeesPy: the mean tension of its bars. MoorPy: the horizontal tension."
    )
    yield ""
    yield from statics(cables, peers)
    yield ""
    yield f"### Statics and {MODES} modes"
    yield ""
    yield (
        f"Ours: mean tension, sag, end stiffness, {MODES // 2} frequencies in the plane and {MODES // 2} out of it. "
        f"OpenSeesPy: the {MODES} lowest. Error: the largest of the frequencies. MoorPy has no modes of a cable."
    )
    yield ""
    yield from motion(cables, peers)
