// skip() by the grid of cells; skip.glsl explains it. Reads cell_code(), cell_count, cells_half, cells_hold().
const int CELL_READS = 512;
const uint CELL_EMPTY = 8u;
const float CELL_REACH = 1.1258330; // largest value, also of an empty cell
const float CELL_CLOSE = 0.2; // pixels

float cell_value(ivec3 cell) {
    uint code = cell_code(cell);
    return code < CELL_EMPTY ? CELL_REACH : (float(code) / 123.5 - 131.5 / 123.5) * CELL_REACH;
}

// Interpolates between four cells of a layer. share: position between `low` and the next cells in x and y.
float cell_layer(ivec3 low, vec3 share) {
    float nearer = mix(cell_value(low), cell_value(low + ivec3(1, 0, 0)), share.x);
    float farther = mix(cell_value(low + ivec3(0, 1, 0)), cell_value(low + ivec3(1, 1, 0)), share.x);
    return mix(nearer, farther, share.y);
}

// A number that is safe to divide by.
float nonzero(float along) { return along == 0.0 ? 0.000001 : along; }

float skip(vec3 origin, vec3 direction, float t, float far, float footprint, float step_scale, inout vec2 sphere,
           inout int reads) {
    if (!cells_hold()) return t;
    float scale = 0.5 * float(cell_count) / cells_half; // cells per model unit
    vec3 start = scale * (origin + cells_half);
    vec3 along = scale * direction;
    along = vec3(nonzero(along.x), nonzero(along.y), nonzero(along.z));
    while (reads < CELL_READS && t <= far) {
        ++reads;
        vec3 place = start + t * along;
        ivec3 cell = clamp(ivec3(floor(place)), 0, cell_count - 1);
        uint code = cell_code(cell);
        if (code < CELL_EMPTY) {
            float edge = float(1 << int(code));
            vec3 corner = edge * floor(vec3(cell) / edge);
            vec3 leaving = (corner + edge * step(0.0, along) - place) / along;
            sphere = vec2(t, 0.0);
            t += max(min(leaving.x, min(leaving.y, leaving.z)), 0.0) + 0.001 / scale;
        } else {
            vec3 first = floor(place - 0.5);
            vec3 share = place - 0.5 - first;
            float value = mix(cell_layer(ivec3(first), share), cell_layer(ivec3(first) + ivec3(0, 0, 1), share), share.z);
            float free = step_scale * value / scale;
            if (free <= CELL_CLOSE * footprint * t) break;
            sphere = vec2(t, free);
            t += free;
        }
    }
    return t;
}
