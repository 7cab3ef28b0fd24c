#include "fragment.glsl"
void main() {
    color = fragment(gl_FragCoord.xy + origin + jitter);
}
