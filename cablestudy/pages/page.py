"""A page while it is made: its sections, pictures, what has no answer, warnings, and how the numbers were modelled.

Pictures are SVG within the page: several share no name, and none loads anything.
"""

import re
from base64 import b64encode
from contextlib import contextmanager
from html import escape

from cablestudy.errors import CablestudyError, NothingToDrawError, SceneError, one_line
from cablestudy.pages.markup import document, element, listed, paragraph, picture, text, unit_text
from cablestudy.pages.tables import error_text, table_html
from cablestudy.pages.tolerances import PAGES
from cablestudy.plots.style import rendered
from cablestudy.study.table import short

BEFORE = re.compile(r"\A.*?(?=<svg )", re.DOTALL)  # the declarations of a file of its own
LEFT_OUT = re.compile(r"<metadata>.*?</metadata>|<!--.*?-->|<style.*?</style>|<title>.*?</title>", re.DOTALL)
SIZE = re.compile(r'\A<svg [^>]*?width="([\d.]+)pt"[^>]*?viewBox="([^"]+)"[^>]*>', re.DOTALL)
PATH = re.compile(r' d="[^"]*"')
DIGITS = re.compile(r"(\.\d\d)\d+")  # beyond hundredths of a point
NAMES = re.compile(r'(\bid="|url\(#|href="#)')
MESSAGE = re.compile(r"(cases? [^:]*: )?(?:(note|warning): )?(.*)", re.DOTALL)  # load cases, kind, and text


def inline_picture(figure, prefix, label):
    """A matplotlib figure as an element of HTML: `svg`, or `img` where that would be very large.

    The `prefix` makes all names in it differ from those of other pictures of the page. The `label` says what it shows,
    for readers who do not see it.
    """
    if _points(figure) > PAGES.drawn_points:
        data, width = rendered(figure, "png", PAGES.picture_resolution), f"{96 * figure.get_figwidth():.0f}"
        return f'<img src="data:image/png;base64,{b64encode(data).decode()}" width="{width}" alt="{escape(label)}">'
    written = LEFT_OUT.sub("", BEFORE.sub("", rendered(figure, "svg", PAGES.picture_resolution).decode()))
    written = PATH.sub(lambda match: DIGITS.sub(r"\1", match[0]), NAMES.sub(rf"\g<1>{prefix}-", written))
    width, box = SIZE.match(written).groups()
    begin = f'<svg viewBox="{box}" width="{float(width):.0f}pt" role="img" aria-label="{escape(label)}">'
    return begin + re.sub(r"\n\s*", " ", SIZE.sub("", written)).strip()


def _points(figure):
    """Number of points of all lines in a figure."""
    total = 0
    for artist in figure.findobj():
        if hasattr(artist, "get_xydata"):
            total += len(artist.get_xydata())
        elif hasattr(artist, "get_paths"):
            total += sum(len(path.vertices) for path in artist.get_paths())
    return total


def short_line(error):
    """The message of an error in one line of at most `PAGES.reason_characters`."""
    return one_line(error)[: PAGES.reason_characters]


class Page:
    """Sections in their order; the reason stands in place of what cannot be computed, and the rest goes on."""

    def __init__(self, title, subtitle, columns=()):
        self.title, self.subtitle = title, subtitle
        self._columns, self._columns_found = columns, set()  # of the tables of results; none for all
        self.warnings = []
        self.notes = {}  # heading -> lines: what was modelled, what was left out, and the errors
        self.left_out = []  # sections that the file has nothing for
        self._failed = {}  # reason -> what has no answer for it
        self._parts, self._contents, self._figures, self._pictures = [], [], [], 0

    def add(self, html):
        """Append HTML to the section that was begun last."""
        self._parts.append(html)

    def heading(self, title, level=2):
        """Begin a section, of level 2, or a part of one, of level 3."""
        attributes = {}
        if level == 2:
            attributes["id"] = f"section-{len(self._contents) + 1}"
            self._contents.append((attributes["id"], title))
        self.add(element(f"h{level}", text(title), **attributes) + "\n")

    @contextmanager
    def section(self, title):
        """Context manager of a section: an error inside ends the section and not the page, which tells it in a line."""
        self.heading(title)
        with self.part(title):
            yield

    @contextmanager
    def part(self, what):
        """Context manager of a section without a heading, see `section`; `what` names it in the list of failures."""
        try:
            yield
        except (SceneError, NothingToDrawError) as error:
            self.add(paragraph(f"Left out: {short_line(error)}", class_="reason"))
            self.left_out.append(f"{what.lower()}: {short_line(error)}")
        except CablestudyError as error:
            self.fail(what, short_line(error))

    def fail(self, what, *reasons):
        """Tell that something has no answer, and why, if there are reasons."""
        for reason in reasons:
            self.add(paragraph(f"No answer: {'as above' if reason in self._failed else reason}", class_="reason"))
            self._failed.setdefault(reason, []).append(what)

    @property
    def failures(self):
        """Parts without an answer, and why: list of str, one for each reason."""
        return [f"{', '.join(names)}: {reason}" for reason, names in self._failed.items()]

    def table(self, table, caption, where_all=""):
        """Append a `Table`; see `table_html`."""
        self.add(table_html(table, caption, where_all))

    def results(self, table, caption, where_all=""):
        """Append a `Table` of results with the columns that are asked for; without any of these it is left out."""
        fields = self.chosen(table)
        if fields or not self._columns:
            self.table(table.chosen([field.name for field in fields]), caption, where_all)

    def chosen(self, table, default=()):
        """The fields of a `Table` that are asked for, or those of the default names where none is: list of Field."""
        field_of = {name: field for field in (*table.more, *table.fields) for name in (field.name, field.plain)}
        fields = [field_of[name] for name in self._columns or default if name in field_of]
        self._columns_found |= {name for field in fields for name in (field.name, field.plain)}
        return fields

    def check_columns(self):
        """Raise SceneError for the columns asked for that no table of results has."""
        unknown = [name for name in self._columns if name not in self._columns_found]
        if unknown:
            hint = "'cablestudy columns' lists all"
            raise SceneError(*(f"--columns: no table of the page has a column {name!r} ({hint})" for name in unknown))

    def key_figure(self, table, column, title, pick):
        """Show one number of a table, picked by `min` or `max` among its rows, above all sections.

        Where the rows are of load cases its title names the one that governs.
        """
        values = [(row[column], index) for index, row in enumerate(table.rows) if row.get(column) is not None]
        if not values:
            return
        value, index = pick(values)
        case = table.rows[index].get("case")
        title = title if case is None else f"{title}, {case}"
        unit = next(field.unit for field in table.fields if field.name == column)
        errors = list(table.errors()) if table.errors else []
        error = error_text(errors[index].get(column)) if index < len(errors) else ""
        stated = element("dd", f"error {error}", class_="error") if error and error != "exact" else ""
        number = element("dd", f"{text(short(value))} {element('small', unit_text(unit))}")
        self._figures.append(element("div", element("dt", text(title)) + number + stated))

    def draw(self, figure_of, caption):
        """Append the picture that a function draws by the module `plots`."""
        import cablestudy.plots as plots

        with self.part(f"Picture: {caption}"):
            self._pictures += 1
            self.add(picture(inline_picture(figure_of(plots), f"picture{self._pictures}", caption), caption))

    def note(self, title, lines):
        """Keep notes for the section on models and errors, each where it comes first."""
        kept = self._all_notes
        new = [line for line in dict.fromkeys(map(short_line, lines)) if line not in kept]
        self.notes.setdefault(title, []).extend(new)

    @property
    def _all_notes(self):
        """Notes of all titles: set of str."""
        return {line for lines in self.notes.values() for line in lines}

    def warn(self, title, lines):
        """Keep warnings, each once; those that are notes, of load cases too, are kept as notes of a title."""
        for line in map(short_line, lines):
            case, kind, message = MESSAGE.match(line).groups("")
            if kind == "note":  # that of a case only where it is not one of the whole scene
                self.note(title, [message if message in self._all_notes else case + message])
            elif case + message not in self.warnings:
                self.warnings.append(case + message)

    def models_and_errors(self, statement):
        """Append the section on what was modelled and what was left out; `statement` begins it, on the errors."""
        self.heading("Models and errors")
        self.add(paragraph(statement))
        for title, lines in self.notes.items():
            if lines:
                self.heading(title, 3)
                self.add(listed(lines))
        if self.left_out:
            self.heading("Left out", 3)
            self.add(listed(self.left_out))

    def html(self):
        """HTML of the whole page: str."""
        links = "".join(element("li", element("a", text(title), href=f"#{name}")) for name, title in self._contents)
        parts = [
            element("h1", text(self.title)) + "\n",
            paragraph(self.subtitle, class_="subtitle"),
            self._box("No answer", self.failures, "failures"),
            self._box("Warnings", self.warnings, "warnings"),
            element("dl", "".join(self._figures)) + "\n" if self._figures else "",
            element("nav", element("ul", links), aria_label="Contents") + "\n",
        ]
        return document(self.title, "".join([*parts, *self._parts]))

    def _box(self, title, lines, kind):
        """A box with a title and a list of lines, of a class of CSS; empty without lines."""
        head = element("p", element("strong", text(title)))
        return element("aside", head + listed(lines), class_=kind, aria_label=title) + "\n" if lines else ""
