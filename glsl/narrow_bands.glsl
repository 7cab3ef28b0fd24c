// half_width(): half the width of a level's band at a point p, model space, which is as narrow as the place allows. Reads
// delta[] and narrow_bands[]: shares of it in 8^3 cells of the cube from -1 to 1, for one level after the other before
// the last (field/narrow.py). A number has the cells of a row along x, 4 bits each, from the lowest ones up.
float half_width(vec3 p, int level) {
    if (level == LEVELS) return delta[level - 1];
    ivec3 cell = clamp(ivec3(floor(4.0 * (p + 1.0))), 0, 7);
    uint row = narrow_bands[64 * (level - 1) + 8 * cell.z + cell.y];
    return delta[level - 1] * float(row >> uint(4 * cell.x) & 15u) / 15.0;
}
