// background(): soft vertical gradient, sRGB, darker towards the corners.
// pixel, resolution: pixels, origin bottom left; bottom, top: sRGB.
vec3 background(vec2 pixel, vec2 resolution, vec3 bottom, vec3 top) {
    vec2 plane = pixel / resolution;
    vec2 corner = plane - 0.5;
    return mix(bottom, top, smoothstep(0.0, 1.0, plane.y)) * (1.0 - 0.35 * dot(corner, corner));
}
