// The depth of a model, for the shadows of three.js.
#include <packing>

void main() {
    traced_hull();
    gl_FragColor = packDepthToRGBA(gl_FragDepth);
}
