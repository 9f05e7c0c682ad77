"""A report as one page of HTML: no script, nothing from elsewhere, pictures within."""

from __future__ import annotations

import base64
from html import escape

from .blocks import Block, Bullets, Code, Paragraph, Picture, Report, Table

POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
"""Nothing is fetched, and no script runs, whatever stands in the page."""

STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #1d2b36; max-width: 62em; margin: 2em auto; padding: 0 1em; }
h1 { font-size: 1.7em; line-height: 1.25; margin: 0 0 .2em; overflow-wrap: anywhere; }
h2 { font-size: 1.2em; margin: 2em 0 .5em; padding-top: .5em; border-top: 1px solid #c9d1d7; break-after: avoid; }
.summary { font-size: 1.15em; margin: 0; }
.created { color: #5d6b76; margin: .2em 0 0; }
figure { margin: 1em 0; break-inside: avoid; }
img { max-width: 100%; max-height: 48em; border: 1px solid #c9d1d7; }
figcaption { color: #5d6b76; font-size: .9em; }
table { border-collapse: collapse; margin: .8em 0; font-size: .92em; }
th, td { text-align: left; vertical-align: top; padding: .25em .9em .25em 0; border-bottom: 1px solid #dde3e7; }
th { border-bottom-color: #1d2b36; }
td:last-child { overflow-wrap: anywhere; }
.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
tr { break-inside: avoid; }
thead { display: table-header-group; }
code { display: block; background: #eef1f3; padding: .6em .8em; overflow-wrap: anywhere; white-space: pre-wrap; }
@page { size: A4; margin: 18mm 16mm; }
@media print {
  body { font-size: 9.5pt; margin: 0; max-width: none; padding: 0; }
  img { max-height: 13cm; }
}
"""


def as_html(report: Report) -> str:
    """Return the page."""
    title = escape(report.title)
    sections = "\n".join(
        f"<section>\n<h2>{escape(section.title)}</h2>\n" + "\n".join(map(_block, section.blocks)) + "\n</section>"
        for section in report.sections
    )
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{escape(POLICY)}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>{STYLE}</style>
</head>
<body>
<h1>{title}</h1>
<p class="summary">{escape(report.summary)}</p>
<p class="created">Placement of {escape(report.created)}</p>
{sections}
</body>
</html>
"""


def _block(block: Block) -> str:
    if isinstance(block, Paragraph):
        return f"<p>{escape(block.text)}</p>"
    if isinstance(block, Code):
        return f"<code>{escape(block.text)}</code>"
    if isinstance(block, Bullets):
        return "<ul>\n" + "\n".join(f"<li>{escape(line)}</li>" for line in block.lines) + "\n</ul>"
    if isinstance(block, Picture):
        source = f"data:image/png;base64,{base64.b64encode(block.png).decode('ascii')}"
        caption = escape(block.caption)
        return f'<figure><img src="{source}" alt="{caption}"><figcaption>{caption}</figcaption></figure>'
    return _table(block)


def _table(table: Table) -> str:
    head = _row(table, table.head, "th")
    rows = "\n".join(_row(table, row, "td") for row in table.rows)
    return f"<table>\n<thead>\n{head}\n</thead>\n<tbody>\n{rows}\n</tbody>\n</table>"


def _row(table: Table, cells: tuple[str, ...], tag: str) -> str:
    kinds = (' class="number"' if column in table.numbers else "" for column in range(len(cells)))
    inner = "".join(f"<{tag}{kind}>{escape(cell)}</{tag}>" for kind, cell in zip(kinds, cells, strict=True))
    return f"<tr>{inner}</tr>"
