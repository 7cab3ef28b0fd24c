#version 330 core
// The vertex of a mesh: the camera of main.glsl as a projection, onto one tile of the picture.
// position, normal: model space; tile: size of the viewport, pixels; planes: near and far, along the view, model units.
uniform vec2 resolution, origin, jitter, tile, planes = vec2(1.0, 8.0);
uniform mat4 camera;
uniform float focal;
in vec3 position;
in vec3 normal;
out vec3 point;
out vec3 own;

void main() {
    point = position;
    own = normal;
    vec3 view = (position - camera[3].xyz) * mat3(camera);
    // Pixel inside the tile, and depth between the planes; both times the distance -view.z.
    vec2 pixel = 0.5 * (focal * resolution.y * view.xy - view.z * resolution) + view.z * (origin + jitter);
    float depth = -((planes.x + planes.y) * view.z + 2.0 * planes.x * planes.y) / (planes.y - planes.x);
    gl_Position = vec4(2.0 * pixel / tile + view.z, depth, -view.z);
}
