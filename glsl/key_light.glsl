// key_light(): direction to the key light of the studio, length 1, model space. It turns with the camera around the y axis
// alone, so that a look from above or below leaves shadows where they are, and it stays above the floor.
// light: the uniform; camera: columns right, up, back, eye.
vec3 key_light(vec3 light, mat4 camera) {
    vec3 toward = normalize(light);
    vec3 right = camera[0].xyz;
    return normalize(toward.x * right + vec3(0.0, max(toward.y, 0.35), 0.0) + toward.z * vec3(-right.z, 0.0, right.x));
}
