// background(): vertical gradient, sRGB. A dark gradient gets darker toward the corners.
// pixel, resolution: pixels, origin bottom left; bottom, top: sRGB.
vec3 background(vec2 pixel, vec2 resolution, vec3 bottom, vec3 top) {
    vec2 plane = pixel / resolution;
    vec2 corner = plane - 0.5;
    float dark = 1.0 - smoothstep(0.45, 0.75, dot(bottom + top, vec3(1.0 / 6.0)));
    return mix(bottom, top, smoothstep(0.0, 1.0, plane.y)) * (1.0 - 0.35 * dark * dot(corner, corner));
}
