"""The endings of files with shapes: one table, which texts, readers and pages print."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Format:
    """A format of files."""

    name: str
    """For people."""
    endings: tuple[str, ...]
    """In lower case."""
    mesh: bool = False
    cloud: bool = False
    page: bool = False
    """Whether the page that trains reads it, too."""

    @property
    def content(self) -> str:
        """What such a file holds, in words."""
        return " or ".join(["a mesh"] * self.mesh + ["a point cloud"] * self.cloud)


FORMATS = (
    Format("PLY", (".ply",), mesh=True, cloud=True, page=True),
    Format("OBJ", (".obj",), mesh=True, page=True),
    Format("STL", (".stl",), mesh=True, page=True),
    Format("GLB", (".glb",), mesh=True, page=True),
    Format("glTF", (".gltf",), mesh=True, page=True),
    Format("OFF", (".off",), mesh=True),
    Format("3MF", (".3mf",), mesh=True),
    Format("XYZ", (".xyz",), cloud=True, page=True),
    Format("CSV", (".csv", ".txt", ".asc", ".pts"), cloud=True),
    Format("NPZ", (".npz",), cloud=True),
    Format("PCD", (".pcd",), cloud=True),
    Format("LAS", (".las", ".laz"), cloud=True),
    Format("E57", (".e57",), cloud=True),
)
MESHES = tuple(ending for each in FORMATS if each.mesh for ending in each.endings)
"""Endings of files that hold meshes."""
SHAPES = {ending: each.content for each in FORMATS for ending in each.endings}
"""Ending -> content, in words."""
IN_PAGE = tuple(ending for each in FORMATS if each.page for ending in each.endings)
"""Endings of shapes that the page that trains reads."""
MESH_NAMES = " ".join(each.name for each in FORMATS if each.mesh)
CLOUD_NAMES = " ".join(each.name for each in FORMATS if each.cloud)
