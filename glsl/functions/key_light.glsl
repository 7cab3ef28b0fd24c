// key_light(): direction to the key light, length 1, model space. The light follows the camera only around the y
// axis, so that shadows stay when the camera tilts, and stays above the floor.
// light: the uniform; camera: columns right, up, back, eye.
vec3 key_light(vec3 light, mat4 camera) {
    vec3 toward = normalize(light);
    vec3 right = camera[0].xyz;
    return normalize(toward.x * right + vec3(0.0, max(toward.y, 0.35), 0.0) + toward.z * vec3(-right.z, 0.0, right.x));
}
