"""Numbers of things and lists of names in messages."""


def counted(number, noun):
    """A number with its noun, for example `1 cable`, `6 cables`."""
    return f"{number} {noun}{'s' * (number != 1)}"


def first_of(names, most):
    """The first of some names, at most `most`, and the number of those left out: `a, b and 3 more`."""
    left_out = len(names) - most
    return ", ".join(names[:most]) + (f" and {left_out} more" if left_out > 0 else "")
