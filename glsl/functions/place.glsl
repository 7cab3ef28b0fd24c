uniform bool scattered; // whether fragments sample scattered points instead of the pixels of a tile
uniform sampler2D places; // the scattered points, pixels of the image, origin bottom left

// place(): the point of the image that this fragment samples.
vec2 place() {
    return scattered ? texelFetch(places, ivec2(gl_FragCoord.xy), 0).xy : gl_FragCoord.xy + origin + jitter;
}
