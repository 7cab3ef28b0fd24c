#include "pixel_color.glsl"
void main() {
    color = pixel_color(gl_FragCoord.xy + origin + jitter);
}
