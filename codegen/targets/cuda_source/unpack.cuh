#include "arguments.cuh"
#include "grid.cuh"
// unpack.cuh: unpacks the grid of cells and copies it to the GPU.

// The place in a grid, z y x, of a cell with a given Morton number, whose bits alternate between z, y and x.
inline size_t place_of(size_t number) {
    size_t xyz[3] = {};
    for (int bit = 0; number >> bit; ++bit) xyz[bit % 3] |= (number >> bit & 1u) << bit / 3;
    return xyz[0] + CELL_COUNT * (xyz[1] + CELL_COUNT * xyz[2]);
}

// The grid in the layout of grid.cuh. CELLS is in Morton order, in which the cells of an empty cube are consecutive:
// one byte stores the whole cube.
inline std::vector<unsigned char> unpacked_cells() {
    std::vector<unsigned char> grid(static_cast<size_t>(CELL_COUNT) * CELL_COUNT * CELL_COUNT);
    size_t number = 0;
    for (size_t i = 0; number < grid.size(); ++i) {
        auto code = static_cast<unsigned char>(CELLS[i / 4] >> 8 * (i % 4));
        size_t end = number + (code < CELL_EMPTY ? size_t{1} << 3 * code : 1);
        while (number < end) grid[place_of(number++)] = code;
    }
    return grid;
}

// The grid, if rays may skip cells (last level, its own bands); else an empty one.
inline std::vector<unsigned char> cells_for(const Arguments &a) {
    bool wanted = a.settings.schedule == SCHEDULE_RELAXED && a.settings.level == LEVELS;
    for (int i = 0; i < LEVELS; ++i) wanted = wanted && a.deltas[static_cast<size_t>(i)] == DELTAS[i];
    return wanted ? unpacked_cells() : std::vector<unsigned char>();
}
