#include "background.glsl"
#include "shadings.glsl"
// The fragment behind a mesh: main.glsl's background alone. color.a is 0. SHADE_DATA writes (0, 0, 0, 0) instead.
void main() {
    vec2 pixel = gl_FragCoord.xy + origin + jitter;
    color = vec4(background(pixel, resolution, background_bottom, background_top), 0.0);
    if (shading == SHADE_DATA) color = vec4(0.0);
}
