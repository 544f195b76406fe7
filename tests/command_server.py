"""The command `cablestudy` without its start: an interpreter that has imported everything forks a process for each.

For tests of what commands print, in shells too. How a command starts is tested where it is begun as users begin it.
Pictures are composed, but not drawn: test_pictures.py and test_plots.py draw each kind, test_pages.py those of pages.
"""

import gc
import marshal
import math
import os
import pkgutil
import socket
import subprocess
import sys
import tempfile
from contextlib import chdir, contextmanager, redirect_stdout
from importlib import import_module
from pathlib import Path

from found_once import lengths_found_once, rows_found_once
from picture import undrawn

ROOT = Path(__file__).parent.parent
FIRST = (  # so that no fork does again what is done once: validators of pydantic, imports, fonts, lengths of cables
    *(("static", f"{name}.yaml") for name in ("carlina", "slack", "carlina-inclined", "zipline")),
    ("static", "line.yaml", "--case", "all"),
    ("static", "guy.yaml", "--case", "all", "--plot", "guy.svg"),
    ("modes", "suspensions/fast.yaml"),
    ("windrms", "carlina.yaml"),
    ("sweep", "preload.yaml", "--no-write"),
)
USED_LATER = ("matplotlib.backends.backend_svg", "pandas", "scipy.optimize", "scipy.sparse.linalg", "scipy.stats")
LONGEST = 1 << 20  # bytes of a command line with its environment
# Hands over its arguments and its standard streams, and ends as the command does. Its imports are compiled into python:
# `site`, `json` and `socket` take longer than all the rest.
CLIENT = """#!{python} -IS
import marshal, os, sys, _socket
server = _socket.socket(_socket.AF_UNIX)
server.connect({address!r})
request = marshal.dumps([sys.argv[1:], os.getcwd(), dict(os.environ)])
streams = b"".join(stream.to_bytes(4, sys.byteorder) for stream in (0, 1, 2))
sent = server.sendmsg([request], [(_socket.SOL_SOCKET, _socket.SCM_RIGHTS, streams)])
server.sendall(request[sent:])
server.shutdown(_socket.SHUT_WR)
for stream in (0, 1, 2):
    os.close(stream)
os._exit(int(server.recv(8) or b"70"))
"""


@contextmanager
def served(rows):
    """A folder for PATH, in which `cablestudy` is a command that a server runs.

    `rows` is a folder, of several servers perhaps, that keeps rows of sweeps: none is computed twice.
    """
    with tempfile.TemporaryDirectory(prefix="cablestudy-commands-") as folder:
        program, address = Path(folder, "bin", "cablestudy"), str(Path(folder, "socket"))
        program.parent.mkdir()
        program.write_text(CLIENT.format(python=sys.executable, address=address), encoding="utf-8")
        program.chmod(0o755)
        with subprocess.Popen([sys.executable, __file__, address, str(rows)], stdout=subprocess.PIPE) as server:
            server.stdout.readline()  # it listens
            yield program.parent
            server.terminate()


def listen(address, rows):
    """Import the program and run each of FIRST, then each command that comes in a process of its own."""
    import cablestudy

    for module in pkgutil.walk_packages(cablestudy.__path__, "cablestudy."):
        if module.name != "cablestudy.__main__":
            import_module(module.name)
    for name in USED_LATER:
        import_module(name)
    cablestudy.scene.units.to_si("1 inch", "m")  # reads the units of pint
    sweeps = type(cablestudy.sweeps.tolerances.SWEEPS)
    sweeps.parallel_time = math.inf  # the other cores have tests to run: no sweep starts processes
    sweeps.chunk_time = sweeps.chunk_growth = math.inf  # nor divides its rows by time
    tolerances = type(cablestudy.study.tolerances.STUDY)
    tolerances.timing_budget = tolerances.brief_run = 0.0  # no example shows a time, which would be another each time
    with undrawn(), lengths_found_once(), rows_found_once(Path(rows)):  # as long as the server runs
        _run_first()
        gc.collect()
        gc.disable()  # a collection in a fork would copy much of it, and no command is long enough to need one
        _serve(address)


def _run_first():
    """Run each of FIRST without its output."""
    from cablestudy.cli import main

    with tempfile.TemporaryDirectory() as folder, chdir(folder), open(os.devnull, "w") as sink, redirect_stdout(sink):
        for command, file, *options in FIRST:
            main([command, str(ROOT / "configs" / file), *options, "--quiet"], standalone_mode=False)


def _serve(address):
    """Run each command that comes in a process of its own."""
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(address)
        server.listen(100)
        os.write(1, b"listening\n")
        while True:
            client, _ = server.accept()
            with client:
                request, streams, _, _ = socket.recv_fds(client, LONGEST, 3)
                while part := client.recv(LONGEST):
                    request += part
                if os.fork() == 0:
                    server.close()
                    _handle(client, streams, *marshal.loads(request))
            for stream in streams:
                os.close(stream)
            _reap()


def _reap():
    """Take leave of the processes that have ended."""
    try:
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass
    except ChildProcessError:
        pass


def _handle(client, streams, arguments, folder, environment):
    """In a process of its own: run a command, tell the client its exit code, and end."""
    for place, stream in enumerate(streams):
        os.dup2(stream, place)
        os.close(stream)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)
    sys.argv = ["cablestudy", *arguments]
    sys.stdin = open(0, encoding="utf-8", closefd=False)  # noqa: SIM115
    sys.stdout = open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
    sys.stderr = open(2, "w", buffering=1, encoding="utf-8", errors="backslashreplace", closefd=False)  # noqa: SIM115
    code = _run()
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            code = code or 120  # as at the end of an interpreter
    for place in range(3):  # who reads them waits for no more
        os.close(place)
    client.sendall(str(code).encode())
    os._exit(code)


def _run():
    """Run the command of `sys.argv`: its exit code."""
    from cablestudy.__main__ import main

    try:
        main()
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:
        sys.excepthook(*sys.exc_info())
        return 1
    return 0


if __name__ == "__main__":
    listen(*sys.argv[1:])
