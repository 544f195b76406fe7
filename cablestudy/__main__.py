"""The command `cablestudy`, also as `python -m cablestudy`: Ctrl-C ends it with one line, while it is imported too."""

import atexit
import gc
import os
import signal

INTERRUPTED = 130  # exit code, as of the commands
ALLOCATED = 5_000  # new objects that begin a search for garbage: modules make many and no garbage (the default is 700)


def main():
    """Run the command line."""
    by_default = signal.getsignal(signal.SIGINT) is signal.default_int_handler  # ignored in the background of a shell
    if by_default:
        signal.signal(signal.SIGINT, _end)
    gc.set_threshold(ALLOCATED)
    atexit.register(gc.freeze)  # else all that is left is searched for garbage once more when the program ends
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
    """End the process at once: nothing has begun yet, or all is done."""
    os.write(2, b"interrupted\n")
    os._exit(INTERRUPTED)


if __name__ == "__main__":
    main()
