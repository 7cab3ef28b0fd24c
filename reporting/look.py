"""How a report looks: the head of its page, its style, figures and tables."""

import html
from collections.abc import Iterable, Sequence

from ..model import page_style

HEAD = (
    '<!doctype html>\n<html lang="en"><meta charset="utf-8"><meta name="generator" content="mplicits report">'
    '<meta name="viewport" content="width=device-width, initial-scale=1">'
    '<meta http-equiv="Content-Security-Policy" '
    "content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'\">"
)
"""How the page begins; the policy keeps anything in it from being loaded or run."""
STYLE = (
    page_style.STYLE
    + """
.row { display: flex; flex-wrap: wrap; gap: 1rem; }
.scale { width: 256px; height: 12px; margin-top: .75rem; image-rendering: pixelated; }
.ends { display: flex; justify-content: space-between; width: 256px; font-size: .85rem; color: var(--soft); }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; background: var(--card); }
td, th { border: 1px solid var(--line); padding: .2rem .6rem; text-align: right; font-weight: normal;
  vertical-align: top; }
th { color: var(--soft); } td:first-child, th:first-child { text-align: left; } td.text { text-align: left; }
svg { display: block; width: 100%; max-width: 640px; background: var(--card); border: 1px solid var(--line);
  border-radius: 8px; }
svg text { font-size: 11px; fill: var(--soft); text-anchor: end; dominant-baseline: middle; }
svg .below { text-anchor: middle; } .grid { stroke: var(--line); } polyline { fill: none; stroke-width: 1.3; }
.legend { list-style: none; padding: 0; margin: .25rem 0; display: flex; flex-wrap: wrap; gap: .2rem 1rem;
  font-size: .9rem; }
.legend i { display: inline-block; width: 1.2em; height: 3px; margin-right: .4em; vertical-align: middle;
  background: currentColor; }
polyline { stroke: currentColor; } polyline.mean_f { stroke-width: 2.5; }
.mean_f { color: #d1495b; } .loss { color: #8d8d8d; } .normal, .along { color: #d9902f; }
.value, .colour { color: #2e86ab; } .distance { color: #3d9970; } .eikonal { color: #9b5de5; }
"""
)


def figure(source: str, title: str, caption: str = "") -> str:
    """Write a picture with its caption, `title` where there is none. source: its URL."""
    told = html.escape(caption or title)
    return f'<figure><img alt="{html.escape(title)}" src="{source}"><figcaption>{told}</figcaption></figure>'


def table(head: Sequence[str], rows: Iterable[Sequence[object]], kind: str = "") -> str:
    """Write a table, every cell escaped. kind: class of the cells."""
    tagged = f' class="{kind}"' if kind else ""
    top = "".join(f"<th>{html.escape(cell)}</th>" for cell in head) if any(head) else ""
    lines = ["".join(f"<td{tagged}>{html.escape(str(cell))}</td>" for cell in row) for row in rows]
    return f"<table><tr>{top}</tr>{''.join(f'<tr>{line}</tr>' for line in lines)}</table>"
