// background(): soft vertical gradient, sRGB, darker towards the corners.
__device__ inline vec3 background(const Settings &s, int pixel) {
    float x = (static_cast<float>(pixel % s.width) + 0.5f) / static_cast<float>(s.width);
    float y = (static_cast<float>(pixel / s.width) + 0.5f) / static_cast<float>(s.height);
    float corner = (x - 0.5f) * (x - 0.5f) + (y - 0.5f) * (y - 0.5f);
    return (1.0f - 0.35f * corner) * mix(s.background_bottom, s.background_top, smoothstep(0.0f, 1.0f, y));
}
