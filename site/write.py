"""Writes a gallery: pages, downloads and a picture of each model, then the index that links to them."""

import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from ..bake.registry import TARGETS
from ..model import gallery
from ..model.errors import UserError
from ..model.files import check_writable, show, write_whole
from ..model.kinds import GALLERY, GENERATED, MODEL, PICTURE, Kind
from ..model.model import Model, level_networks, sizes
from ..model.model_file import load
from ..web import page
from ..web.preview import preview
from .index import Download, Entry, index, link

INDEX = "index.html"
TEXTS = (("Page", "html", ".html"), ("Tiny page", "tiny", ".tiny.html"), ("Shadertoy", "shadertoy", ".frag"))
"""Label, target and ending of the files that are baked of each model, its page first."""
PICTURE_SUFFIX = ".jpg"
"""Ending of the picture in the index."""


def write_site(folder: Path, source: Path | None, title: str, force: bool = False, url: str = "") -> None:
    """Write the site of all models in a folder, with a bar or a line for each on stderr.

    source: folder of the models; None: those that come with the package. force: overwrite files of other kinds, too.
    url: see `index`. Raises UserError, before anything is written where a model cannot be read or a file is not ours.
    """
    from tqdm import tqdm

    paths = _models(source or gallery.FOLDER)
    models = [load(path) for path in paths]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"cannot make the folder {show(folder)}: {error.strerror}") from None
    outputs = [(INDEX, GALLERY)]
    for path in paths:
        outputs += [(path.stem + suffix, GENERATED) for _, _, suffix in TEXTS]
        outputs += [(path.stem + PICTURE_SUFFIX, PICTURE), (path.name, MODEL)]
    _check(folder, outputs, paths, force)
    entries = []
    total = len(paths) * (len(TEXTS) + 1)
    with tqdm(total=total, bar_format="{desc} |{bar}| {n}/{total}", leave=False, disable=None) as bar:

        def begin(step: str) -> None:
            if not bar.disable:
                bar.update(int(bool(bar.desc)))  # the step before
                bar.set_description_str(step)

        for number, (path, model) in enumerate(zip(paths, models, strict=True), 1):
            if bar.disable:
                print(f"{show(path.stem)}: {number} of {len(paths)}", file=sys.stderr, flush=True)
            entry = _write(folder, path, model, url, begin)
            sizes = ", ".join(f"{show(file.path)} {file.bytes:,}" for file in entry.files)
            bar.write(f"{show(path.stem)}: {sizes} bytes", file=sys.stderr)
            entries.append(entry)
    write_whole(folder / INDEX, index(title, entries, url).encode())
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


def _write(folder: Path, path: Path, model: Model, url: str, begin: Callable[[str], None]) -> Entry:
    """Write the files of a model, without those that its kind of model does not have. begin: called at each step."""
    files: list[Download] = []
    name, picture = path.stem, path.stem + PICTURE_SUFFIX
    for label, target, suffix in TEXTS:
        begin(f"{show(name)}: {label.lower()}")
        try:
            if files:
                text = TARGETS[target](model)
            else:
                links = {"address": url + link(name + suffix), "preview": url + link(picture)} if url else {}
                text = page.standalone(model, **links)
        except UserError:
            if not files:  # its page
                raise
            continue
        files.append(_file(folder, label, name + suffix, text.encode()))
    begin(f"{show(name)}: picture")
    write_whole(folder / picture, preview(model))
    files.append(_file(folder, "Model", path.name, path.read_bytes()))
    levels = " > ".join(sizes(level_networks(model, i)) for i in range(len(model.levels)))
    facts = f"{levels}, {model.parameters():,} parameters"
    return Entry(name, facts, model.credit, picture, files)


def _file(folder: Path, label: str, name: str, data: bytes) -> Download:
    write_whole(folder / name, data)
    return Download(label, name, len(data))
