// ball(): intersection of a ray with a ball around the origin.
// origin, direction: model space, direction of length 1; radius: model units.
// Returns the distances (entry, exit) along the ray; entry > exit if it misses.
vec2 ball(vec3 origin, vec3 direction, float radius) {
    float b = dot(origin, direction);
    float h = b * b - dot(origin, origin) + radius * radius;
    return h < 0.0 ? vec2(1.0, -1.0) : vec2(-sqrt(h), sqrt(h)) - b;
}
