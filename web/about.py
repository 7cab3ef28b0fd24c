"""Lines in a page's head by which browsers and link previews know it."""

import html

ICON = (
    "data:image/svg+xml,<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 2 2'>"
    "<circle cx='1' cy='1' r='1' fill='orange'/></svg>"
)
"""URL of the icon, a disk."""
PREVIEW = (800, 420)
"""Width and height in pixels of the picture in a link preview: the usual ratio; a larger one takes long to draw."""


def icon_and_title(title: str) -> str:
    """Return the lines that a page needs in a browser."""
    return f'<link rel="icon" href="{ICON}">\n<title>{html.escape(title)}</title>'


def about(title: str, description: str, address: str = "", preview: str = "") -> str:
    """Return the icon, the title, the description, and the tags of Open Graph (ogp.me).

    address, preview: absolute URLs of the page and of its picture of PREVIEW pixels; chats and social networks do not
    resolve relative ones. "" leaves their tags out.
    """
    told = {"og:title": title, "og:type": "website"}
    if address:
        told["og:url"] = address
    if preview:
        told |= {"og:image": preview, "og:image:width": str(PREVIEW[0]), "og:image:height": str(PREVIEW[1])}
    lines = [
        icon_and_title(title),
        f'<meta name="description" property="og:description" content="{html.escape(description)}">',
        *(f'<meta property="{name}" content="{html.escape(value)}">' for name, value in told.items()),
    ]
    if preview:
        lines.append('<meta name="twitter:card" content="summary_large_image">')
    return "\n".join(lines)
