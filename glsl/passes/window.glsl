#include "dither.glsl"
#include "srgb.glsl"
// Draws the window's picture onto the screen: the fine picture where it has samples, elsewhere the coarse one.
uniform sampler2D coarse; // sRGB
uniform sampler2D fine; // sums of linear light; alpha: number of samples
uniform vec2 corner; // of the picture on the screen, pixels
uniform vec2 size; // of the picture on the screen, pixels
uniform float divider; // column with a line between the halves of a split picture; below -1: none
uniform bool dithered;
out vec4 color;
void main() {
    vec2 place = (gl_FragCoord.xy - corner) / size;
    vec4 sum = texture(fine, place);
    color = sum.a > 0.0 ? vec4(srgb(sum.rgb / sum.a), 1.0) : vec4(texture(coarse, place).rgb, 1.0);
    if (dithered) color.rgb += dither(gl_FragCoord.xy);
    if (abs(gl_FragCoord.x - corner.x - divider) < 1.0) color.rgb = mix(color.rgb, vec3(1.0), 0.55);
}
