// ball(): where a ray meets the ball of a radius around the origin.
// origin, direction: model space, direction of length 1; radius: model units.
// Entry and exit along the ray, entry > exit where it misses.
struct Span {
    float entry, exit;
};

__device__ inline Span ball(vec3 origin, vec3 direction, float radius) {
    float b = dot(origin, direction);
    float h = b * b - dot(origin, origin) + radius * radius;
    return h < 0.0f ? Span{1.0f, -1.0f} : Span{-sqrtf(h) - b, sqrtf(h) - b};
}
