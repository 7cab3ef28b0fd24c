// The vertices of a pass that draws where the pass before it says so, for drivers that run a fragment shader first and
// test the depth afterwards: two triangles for each block of 8 x 8 pixels of a tile. They collapse where no pixel of the
// block has an alpha of over 0.
uniform sampler2D rays; // what the pass before wrote
uniform bool everywhere; // all blocks are drawn
uniform ivec4 viewport; // x, y, width, height of the tile in the target, pixels
const int SIDE = 8;

void main() {
    int block = gl_VertexID / 6, across = (viewport.z + SIDE - 1) / SIDE, k = gl_VertexID % 6;
    ivec2 corner = SIDE * ivec2(block % across, block / across);
    ivec2 size = min(ivec2(SIDE), viewport.zw - corner);
    bool wanted = everywhere;
    for (int i = 0; i < size.x * size.y && !wanted; ++i)
        wanted = texelFetch(rays, viewport.xy + corner + ivec2(i % size.x, i / size.x), 0).a > 0.0;
    k = k < 3 ? k : k - 2; // of the block's corners, 0, 1, 2 make one triangle and 1, 2, 3 the other
    vec2 place = vec2(corner + int(wanted) * size * ivec2(k & 1, k >> 1)) / vec2(viewport.zw);
    gl_Position = vec4(2.0 * place - 1.0, 0.0, 1.0);
}
