// skip(): how far along a ray the surface may be, by a grid that is looked at in place of the field; t itself at least.
// origin, direction: model space; t, far: distances along the ray, at which it is and at which it leaves the ball.
// footprint, step_scale: see march.glsl. before: where the last free sphere is along the ray, and its radius; 0: none.
// The grid (field/cells.py) fills a cube around the origin. The texel of an empty cell, below CELL_EMPTY, is
// the binary logarithm of the edge, in cells, of the largest empty cube that holds it, of those whose edges and corners are
// multiples of a power of 2. The others stand for values in the cells' middles, in edges of a cell. Between these, they
// are no more than the distance to the surface: rays are sphere traced in them up to CELL_CLOSE pixels.
// A ray looks at the grid CELL_LOOKS times at most (cells.glsl); looks: how often it has.
// NEAR: gaps: radius of a free sphere above which a relaxed step is a plain one (march.glsl). With a fine grid rays take so
// few steps that plain ones cost little, and past spheres of over a pixel a few rays miss a fold.
// CELLS: the grid is a texture, and fine. FEW_CELLS: the text before has it, of 4 bits for a cell, from the lowest ones up,
// 0 for an empty one; it is of the last level with the bands as they were. Without both there is none, and nothing is
// skipped.
#ifdef CELLS
const float NEAR = 1.0;
uniform highp usampler3D cells;
uniform int cell_count; // along an edge; 0: no grid, nothing is skipped
uniform float cells_half; // half the edge of the cube, model units

uint cell_code(ivec3 cell) { return texelFetch(cells, clamp(cell, 0, cell_count - 1), 0).r; }

bool cells_hold() { return cell_count > 0; }
#else
const float NEAR = 2.0;
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
#include "cells.glsl"
#else
float skip(vec3 origin, vec3 direction, float t, float far, float footprint, float step_scale, inout vec2 before,
           inout int looks) {
    return t;
}
#endif
