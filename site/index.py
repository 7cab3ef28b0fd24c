"""The index of a gallery: one HTML file with the pictures of all models, without scripts."""

import html
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from urllib.parse import quote

from ..model.page_style import STYLE
from ..web.about import PREVIEW, about

HEAD = (
    '<!doctype html>\n<html lang="en"><meta charset="utf-8"><meta name="generator" content="mplicits gallery">'
    '<meta name="viewport" content="width=device-width, initial-scale=1">'
    '<meta http-equiv="Content-Security-Policy" '
    "content=\"default-src 'none'; img-src 'self' data:; style-src 'unsafe-inline'\">"
)
"""The policy keeps the browser from running anything, and from loading anything but the pictures."""
DESCRIPTION = "Each shape is a small neural network: how far is a point from the surface?"
RULES = """
body { max-width: 72rem; }
ul { list-style: none; padding: 0; margin: 1.5rem 0; display: grid; gap: 1rem;
  grid-template-columns: repeat(auto-fill, minmax(15rem, 1fr)); }
figure { padding: 0; overflow: hidden; height: 100%; }
img { width: 100%; height: auto; aspect-ratio: 5 / 4; object-fit: cover; }
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
    """Name of its picture of PREVIEW pixels in the site's folder."""
    files: Sequence[Download]
    """Its page first."""


def index(title: str, entries: Sequence[Entry], url: str = "") -> str:
    """Return the HTML of the index. url: address of the site, with a slash at its end; "" where it is not known."""
    return "\n".join(_lines(title, entries, url)) + "\n"


def link(name: str) -> str:
    """Return the relative URL of a file in the site's folder."""
    return quote(os.fsencode(name))


def _lines(title: str, entries: Sequence[Entry], url: str) -> Iterator[str]:
    yield HEAD + about(title, DESCRIPTION, url, url and url + link(entries[0].picture))
    yield f"<style>{STYLE}{RULES}</style>"
    yield f"<h1>{html.escape(title)}</h1>"
    yield f"<p>{DESCRIPTION}</p><ul>"
    size = 'width="{}" height="{}"'.format(*PREVIEW)
    for entry in entries:
        page, *others = entry.files
        name, there = html.escape(entry.name), _link(page.path)
        yield f'<li><figure><a href="{there}" tabindex="-1">'
        yield f'<img alt="{name}" src="{_link(entry.picture)}" {size} loading="lazy"></a><figcaption>'
        yield f'<h2><a href="{there}">{name}</a></h2><p>{html.escape(entry.facts)}</p>'
        if entry.credit:
            yield f"<p>{html.escape(entry.credit)}</p>"
        yield "<nav>"
        for file in others:
            kilobytes = f"{file.bytes / 1000:,.1f} kB"
            yield f'<a href="{_link(file.path)}">{html.escape(file.label)} <small>{kilobytes}</small></a>'
        yield "</nav></figcaption></figure></li>"
    yield "</ul></html>"


def _link(name: str) -> str:
    return html.escape(link(name))
