// Places a triangle mesh or a point cloud in front of the camera of the page.
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 color;
layout(location = 3) in vec2 place;
uniform mat4 camera; // columns right, up, back, eye
uniform float focal, aspect, dot_size;
uniform mat3 turn; // from the axes of the file to y up
out vec3 at, outward, tint;
out vec2 uv;
void main() {
    at = turn * position;
    outward = turn * normal;
    tint = color;
    uv = vec2(place.x, 1.0 - place.y); // rows of images begin at the top
    vec3 view = transpose(mat3(camera)) * (at - camera[3].xyz);
    gl_Position = vec4(focal * view.x / aspect, focal * view.y, -1.005 * view.z - 0.1, -view.z); // from 0.05 to 20 units
    gl_PointSize = dot_size / gl_Position.w;
}
