#include "linear.glsl"
// Decodes a scattered sample, sRGB, to linear light, as accumulate.glsl does for the samples of a tile.
uniform sampler2D tile;
flat in ivec2 from;
out vec4 light;
void main() {
    light = vec4(linear(texelFetch(tile, from, 0).rgb), 1.0);
}
