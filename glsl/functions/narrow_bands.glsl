// half_width(): half-width of a level's band at p, model space, as narrow as the shape allows there. Reads delta[] and
// narrow_bands[]: factors on delta in 8^3 cells of the cube from -1 to 1, for each level but
// the last (field/half_widths.py). A number has a row of cells along x, 4 bits each, lowest bits first.
float half_width(vec3 p, int level) {
    if (level == LEVELS) return delta[level - 1];
    ivec3 cell = clamp(ivec3(floor(4.0 * (p + 1.0))), 0, 7);
    uint row = narrow_bands[64 * (level - 1) + 8 * cell.z + cell.y];
    return delta[level - 1] * float(row >> uint(4 * cell.x) & 15u) / 15.0;
}
