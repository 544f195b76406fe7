"""Numbers that bound the sizes of `pages`, each with its reason."""


class PagesTolerances:
    """Sizes of pages of HTML: each is named by what it bounds."""

    __slots__ = ()  # nothing can be set on its object

    # ------------------------------------------------------------------------------------------- pictures

    drawn_points: int = 100_000  # of the lines of a picture as SVG: one of more, a few megabytes, is drawn as pixels
    picture_resolution: int = 200  # of a picture that is drawn as pixels [1/in]

    # --------------------------------------------------------------------------------------------- tables

    table_rows: int = 100  # of a table that is whole; a longer one is cut,
    end_rows: int = 25  # to so many rows at each end
    table_columns: int = 12  # that fit a page; a wider table is split
    turned_columns: int = 8  # a table of more columns has a line for each of them, not for each row,
    turned_rows: int = 6  # if it has at most so many rows, which stand side by side then
    unbroken_rows: int = 20  # of a table that print does not break
    unbroken_characters: int = 24  # of texts of a column that are not broken into lines, such as out-of-plane

    # ---------------------------------------------------------------------------------------------- texts

    reason_characters: int = 1000  # of a reason or a note, which is one line
    note_kinds: int = 20  # kinds of notes on rows that are listed
    file_lines: int = 200  # of a resolved file that are shown
    varied_values: int = 8  # values of what varies that are listed


PAGES = PagesTolerances()
