// grid.cuh: the grid of cells that rays skip; in GLSL it is a texture (skip.glsl).
__constant__ const unsigned char *cells;  // [cell_count][cell_count][cell_count] bytes, z y x
__constant__ int cell_count;  // along an edge; 0: no grid
__constant__ float cells_half;  // half the edge of the cube, model units

__device__ inline bool cells_hold() { return cell_count > 0; }

__device__ inline unsigned cell_code(ivec3 cell) {
    ivec3 inside = clamp(cell, 0, cell_count - 1);
    return __ldg(cells + inside.x + cell_count * (inside.y + cell_count * inside.z));
}
