"""The style sheet that the pages of `report` and of a trained folder share."""

STYLE = """
:root { color-scheme: light dark; --ink: #1d1d1f; --soft: #5a5e66; --line: #d9d6cf; --back: #faf9f7; --card: #fff;
  --accent: #1a5fb4; --bad: #b3261e; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #eee; --soft: #a9aeb8; --line: #3a3d45; --back: #16171a; --card: #1f2126; --accent: #8ab4f8;
    --bad: #f2b8b5; }
}
body { font: 15px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--back); margin: 2rem auto;
  max-width: 60rem; padding: 0 1rem; overflow-wrap: anywhere; }
h1 { font-size: 1.6rem; margin: 0; } h2 { font-size: 1.15rem; margin: 2rem 0 .5rem; }
h3 { font-size: 1rem; margin: 1rem 0 0; }
p { color: var(--soft); margin: .25rem 0; max-width: 46rem; }
a { color: var(--accent); }
figure { margin: 0; background: var(--card); border: 1px solid var(--line); border-radius: 8px; padding: .5rem;
  max-width: 100%; box-sizing: border-box; }
img { display: block; max-width: 100%; } figcaption { color: var(--soft); font-size: .9rem; }
"""
"""Colors for light and dark screens, text, and figures; a page appends the rules that only it needs."""
