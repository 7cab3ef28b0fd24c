// skip(): how far along a ray the surface may be, by a grid that is looked at in place of the field; t itself at least.
// origin, direction: model space; t, far: distances along the ray, at which it is and at which it leaves the ball.
// footprint, step_scale: see march.glsl. before: where the last free sphere is along the ray, and its radius; 0: none.
// The grid (codegen/reference/cells.py) fills a cube around the origin. The texel of an empty cell, below CELL_EMPTY, is
// the binary logarithm of the edge, in cells, of the largest empty cube that holds it, of those whose edges and corners are
// multiples of a power of 2. The others stand for values in the cells' middles, in edges of a cell. Between these, they
// are no more than the distance to the surface: rays are sphere traced in them up to CELL_CLOSE pixels.
// A fragment looks at the grid CELL_LOOKS times at most.
// CELLS: the grid is a texture. FEW_CELLS: the text before has it, of 4 bits for a cell, from the lowest ones up, 0 for an
// empty one; it is of the last level with the bands as they were. Without both there is none, and nothing is skipped.
#ifdef CELLS
uniform highp usampler3D cells;
uniform int cell_count; // along an edge; 0: no grid, nothing is skipped
uniform float cells_half; // half the edge of the cube, model units

uint cell_code(ivec3 cell) { return texelFetch(cells, clamp(cell, 0, cell_count - 1), 0).r; }

bool cells_hold() { return cell_count > 0; }
#endif
#ifdef FEW_CELLS
uint cell_code(ivec3 cell) {
    ivec3 inside = clamp(cell, 0, cell_count - 1);
    int i = inside.x + cell_count * (inside.y + cell_count * inside.z);
    uint code = few_cells[i >> 3] >> uint(4 * (i & 7)) & 15u;
    return code == 0u ? 0u : 8u + (code - 1u) * 247u / 14u;
}

bool cells_hold() { return level == LEVELS && delta[0] == CELLS_DELTA; }
#define CELLS
#endif
#ifdef CELLS
const int CELL_LOOKS = 512;
const uint CELL_EMPTY = 8u;
const float CELL_REACH = 1.1258330; // largest value, of an empty cell, too
const float CELL_CLOSE = 0.2; // pixels
int cell_looks = 0;

float cell_value(ivec3 cell) {
    uint code = cell_code(cell);
    return code < CELL_EMPTY ? CELL_REACH : (float(code) / 123.5 - 131.5 / 123.5) * CELL_REACH;
}

// Values between four cells of a layer: share of the way from `low` to the next ones in x and y.
float cell_layer(ivec3 low, vec2 share) {
    float nearer = mix(cell_value(low), cell_value(low + ivec3(1, 0, 0)), share.x);
    float farther = mix(cell_value(low + ivec3(0, 1, 0)), cell_value(low + ivec3(1, 1, 0)), share.x);
    return mix(nearer, farther, share.y);
}

float skip(vec3 origin, vec3 direction, float t, float far, float footprint, float step_scale, inout vec2 before) {
    if (!cells_hold()) return t;
    float scale = 0.5 * float(cell_count) / cells_half; // cells per model unit
    vec3 start = scale * (origin + cells_half), along = scale * direction;
    along += vec3(equal(along, vec3(0.0))) * 1e-6;
    while (cell_looks < CELL_LOOKS && t <= far) {
        ++cell_looks;
        vec3 place = start + t * along;
        ivec3 cell = clamp(ivec3(floor(place)), 0, cell_count - 1);
        uint code = cell_code(cell);
        if (code < CELL_EMPTY) {
            float edge = float(1 << int(code));
            vec3 corner = edge * floor(vec3(cell) / edge);
            vec3 leaving = (corner + edge * step(0.0, along) - place) / along;
            before = vec2(t, 0.0);
            t += max(min(leaving.x, min(leaving.y, leaving.z)), 0.0) + 1e-3 / scale;
        } else {
            vec3 first = floor(place - 0.5), share = place - 0.5 - first;
            float value = mix(
                cell_layer(ivec3(first), share.xy), cell_layer(ivec3(first) + ivec3(0, 0, 1), share.xy), share.z);
            float free = step_scale * value / scale;
            if (free <= CELL_CLOSE * footprint * t) break;
            before = vec2(t, free);
            t += free;
        }
    }
    return t;
}
#else
float skip(vec3 origin, vec3 direction, float t, float far, float footprint, float step_scale, inout vec2 before) {
    return t;
}
#endif
