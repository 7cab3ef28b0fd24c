#include "dither.glsl"
#include "srgb.glsl"
#include "camera_ray.glsl"
// Scales the picture, linear light, to the canvas or, if `encoded` is false, to a larger picture.
// If `turned`, the picture is an earlier one, and is reprojected to the present camera: its pixels are taken for points of a
// plane through the origin that faces the camera, with a bulge inside the unit ball. earlier, camera: columns right, up,
// back, eye.
const float BULGE = 0.4; // height of the bulge, model units; a half ball would tear what stands out of it
uniform sampler2D picture;
uniform vec2 size;
uniform bool encoded;
uniform bool turned;
uniform mat4 earlier, camera;
uniform float focal;
out vec4 color;

// The place in the earlier picture, from 0 to 1, of a pixel.
vec2 earlier_place(vec2 pixel) {
    vec3 eye = camera[3].xyz, back = camera[2].xyz, direction = camera_ray(pixel, size, camera, focal);
    float t = -dot(eye, back) / min(dot(direction, back), -0.01);
    vec3 p = eye + t * direction;
    p -= BULGE * max(1.0 - dot(p, p), 0.0) * direction;
    vec3 view = (p - earlier[3].xyz) * mat3(earlier);
    return 0.5 + 0.5 * focal * view.xy / max(-view.z, 0.01) * vec2(size.y / size.x, 1.0);
}

void main() {
    vec2 place = turned ? earlier_place(gl_FragCoord.xy) : gl_FragCoord.xy / size;
    vec3 light = texture(picture, place).rgb;
    color = vec4(encoded ? srgb(light) + dither(gl_FragCoord.xy) : light, 1.0);
}
