// Vertices of a pass that draws only where an earlier pass has set the mask, for drivers that test the depth after the
// fragment shader: one point for each block of 2 x 2 pixels, which such drivers shade at once. Blocks without a wanted
// pixel are dropped.
uniform sampler2D mask; // output of the earlier pass
uniform float wanted; // a pixel is wanted if its alpha in `mask` has this sign
uniform bool everywhere; // draw all blocks
uniform ivec4 viewport; // x, y, width, height of the tile in the target, pixels
const int SIDE = 2;

void main() {
    int across = (viewport.z + SIDE - 1) / SIDE;
    ivec2 corner = SIDE * ivec2(gl_VertexID % across, gl_VertexID / across);
    ivec2 size = min(ivec2(SIDE), viewport.zw - corner);
    bool draws = everywhere;
    for (int i = 0; i < size.x * size.y && !draws; ++i)
        draws = wanted * texelFetch(mask, viewport.xy + corner + ivec2(i % size.x, i / size.x), 0).a > 0.0;
    vec2 middle = vec2(corner + SIDE / 2) / vec2(viewport.zw);
    gl_Position = vec4(2.0 * middle - 1.0, draws ? 0.0 : 2.0, 1.0);
    gl_PointSize = float(SIDE);
}
