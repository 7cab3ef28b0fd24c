#include "linear.glsl"
// A sample at any place, sRGB, on its way into the picture, as accumulate.glsl brings those of a tile.
uniform sampler2D tile;
flat in ivec2 from;
out vec4 light;
void main() {
    light = vec4(linear(texelFetch(tile, from, 0).rgb), 1.0);
}
