#include "linear.glsl"
// One sample of a tile, sRGB, on its way into the picture, which is linear light; the mean is the blending's.
uniform sampler2D tile;
uniform ivec2 corner;
out vec4 light;
void main() {
    light = vec4(linear(texelFetch(tile, ivec2(gl_FragCoord.xy) - corner, 0).rgb), 1.0);
}
