"""Writes a gallery: pages and downloads of each model, then the index that links to them."""

import sys
from collections.abc import Sequence
from pathlib import Path

from ..bake.registry import TARGETS
from ..model import gallery
from ..model.errors import UserError
from ..model.files import check_writable, show, write_whole
from ..model.kinds import GALLERY, GENERATED, MODEL, Kind
from ..model.model import Model, level_networks, sizes
from ..model.model_file import load
from ..web.page import poster_url
from .index import Download, Entry, index

INDEX = "index.html"
TEXTS = (("Page", "html", ".html"), ("Tiny page", "tiny", ".tiny.html"), ("Shadertoy", "shadertoy", ".frag"))
"""Label, target and ending of the files that are baked of each model, its page first."""
SIDE = 400
"""Pixels per side of a picture in the index."""


def write_site(folder: Path, source: Path | None, title: str, force: bool = False) -> None:
    """Write the site of all models in a folder, and print a line for each.

    source: folder of the models; None: those that come with the package. force: overwrite files of other kinds, too.
    Raises UserError, before anything is written where a model cannot be read or a file is not ours.
    """
    paths = _models(source or gallery.FOLDER)
    models = [load(path) for path in paths]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"cannot make the folder {show(folder)}: {error.strerror}") from None
    outputs = [(INDEX, GALLERY)]
    for path in paths:
        outputs += [(path.stem + suffix, GENERATED) for _, _, suffix in TEXTS] + [(path.name, MODEL)]
    _check(folder, outputs, paths, force)
    entries = []
    for path, model in zip(paths, models, strict=True):
        entry = _write(folder, path, model)
        sizes = ", ".join(f"{file.path} {file.bytes:,}" for file in entry.files)
        print(f"{show(path.stem)}: {sizes} bytes", file=sys.stderr)
        entries.append(entry)
    write_whole(folder / INDEX, index(title, entries))
    print(f"{show(folder / INDEX)}: {len(entries)} models; open it in a browser", file=sys.stderr)


def _models(folder: Path) -> list[Path]:
    """List the model files of a folder, sorted. Raises UserError."""
    if not folder.is_dir():
        raise UserError(f"{show(folder)}: no such folder of models")
    found = (path for path in folder.glob("*" + gallery.SUFFIX) if not path.stem.endswith(gallery.PART))
    paths = sorted(found, key=lambda path: path.stem)
    if not paths:
        raise UserError(f"{show(folder)}: no model ({gallery.SUFFIX}) in this folder")
    return paths


def _check(folder: Path, outputs: Sequence[tuple[str, Kind]], reads: Sequence[Path], force: bool) -> None:
    """Check that all files can be written. Raises UserError."""
    names = [name for name, _ in outputs]
    if double := next((name for name in names if names.count(name) > 1), None):
        raise UserError(f"two files of the gallery would be called {show(double)}; rename a model")
    for name, kind in outputs:
        check_writable(folder / name, reads, kind=kind, force=force)


def _write(folder: Path, path: Path, model: Model) -> Entry:
    """Write the files of a model, without those that its kind of model does not have."""
    files: list[Download] = []
    for label, target, suffix in TEXTS:
        try:
            text = TARGETS[target](model)
        except UserError:
            if not files:  # its page
                raise
            continue
        files.append(_file(folder, label, path.stem + suffix, text.encode()))
    files.append(_file(folder, "Model", path.name, path.read_bytes()))
    levels = " > ".join(sizes(level_networks(model, i)) for i in range(len(model.levels)))
    facts = f"{levels}, {model.parameters():,} parameters"
    return Entry(path.stem, facts, model.credit, poster_url(model, "studio", SIDE), files)


def _file(folder: Path, label: str, name: str, data: bytes) -> Download:
    write_whole(folder / name, data)
    return Download(label, name, len(data))
