// Shades a triangle mesh or a point cloud as the page shades the field. Normals are smooth, except across sharp edges.
#include "phong.glsl"
#include "linear.glsl"
#include "srgb.glsl"
in vec3 at, outward, tint;
in vec2 uv;
uniform mat4 camera;
uniform vec3 light; // camera space
uniform bool faces, textured, plain, normals;
uniform vec3 factor; // of the texture, sRGB
uniform sampler2D image;
out vec4 color;
const float SHARP = 0.85; // cosine between smooth and flat normal at which an edge is sharp
void main() {
    vec3 view = normalize(camera[3].xyz - at), normal = normalize(outward);
    if (faces) {
        vec3 flat_normal = normalize(cross(dFdx(at), dFdy(at)));
        if (!gl_FrontFacing) normal = -normal;
        if (!(dot(normal, flat_normal) > SHARP)) normal = flat_normal;
    } else if (dot(normal, view) < 0.0) {
        discard;
    }
    vec3 base = textured ? factor * texture(image, uv).rgb : tint;
    mat3 basis = mat3(camera);
    color = vec4(normals ? 0.5 + 0.5 * normal : plain ? base
        : srgb(phong(linear(base), normal, view, normalize(basis * light), basis[1])), 1);
}
