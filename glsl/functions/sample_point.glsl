uniform bool scattered; // whether fragments sample scattered points instead of the pixels of a tile
uniform sampler2D points; // the scattered points, pixels of the image, origin bottom left

// sample_point(): the point of the image that this fragment samples.
vec2 sample_point() {
    return scattered ? texelFetch(points, ivec2(gl_FragCoord.xy), 0).xy : gl_FragCoord.xy + origin + jitter;
}
