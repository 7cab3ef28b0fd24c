"""Colors an OBJ: by the images of its materials, else by its vertices, else by the colors of its materials."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..model.files import show
from ..model.references import Folder, UnresolvedError
from ..model.srgb import to_linear
from .claims import Claims
from .content import Facts
from .images import Images, Missing, users_picture
from .mtl import ObjMaterial, read_materials
from .named_files import NamedFiles
from .paint import Material, Paint, Picture
from .values import CornerValues

PLACEHOLDERS = ((1.0, 1.0, 1.0), (0.8, 0.8, 0.8), (0.4, 0.4, 0.4), (0.0, 0.0, 0.0))
"""Colors that programs write where nobody chose one; alone they are no color of the shape."""


def obj_paint(
    folder: Folder,
    libraries: Sequence[str],
    names: Sequence[str],
    material: NDArray[np.int64],
    uv: CornerValues | None,
    has_uv: NDArray[np.bool_],
    painted: CornerValues | None,
    image: Path | None,
    facts: Facts,
) -> Paint | None:
    """Return the colors: of images, else of vertices, else of materials.

    libraries, names: of `mtllib`, and of the materials. material: (F,), the index of each triangle's name. has_uv:
    (F,), whether all corners have texture coordinates. painted: the colors of vertices. image: the user's. Raises
    UserError.
    """
    if image is not None:
        picture = users_picture(image, unwrapped=uv is not None)
        return Paint((Material(picture),), np.zeros(len(material), np.int64), uv)
    files, images = NamedFiles(folder), Images(Claims(0))
    library, missing = read_materials(files, libraries)
    present: list[int] = np.unique(material).tolist()
    own: dict[int, ObjMaterial] = {index: library.get(names[index], ObjMaterial()) for index in present}
    pictures: dict[int, Picture] = {}
    lost: dict[str, Missing] = {error.name: Missing(error.name, error.why) for error in missing}
    if uv is not None:
        alone = next(iter(library.values())) if len(library) == 1 else None
        for index in present:
            # Without `usemtl`, or by a name in another encoding, the only material is meant.
            own[index] = own[index] if names[index] in library else alone or own[index]
            if (named := own[index].image) is not None:
                try:
                    picture = images.named(files, named.name)
                    pictures[index] = Picture(picture.pixels, ("clamp", "clamp") if named.clamped else picture.wraps)
                except UnresolvedError as error:
                    lost[error.name] = Missing(error.name, error.why)
    colors = {index: own[index].color for index in present}
    gone = [names[index] for index in present if names[index] and names[index] not in library and not own[index].image]
    if library and gone and len(gone) < len(present):
        facts.warnings.append(f"materials that are not there, and are gray: {', '.join(map(show, gone[:8]))}")
    if not pictures:
        if painted is not None:
            return Paint((Material(),), np.zeros(len(material), np.int64), colors=painted)
        if uv is not None and (lost or all(color in (None, *PLACEHOLDERS) for color in colors.values())):
            facts.warnings.append(next(iter(lost.values()), Missing("")).line())
            return None
        if missing:
            facts.warnings.append(f"its materials are missing: {_listed(lost)}")
        if all(color in (None, *PLACEHOLDERS) for color in colors.values()):
            return None
    elif lost:
        facts.warnings.append(f"files are missing: {_listed(lost)}")
    gray = (0.5, 0.5, 0.5)
    materials = tuple(
        Material(pictures[index]) if index in pictures else Material(None, _linear(colors.get(index) or gray))
        for index in range(len(names))
    )
    if not pictures:
        return Paint(materials, material)
    bare = ~has_uv & np.isin(material, list(pictures))
    if bare.any():
        facts.warnings.append(f"{np.count_nonzero(bare):,} triangles without texture coordinates have the mean color")
        materials = (*materials, Material(None, _linear(_mean_color([*pictures.values()]))))
        material = np.where(bare, len(materials) - 1, material)
    return Paint(materials, material, _transformed(uv, own, material))


def _listed(lost: dict[str, Missing]) -> str:
    return "; ".join(f"{each.name}: {each.why}" for each in [*lost.values()][:8])


def _mean_color(pictures: list[Picture]) -> list[float]:
    """Return the mean of the mean colors of pictures, sRGB; an image of several is averaged once."""
    images = {id(picture.pixels): picture.pixels for picture in pictures}
    means = {key: pixels.mean(axis=(0, 1)) / 255 for key, pixels in images.items()}
    mean: list[float] = np.mean([means[id(picture.pixels)] for picture in pictures], axis=0).tolist()
    return mean


def _linear(color: Sequence[float]) -> tuple[float, float, float]:
    red, green, blue = (float(value) for value in to_linear(np.array(color, np.float64)))
    return red, green, blue


def _transformed(
    uv: CornerValues | None, own: dict[int, ObjMaterial], material: NDArray[np.int64]
) -> CornerValues | None:
    """Scale and move texture coordinates, as the options -s and -o of the materials' images say."""
    scales, offsets = np.ones((material.max() + 1, 1, 2)), np.zeros((material.max() + 1, 1, 2))
    for index, each in own.items():
        if each.image is not None:
            scales[index], offsets[index] = each.image.scale, each.image.offset
    if uv is None or ((scales == 1).all() and not offsets.any()):
        return uv
    corners = uv[:] * scales[material] + offsets[material]
    return CornerValues(corners.reshape(-1, 2), np.arange(3 * len(material)).reshape(-1, 3))
