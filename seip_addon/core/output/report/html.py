"""A report as one page of HTML: no script, nothing from elsewhere, pictures within."""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable
from html import escape

from .blocks import Block, Bullets, Card, Facts, Paragraph, Picture, Report, Table

POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
"""Nothing is fetched, and no script runs, whatever stands in the page."""

_DIRECTIONS = re.compile("[\u202a-\u202e\u2066-\u2069]")

STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #1d2b36; max-width: 60em; margin: 2em auto; padding: 0 1em; }
h1 { font-size: 1.9em; line-height: 1.2; margin: 0 0 .2em; overflow-wrap: anywhere; }
h2 { font-size: 1.3em; margin: 2.2em 0 .6em; padding-top: .6em; border-top: 2px solid #1d2b36; }
h3 { font-size: 1.05em; margin: 0 0 .5em; overflow-wrap: anywhere; }
.subtitle { color: #5d6b76; font-size: 1.1em; margin: 0 0 1.2em; }
figure { margin: 1em 0; }
img { display: block; max-width: 100%; border: 1px solid #c9d1d7; box-sizing: border-box; }
figure > img { max-height: 60em; margin: 0 auto; }
figcaption { color: #5d6b76; font-size: .9em; margin-top: .3em; }
.card { border: 1px solid #c9d1d7; border-radius: 4px; padding: 1em; margin: 1em 0; }
dl { display: grid; grid-template-columns: minmax(6em, max-content) 1fr; gap: .25em 1.2em; margin: .6em 0; }
dt { color: #5d6b76; }
dd { margin: 0; overflow-wrap: anywhere; font-variant-numeric: tabular-nums; }
dl.large { font-size: 1.15em; border: 1px solid #c9d1d7; border-width: 1px 0; padding: .6em 0; }
dl.large dd { font-weight: 600; }
table { border-collapse: collapse; margin: .8em 0; font-size: .95em; }
th, td { text-align: left; vertical-align: top; padding: .3em .9em .3em 0; border-bottom: 1px solid #dde3e7; }
th { border-bottom-color: #1d2b36; }
td { overflow-wrap: break-word; }
.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
th.number { white-space: normal; }
@media (max-width: 30em) {
  body { margin: 1em auto; }
  dl { grid-template-columns: 1fr; gap: 0; }
  dd { margin-bottom: .5em; }
  .card { padding: .7em; }
  th, td { padding-right: .6em; }
}
"""


def as_html(report: Report) -> str:
    """Return the page, which loads nothing."""
    sections = "\n".join(
        f"<section>\n<h2>{_shown(section.title)}</h2>\n{_blocks(section.blocks)}\n</section>"
        for section in report.sections
    )
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{escape(POLICY)}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{_shown(report.title)}</title>
<style>{STYLE}</style>
</head>
<body>
<header>
<h1>{_shown(report.title)}</h1>
<p class="subtitle">{_shown(report.subtitle)}</p>
{_blocks(report.first)}
</header>
{sections}
</body>
</html>
"""


def _shown(text: str) -> str:
    """Return a text for a page, without marks by which a name would reverse the order of what follows it."""
    return escape(_DIRECTIONS.sub("", text))


def _blocks(blocks: Iterable[Block]) -> str:
    return "\n".join(map(_block, blocks))


def _block(block: Block) -> str:
    if isinstance(block, Paragraph):
        html = f"<p>{_shown(block.text)}</p>"
    elif isinstance(block, Bullets):
        html = "<ul>\n" + "\n".join(f"<li>{_shown(line)}</li>" for line in block.lines) + "\n</ul>"
    elif isinstance(block, Facts):
        rows = "\n".join(f"<dt>{_shown(name)}</dt><dd>{_shown(value)}</dd>" for name, value in block.rows)
        kind = ' class="large"' if block.large else ""
        html = f"<dl{kind}>\n{rows}\n</dl>"
    elif isinstance(block, Card):
        html = f'<div class="card">\n<h3>{_shown(block.title)}</h3>\n{_blocks(block.blocks)}\n</div>'
    elif isinstance(block, Picture):
        caption = f"<figcaption>{_shown(block.caption)}</figcaption>"
        html = f"<figure>{_image(block.png, block.caption)}{caption}</figure>"
    else:
        inner = "\n".join(_row(block, row, "td") for row in block.rows)
        head = _row(block, block.head, "th")
        html = f"<table>\n<thead>\n{head}\n</thead>\n<tbody>\n{inner}\n</tbody>\n</table>"
    return html


def _image(png: bytes, caption: str) -> str:
    source = f"data:image/png;base64,{base64.b64encode(png).decode('ascii')}"
    return f'<img src="{source}" alt="{_shown(caption)}">'


def _row(table: Table, cells: tuple[str, ...], tag: str) -> str:
    kinds = (' class="number"' if column in table.numbers else "" for column in range(len(cells)))
    inner = "".join(f"<{tag}{kind}>{_shown(cell)}</{tag}>" for kind, cell in zip(kinds, cells, strict=True))
    return f"<tr>{inner}</tr>"
