"""The parts of a mesh: faces of a part made consistent, and each part turned outward by itself."""

from dataclasses import dataclass

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components

from .creases import Integers, face_areas
from .shape import Doubles

OPENEST = 0.6
"""A part has a sense if the length of its area vector is a smaller share of its area: 0 closed, 0.5 a half ball."""
FLATTEST = 0.002  # and if its volume exceeds this share of its area to the power of 1.5; a ball has 0.094
WITNESSES = 5  # vertices of a part that say whether it lies inside the others
SMALL = 0.1  # a main part with a smaller share of the whole radius is worth a warning


@dataclass(frozen=True, eq=False)
class Facing:
    """How the faces of a mesh are to be turned."""

    flipped: NDArray[np.bool_]
    """(F,), the faces whose corners are to be reversed."""
    parts: int
    turned: int
    """Parts that pointed inward."""
    whole: bool
    """Whether all parts with a volume pointed inward."""
    disagreeing: float
    """Share of the edges whose two faces had opposite sides."""
    main: float
    """Radius of the part of the largest area, as a share of the whole mesh's."""


@dataclass(frozen=True, eq=False)
class _Edges:
    """The half edges of faces (F, 3), sorted so that those of one edge follow one another."""

    half: Integers
    """(3 F,); half edge 3 f + k starts at corner k of face f."""
    first: Integers
    """(E,), the place in `half` at which each edge begins."""
    counts: Integers
    """(E,), the half edges of each edge."""


def _edges(faces: Integers) -> _Edges:
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    key = np.minimum(start, end) * (int(faces.max()) + 1) + np.maximum(start, end)
    half = np.argsort(key, kind="stable")
    first = np.flatnonzero(np.concatenate(([True], key[half[1:]] != key[half[:-1]])))
    return _Edges(half, first, np.diff(first, append=len(half)))


def facing(vertices: Doubles, faces: Integers) -> Facing:
    """Find the faces to turn, so that each part is consistent and points outward.

    vertices: (V, 3). faces: (F, 3). A part that lies inside others and points inward is a cavity, and stays; so does
    an open part without a clear volume, such as terrain.
    """
    edges = _edges(faces)
    signs, disagreeing = _consistent(vertices, faces, edges)
    turned_faces = np.where((signs < 0)[:, None], faces[:, ::-1], faces)
    count, part = _parts(faces, edges)
    areas, volumes, clear = _measures(vertices, turned_faces, part, count, edges)
    sense = np.where(clear, np.sign(volumes), 0)
    inverted = bool(volumes[clear].sum() < 0)
    flips = np.full(count, inverted) & clear
    inward = np.flatnonzero((sense * np.where(flips, -1, 1)) < 0)
    if len(inward):
        outward = (sense * np.where(flips, -1, 1) > 0)[part]
        solid = np.where(flips[part][:, None], turned_faces[:, ::-1], turned_faces)[outward]
        inside = _inside(vertices, faces, part, inward, solid)
        flips[inward[~inside]] ^= True
    if not clear.any() and count > 1:  # triangles without common edges: only the whole may have a volume
        _, volume, whole = _measures(vertices, turned_faces, np.zeros_like(part), 1, edges)
        inverted = bool(whole[0] and volume[0] < 0)
        flips[:] = inverted
    return Facing(
        flipped=(signs < 0) ^ flips[part],
        parts=count,
        turned=int(np.count_nonzero(flips)),
        whole=bool(flips[clear].all()) if clear.any() else bool(flips.all()),
        disagreeing=disagreeing,
        main=_main_part(vertices, faces, part, areas) if count > 1 else 1.0,
    )


def facing_warnings(found: Facing) -> list[str]:
    """Return warnings of what was turned, without the file's name."""
    lines = []
    if found.disagreeing:
        lines.append(f"{found.disagreeing:.2%} of the edges join faces of opposite sides; made consistent")
    if found.turned and found.whole:
        lines.append("the faces point inwards; reversed")
    elif found.turned:
        lines.append(f"{found.turned} of {found.parts} parts point inwards; reversed")
    if found.parts > 1 and found.main < SMALL:
        lines.append(
            f"{found.parts:,} parts, and the main one has 1/{1 / max(found.main, 1e-9):.0f} of the whole radius: it "
            "becomes that small in the model; remove what lies far away"
        )
    return lines


def _consistent(vertices: Doubles, faces: Integers, edges: _Edges) -> tuple[NDArray[np.int64], float]:
    """Return 1 or -1 for each face (F,) so that faces with a common edge agree, and the share of edges that did not.

    Edges of three or more faces say nothing. The larger area of each patch keeps its side.
    """
    signs = np.ones(len(faces), np.int64)
    pairs = edges.first[edges.counts == 2]
    one, other = edges.half[pairs], edges.half[pairs + 1]
    corners = faces.ravel()
    agree = np.asarray(corners[one] != corners[other])  # they run in opposite ways
    if agree.all():
        return signs, 0.0
    count = len(faces)
    links = coo_array((np.where(agree, 1, 2), (one // 3, other // 3)), shape=(count, count)).tocsr()
    links = links.maximum(links.T)
    patches, patch = connected_components(links, directed=False)
    # One extra face, the parent of all patches' first faces, joins the patches.
    roots = np.unique(patch, return_index=True)[1]
    above = coo_array((np.ones(patches), (np.full(patches, count), roots)), shape=(count + 1, count + 1))
    tree = links.tocoo()
    whole = (above + coo_array((tree.data, tree.coords), shape=above.shape)).tocsr()
    parent = breadth_first_order(whole, count, directed=False)[1][:count].astype(np.int64)
    is_root = parent == count
    parent[is_root] = np.flatnonzero(is_root)
    child = np.flatnonzero(~is_root)
    found = np.asarray(links[child, parent[child]]).ravel()
    signs[child] = np.where(found == 2, -1, 1)
    while (parent != parent[parent]).any():  # each round doubles the distance to the ancestor
        signs *= signs[parent]
        parent = parent[parent]
    weighted = np.bincount(patch, face_areas(vertices, faces) * signs, patches)
    signs *= np.where(weighted < 0, -1, 1)[patch]
    return signs, float(np.mean(~agree))


def _parts(faces: Integers, edges: _Edges) -> tuple[int, Integers]:
    """Count the parts, and number the part (F,) of each face.

    Parts share no edge, or are closed by themselves and touch at edges of more than two faces.
    """
    follows = np.ones(len(edges.half), np.bool_)
    follows[edges.first] = False
    at = np.flatnonzero(follows)
    one, other = edges.half[at - 1] // 3, edges.half[at] // 3
    ordinary = np.repeat(edges.counts == 2, edges.counts)[at]

    def labels(kept: NDArray[np.bool_]) -> tuple[int, Integers]:
        links = coo_array((np.ones(kept.sum(), np.int8), (one[kept], other[kept])), shape=(len(faces), len(faces)))
        count, label = connected_components(links, directed=False)
        return int(count), np.asarray(label, np.int64)

    if ordinary.all():
        return labels(ordinary)
    count, patch = labels(ordinary)
    # A patch is closed if it has an even number of faces at each edge.
    edge = np.repeat(np.arange(len(edges.counts)), edges.counts)
    keys, times = np.unique(edge * count + patch[edges.half // 3], return_counts=True)
    is_open = np.bincount(keys % count, times % 2, count) > 0
    return labels(ordinary | (is_open[patch[one]] & is_open[patch[other]]))


def _measures(
    vertices: Doubles, faces: Integers, part: Integers, count: int, edges: _Edges
) -> tuple[Doubles, Doubles, NDArray[np.bool_]]:
    """Return the faces' areas (F,), each part's volume (P,), and whether its sign is clear (P,).

    An open part is closed by a cone from the middle of its border.
    """
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    vectors = np.cross(b - a, c - a) / 2
    areas = np.linalg.norm(vectors, axis=1)
    middle = _middles(vertices, faces, part, count, edges)
    volumes = np.bincount(part, np.einsum("ij,ij->i", a - middle[part], vectors) / 3, count)
    area = np.bincount(part, areas, count)
    across = np.stack([np.bincount(part, column, count) for column in vectors.T], axis=1)
    openness = np.linalg.norm(across, axis=1) / np.maximum(area, 1e-300)
    closed = openness < 1e-6
    thick = np.abs(volumes) > np.where(closed, 1e-12, FLATTEST) * area**1.5
    return areas, volumes.astype(np.float64), np.asarray((openness < OPENEST) & thick)


def _middles(vertices: Doubles, faces: Integers, part: Integers, count: int, edges: _Edges) -> Doubles:
    """Return the middle (P, 3) of each part's border; of the whole part where it has none."""
    border = edges.half[edges.first[edges.counts == 1]]
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    points = (vertices[start[border]] + vertices[end[border]]) / 2
    owner = part[border // 3]

    def means(at: Integers, rows: Doubles) -> Doubles:
        sums = np.stack([np.bincount(at, column, count) for column in rows.T], axis=1)
        return np.asarray(sums / np.maximum(np.bincount(at, minlength=count), 1)[:, None])

    has_border = np.bincount(owner, minlength=count) > 0
    return np.where(has_border[:, None], means(owner, points), means(part, vertices[faces[:, 0]]))


def _inside(vertices: Doubles, faces: Integers, part: Integers, asked: Integers, solid: Integers) -> NDArray[np.bool_]:
    """Say which of the parts `asked` (A,) lie inside the surface of the faces `solid`, by its winding number."""
    if not len(solid):
        return np.zeros(len(asked), np.bool_)
    order = np.argsort(part, kind="stable")
    starts = np.searchsorted(part[order], asked)
    sizes = np.bincount(part)[asked]
    places = starts[:, None] + (np.linspace(0, 1, WITNESSES)[None] * (sizes[:, None] - 1)).astype(np.int64)
    points = vertices[faces[order[places.ravel()], 0]]
    winding = igl.FastWindingNumberBVH()
    winding.init(np.ascontiguousarray(vertices), np.ascontiguousarray(solid))
    return np.asarray((winding.winding_number(points) > 0.5).reshape(-1, WITNESSES).mean(axis=1) > 0.5)


def _main_part(vertices: Doubles, faces: Integers, part: Integers, areas: Doubles) -> float:
    """Return the radius of the part of the largest area, as a share of the whole mesh's."""
    largest = int(np.bincount(part, areas).argmax())
    reach = _radius(vertices[faces].reshape(-1, 3))
    return _radius(vertices[faces[part == largest]].reshape(-1, 3)) / reach if reach else 1.0


def _radius(points: Doubles) -> float:
    center = (points.min(axis=0) + points.max(axis=0)) / 2
    return float(np.linalg.norm(points - center, axis=1).max())
