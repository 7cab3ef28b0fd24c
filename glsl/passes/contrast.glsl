#include "srgb.glsl"
// r: contrast of a pixel with its eight neighbors, the largest difference of an sRGB channel or of coverage; a: coverage.
uniform sampler2D picture; // linear light and coverage, one sample per pixel
out vec4 contrast;
void main() {
    ivec2 here = ivec2(gl_FragCoord.xy), last = textureSize(picture, 0) - 1;
    vec4 own = texelFetch(picture, here, 0), least = own, most = own;
    for (int i = 0; i < 9; ++i) {
        vec4 other = texelFetch(picture, clamp(here + ivec2(i % 3, i / 3) - 1, ivec2(0), last), 0);
        least = min(least, other);
        most = max(most, other);
    }
    vec3 range = srgb(most.rgb) - srgb(least.rgb);
    contrast = vec4(max(max(range.r, range.g), max(range.b, most.a - least.a)), 0.0, 0.0, own.a);
}
