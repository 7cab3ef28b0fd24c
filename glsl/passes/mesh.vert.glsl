// The vertex of a mesh: main.glsl's camera as a projection onto one tile of the picture.
// position, normal: model space; viewport: x, y, width, height, pixels; planes: near and far, along the view, model units.
uniform vec2 resolution, origin, jitter, planes = vec2(1.0, 8.0);
uniform vec4 viewport;
uniform mat4 camera;
uniform float focal;
in vec3 position;
in vec3 normal;
out vec3 point;
out vec3 own;
invariant gl_Position; // so that depths agree in every program that draws the mesh

void main() {
    point = position;
    own = normal;
    vec3 view = (position - camera[3].xyz) * mat3(camera);
    // Pixel in the tile, and depth between the planes, both multiplied by the distance -view.z.
    vec2 pixel = 0.5 * (focal * resolution.y * view.xy - view.z * resolution) + view.z * (viewport.xy + origin + jitter);
    float depth = -((planes.x + planes.y) * view.z + 2.0 * planes.x * planes.y) / (planes.y - planes.x);
    gl_Position = vec4(2.0 * pixel / viewport.zw + view.z, depth, -view.z);
}
