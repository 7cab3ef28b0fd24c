#include "place.glsl"
#include "fragment.glsl"
// What main.glsl draws, of any pixels.
void main() {
    color = fragment(place());
}
