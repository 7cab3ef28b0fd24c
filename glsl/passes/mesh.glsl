#include "shade.glsl"
#include "key_light.glsl"
#include "openness.glsl"
#include "softbox.glsl"
#include "base_color.glsl"
uniform float split; // share of the width, from the left, with the mesh's own normals
in vec3 point; // model space
in vec3 own; // the mesh's normal, of any length

// The fragment of a mesh: neural normal mapping (Section 3.2, Appendix D), a level's gradient at a point of the triangle.
// color.rgb is sRGB, color.a is 1. SHADE_DATA writes (t, 0, 0, 1) instead.
void main() {
    // Outside of the `if`: software GL masks branches instead of skipping them.
    vec3 normal = field_gradient(point, normal_level).xyz;
    if (gl_FragCoord.x + origin.x + jitter.x < split * resolution.x) normal = own;
    vec3 eye = camera[3].xyz;
    float t = distance(point, eye);
    vec3 direction = (point - eye) / t;
    normal = dot(normal, normal) > 0.0 ? normalize(normal) : -direction;
    vec3 toward = normalize(mat3(camera) * light), albedo = base_color(point);
    color = vec4(shade(shading, normal, direction, t, length(eye), 0, albedo, toward, camera[1].xyz), 1.0);
    if (shading == SHADE_SOFTBOX) {
        toward = key_light(light, camera);
        vec3 open = openness(point, normal, toward, ground, false);
        color.rgb = srgb(softbox(linear(albedo), normal, -direction, toward, open, delta[0], point.y - ground));
    }
    if (shading == SHADE_DATA) color = vec4(t, 0.0, 0.0, 1.0);
}
