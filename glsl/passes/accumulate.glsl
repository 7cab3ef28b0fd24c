#include "linear.glsl"
// Decodes one sample of a tile, sRGB, to linear light; blending adds it to the picture.
uniform sampler2D tile;
uniform ivec2 corner;
uniform bool covered; // alpha is the sample's coverage, not 1
out vec4 light;
void main() {
    vec4 sampled = texelFetch(tile, ivec2(gl_FragCoord.xy) - corner, 0);
    light = vec4(linear(sampled.rgb), covered ? sampled.a : 1.0);
}
