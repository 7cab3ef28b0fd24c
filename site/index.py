"""The index of a gallery: one HTML file with the pictures of all models, without scripts."""

import html
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from urllib.parse import quote

from ..model.page_style import STYLE

HEAD = (
    '<!doctype html>\n<html lang="en"><meta charset="utf-8"><meta name="generator" content="mplicits gallery">'
    '<meta name="viewport" content="width=device-width, initial-scale=1">'
    '<meta http-equiv="Content-Security-Policy" '
    "content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'\">"
)
"""The policy keeps the browser from loading or running anything."""
RULES = """
body { max-width: 72rem; }
ul { list-style: none; padding: 0; margin: 1.5rem 0; display: grid; gap: 1rem;
  grid-template-columns: repeat(auto-fill, minmax(15rem, 1fr)); }
figure { padding: 0; overflow: hidden; height: 100%; }
img { width: 100%; aspect-ratio: 5 / 4; object-fit: cover; }
figcaption { padding: .25rem 1rem 1rem; } figcaption p { margin: .25rem 0; }
h2 { margin: .5rem 0 0; color: var(--ink); } h2 a { color: inherit; }
nav { display: flex; flex-wrap: wrap; gap: .25rem 1rem; }
"""


@dataclass(frozen=True)
class Download:
    """A file of a model."""

    label: str
    """Words of its link."""
    path: str
    """Its name in the site's folder."""
    bytes: int


@dataclass(frozen=True)
class Entry:
    """A model in the index."""

    name: str
    facts: str
    """One line: networks and parameters."""
    credit: str
    """Of its shape; may be empty."""
    picture: str
    """URL of its picture, which holds the data."""
    files: Sequence[Download]
    """Its page first."""


def index(title: str, entries: Sequence[Entry]) -> str:
    """Return the HTML of the index."""
    return "\n".join(_lines(title, entries)) + "\n"


def _lines(title: str, entries: Sequence[Entry]) -> Iterator[str]:
    yield f"{HEAD}<title>{html.escape(title)}</title><style>{STYLE}{RULES}</style>"
    yield f"<h1>{html.escape(title)}</h1>"
    yield "<p>Each shape is a small neural network: how far is a point from the surface?</p><ul>"
    for entry in entries:
        page, *others = entry.files
        name, link = html.escape(entry.name), _link(page)
        yield f'<li><figure><a href="{link}" tabindex="-1"><img alt="{name}" src="{entry.picture}"></a><figcaption>'
        yield f'<h2><a href="{link}">{name}</a></h2><p>{html.escape(entry.facts)}</p>'
        if entry.credit:
            yield f"<p>{html.escape(entry.credit)}</p>"
        yield "<nav>"
        for file in others:
            kilobytes = f"{file.bytes / 1000:,.1f} kB"
            yield f'<a href="{_link(file)}">{html.escape(file.label)} <small>{kilobytes}</small></a>'
        yield "</nav></figcaption></figure></li>"
    yield "</ul></html>"


def _link(file: Download) -> str:
    return html.escape(quote(os.fsencode(file.path)))
