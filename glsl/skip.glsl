// skip(): where a ray meets the next cell of the grid that may hold a part of the shape; t itself where it is in one.
// origin, direction: model space; t, far: distances along the ray, at which it is and at which it leaves the ball.
// The grid (codegen/reference/cells.py) fills a cube around the origin. The texel of a cell that is not empty is 0; that
// of an empty one is 1 + the binary logarithm of the edge, in cells, of the largest empty cube that holds it, of those
// whose edges and corners are multiples of a power of 2. Without CELLS there is no grid, and nothing is skipped.
#ifdef CELLS
uniform highp usampler3D cells;
uniform int cell_count; // along an edge; 0: no grid, nothing is skipped
uniform float cells_half; // half the edge of the cube, model units

float skip(vec3 origin, vec3 direction, float t, float far) {
    float scale = 0.5 * float(cell_count) / cells_half; // cells per model unit
    vec3 start = scale * (origin + cells_half), along = scale * direction;
    along += vec3(equal(along, vec3(0.0))) * 1e-6;
    for (int i = 0; i < 4 * cell_count && t <= far; ++i) {
        vec3 place = start + t * along;
        ivec3 cell = clamp(ivec3(floor(place)), 0, cell_count - 1);
        uint size = texelFetch(cells, cell, 0).r;
        if (size == 0u) break;
        float edge = float(1 << (int(size) - 1));
        vec3 corner = edge * floor(vec3(cell) / edge);
        vec3 leaving = (corner + edge * step(0.0, along) - place) / along;
        t += max(min(leaving.x, min(leaving.y, leaving.z)), 0.0) + 1e-3 / scale;
    }
    return t;
}
#else
float skip(vec3 origin, vec3 direction, float t, float far) { return t; }
#endif
