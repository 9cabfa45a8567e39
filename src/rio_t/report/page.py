"""The page: one HTML file that holds its figures."""
import base64
import html

from ..plots import pyplot

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #222; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; margin-bottom: 0; } h2 { font-size: 1.1rem; margin: 2.2rem 0 .5rem; }
p.note { color: #666; margin: .2rem 0 1rem; } img { width: 100%; height: auto; }
table { border-collapse: collapse; margin: .5rem 0; font-variant-numeric: tabular-nums; }
th, td { padding: .25rem .9rem .25rem 0; border-bottom: 1px solid #ddd; text-align: left; vertical-align: top; }
td.number, th.number { text-align: right; }
.good { color: #17702f; font-weight: 600; } .doubtful { color: #8a5a00; font-weight: 600; }
.bad { color: #b01818; font-weight: 600; }
"""


def shown(value):
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, dict):
        return ", ".join(f"{key} {shown(v)}" for key, v in value.items()) or "none"
    if isinstance(value, list):
        return ", ".join(shown(v) for v in value)
    return str(value)


def row_html(tag, row):
    numeric = ' class="number"' if len(row) > 2 else ""
    cells = [f"<{tag}{numeric if i else ''}>{html.escape(shown(value))}</{tag}>" for i, value in enumerate(row)]
    return "<tr>" + "".join(cells) + "</tr>"


class Page:
    """Collects sections, and writes each figure to a file of its own as well."""

    def __init__(self, folder, title):
        self.folder, self.title, self.parts = folder, title, []

    def heading(self, text, note=""):
        self.parts.append(f"<h2>{html.escape(text)}</h2>")
        if note:
            self.note(note)

    def note(self, text):
        self.parts.append(f'<p class="note">{html.escape(text)}</p>')

    def table(self, rows, header=None):
        head = row_html("th", header) if header else ""
        self.parts.append("<table>" + head + "".join(row_html("td", row) for row in rows) + "</table>")

    def verdict(self, kind, text):
        """A line in the colour of its kind: good, doubtful or bad."""
        self.parts.append(f'<p class="{kind}">{html.escape(text)}</p>')

    def checks(self, rows):
        """Rows of what, value, bound, and whether the value is good, which colours it."""
        cells = "".join(f"<tr><td>{html.escape(what)}</td>"
                        f'<td class="number {"good" if good else "bad"}">{html.escape(shown(value))}</td>'
                        f"<td>{html.escape(bound)}</td></tr>" for what, value, bound, good in rows)
        self.parts.append(f"<table>{row_html('th', ['', 'value', 'expected'])}{cells}</table>")

    def figure(self, name, figure):
        path = self.folder / f"{name}.png"
        figure.align_ylabels()
        figure.tight_layout()
        figure.savefig(path, dpi=110)
        pyplot.close(figure)
        data = base64.b64encode(path.read_bytes()).decode("ascii")
        self.parts.append(f'<img alt="{html.escape(name)}" src="data:image/png;base64,{data}">')

    def write(self):
        title = html.escape(self.title)
        text = (f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
                f"<style>{STYLE}</style></head>\n<body><h1>{title}</h1>\n" + "\n".join(self.parts) + "\n</body></html>\n")
        path = self.folder / "report.html"
        path.write_text(text, encoding="utf-8")
        return path
