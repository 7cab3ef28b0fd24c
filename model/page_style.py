"""Colors and style of the HTML pages: of `report`, of a trained folder, of a notebook, and of the web page."""

LIGHT = {"ink": "#1c1e22", "soft": "#5a5e66", "line": "#d6d3cc", "surface": "#f6f5f2", "accent": "#8f5400"}
DARK = {"ink": "#f2f3f5", "soft": "#a9aeb8", "line": "#34373f", "surface": "#1b1d22", "accent": "#ffd9a0"}
"""Colors of all pages on light and on dark screens, by their names as CSS variables."""


def variables(colors: dict[str, str]) -> str:
    """Write LIGHT or DARK as CSS declarations."""
    return " ".join(f"--{name}: {color};" for name, color in colors.items())


STYLE = f"""
:root {{ color-scheme: light dark; {variables(LIGHT)} --card: #fff; --bad: #b3261e; }}
@media (prefers-color-scheme: dark) {{ :root {{ {variables(DARK)} --card: #22252b; --bad: #f2b8b5; }} }}
body {{ font: 15px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--surface); margin: 2rem auto;
  max-width: 60rem; padding: 0 1rem; overflow-wrap: anywhere; }}
h1 {{ font-size: 1.6rem; margin: 0; }} h2 {{ font-size: 1.15rem; margin: 2rem 0 .5rem; }}
h3 {{ font-size: 1rem; margin: 1rem 0 0; }}
p {{ color: var(--soft); margin: .25rem 0; max-width: 46rem; }}
a {{ color: var(--accent); }}
figure {{ margin: 0; background: var(--card); border: 1px solid var(--line); border-radius: 8px; padding: .5rem;
  max-width: 100%; box-sizing: border-box; }}
img {{ display: block; max-width: 100%; }} figcaption {{ color: var(--soft); font-size: .9rem; }}
"""
"""Style of static pages: text and figures; each page appends rules for its other elements."""
