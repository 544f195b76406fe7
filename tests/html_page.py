"""What stands in HTML: tags in balance, names, links, texts, tables."""

import re
from html.parser import HTMLParser

VOID = {"meta", "br", "wbr", "link", "img", "input"}


class Page(HTMLParser):
    """What a page has: tags in balance, names, links, texts by tag, rows of tables by their captions."""

    def __init__(self, html):
        super().__init__()
        self.html, self.open, self.names, self.links, self.attributes = html, [], [], [], []
        self.texts, self.headings, self.tables, self.rows = {}, [], {}, []
        self.feed(html)
        self.close()

    def handle_starttag(self, tag, attributes):
        known = dict(attributes)
        self.attributes.append((tag, known))
        self.names += [known["id"]] if "id" in known else []
        self.links += [(name, value) for name, value in attributes if name in ("href", "src", "xlink:href")]
        if tag not in VOID:
            self.open.append(tag)
            if tag in ("h1", "h2", "h3", "caption", "figcaption", "li", "p", "title"):
                self.texts.setdefault(tag, []).append("")
            if re.fullmatch("h[1-6]", tag):
                self.headings.append(int(tag[1]))
            if tag == "tr":
                self.rows.append([])
            if tag in ("th", "td"):
                self.rows[-1].append("")

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)
        if tag not in VOID:
            self.handle_endtag(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag
        if tag == "table":
            self.tables.setdefault(self.texts.get("caption", [""])[-1], []).extend(self.rows)
            self.rows = []

    def handle_data(self, data):
        for tag in self.texts:
            if tag in self.open:
                self.texts[tag][-1] += data
        if self.rows and {"th", "td"} & set(self.open):
            self.rows[-1][-1] += data

    def quantities(self, caption):
        """Cells of a table by the head of their row."""
        return {row[0]: row[1:] for row in self.tables[caption]}
