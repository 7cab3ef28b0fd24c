#include "srgb.glsl"
// The picture, linear light, at the size of what it is drawn to: the canvas, or (encoded false) a larger picture.
uniform sampler2D picture;
uniform vec2 size;
uniform bool encoded;
out vec4 color;
void main() {
    vec3 light = texture(picture, gl_FragCoord.xy / size).rgb;
    // Half a step of 8 bits, up or down (Jimenez 2014, interleaved gradient noise): no bands in the background.
    float noise = fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715)))) - 0.5;
    color = vec4(encoded ? srgb(light) + noise / 255.0 : light, 1.0);
}
