#include "background.glsl"
// The fragment behind a mesh: main.glsl's background alone. color.a is 0. SHADE_DATA, 5, writes (0, 0, 0, 0) instead.
void main() {
    vec2 pixel = gl_FragCoord.xy + origin + jitter;
    color = vec4(background(pixel, resolution, background_bottom, background_top), 0.0);
    if (shading == 5) color = vec4(0.0);
}
