// skip(): advances a ray by a grid of cells instead of the field; returns the new distance, at least t.
// origin, direction: model space; t, far: current distance along the ray, and distance at which it leaves the ball.
// footprint, step_scale: see march.glsl. sphere: distance of the last free sphere, and its radius; radius 0: none.
// The grid (field/cells.py) fills a cube around the origin. The texel of an empty cell, below CELL_EMPTY, is
// log2 of the edge, in cells, of the largest aligned empty cube (power-of-2 edge and corners) that contains the cell. Other
// texels encode values at the cells' centers, in cell edges. Interpolated, they never exceed the distance to the surface:
// rays are sphere traced in them up to CELL_CLOSE pixels.
// A ray reads the grid at most CELL_READS times (cells.glsl); reads: number of reads so far.
// NEAR: radius of a free sphere, in gaps, above which an over-relaxed step becomes plain (march.glsl). With a fine grid rays
// take few steps, so plain steps cost little, and over-relaxation past spheres of over a pixel misses a few folds.
// CELLS: the grid is a fine texture. FEW_CELLS: the grid is in the text above, 4 bits per cell, lowest bits first, 0 for an
// empty cell, valid for the last level and the original bands. Without either, nothing is skipped.
#ifdef CELLS
const float NEAR = 1.0;
uniform highp usampler3D cells;
uniform int cell_count; // along an edge; 0: no grid
uniform float cells_half; // half of the cube's edge, model units

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
float skip(vec3 origin, vec3 direction, float t, float far, float footprint, float step_scale, inout vec2 sphere,
           inout int reads) {
    return t;
}
#endif
