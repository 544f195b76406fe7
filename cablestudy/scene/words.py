"""Numbers of things and lists of names in messages."""


def counted(number, noun):
    """For example `1 cable`, `6 cables`."""
    return f"{number} {noun}{'s' * (number != 1)}"


def first_of(names, most):
    """The first of some names, at most so many, and how many more there are: `a, b and 3 more`."""
    more = len(names) - most
    return ", ".join(names[:most]) + (f" and {more} more" if more > 0 else "")
