"""The command `cablestudy`, also as `python -m cablestudy`: Ctrl-C ends it with one line, while it is imported too."""

import atexit
import gc
import io
import os
import signal
import sys

INTERRUPTED = 130  # exit code, as for the commands
STANDARD_ERROR = 2  # its number
ALLOCATED = 5_000  # new objects that begin a search for garbage: modules make many and no garbage (the default is 700)


class _StandardError(io.FileIO):
    """Standard error that loses what it cannot take, on a full disk for example, so that no work ends by a line."""

    def write(self, data):
        """Write bytes; all of them count as written."""
        try:
            return super().write(data)
        except OSError:
            return len(data)


def _keep_standard_error():
    """Make lines that standard error cannot take harmless.

    Where it is closed, the null device takes its place, so that no other file is opened under its number.
    """
    if os.name != "posix":  # consoles of Windows are no files
        return
    if sys.stderr is None:
        os.dup2(os.open(os.devnull, os.O_WRONLY), STANDARD_ERROR)
    encoding = getattr(sys.stderr, "encoding", "utf-8")
    stream = io.BufferedWriter(_StandardError(STANDARD_ERROR, "w", closefd=False))
    sys.stderr = io.TextIOWrapper(stream, encoding, "backslashreplace", line_buffering=True)


def main():
    """Run the command line."""
    _keep_standard_error()
    by_default = signal.getsignal(signal.SIGINT) is signal.default_int_handler  # ignored in the background of a shell
    if by_default:
        signal.signal(signal.SIGINT, _end)
    gc.set_threshold(ALLOCATED)
    atexit.register(gc.freeze)  # else all that is left is searched for garbage once more when the program ends
    os.environ.setdefault("PYTHONSAFEPATH", "1")  # processes of a sweep would import a signal.py found here
    # pydantic would read the metadata of all packages to look for plugins
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    from cablestudy.cli import main as command

    try:
        if by_default:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        command(prog_name="cablestudy")
    except KeyboardInterrupt:
        _end()


def _end(*_):
    """End the process immediately: nothing has begun yet, or all is done."""
    _StandardError(STANDARD_ERROR, "w", closefd=False).write(b"interrupted\n")
    os._exit(INTERRUPTED)


if __name__ == "__main__":
    main()
