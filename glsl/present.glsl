#include "dither.glsl"
#include "srgb.glsl"
// Scales the picture, linear light, to the canvas or, if `encoded` is false, to a larger picture.
uniform sampler2D picture;
uniform vec2 size;
uniform bool encoded;
out vec4 color;
void main() {
    vec3 light = texture(picture, gl_FragCoord.xy / size).rgb;
    color = vec4(encoded ? srgb(light) + dither(gl_FragCoord.xy) : light, 1.0);
}
