uniform bool scattered; // whether the fragments are samples of any pixels, not of a tile's one after the other
uniform sampler2D places; // where in the image each of these lies, pixels, origin bottom left

// place(): the point of the image that this fragment's ray goes through.
vec2 place() {
    return scattered ? texelFetch(places, ivec2(gl_FragCoord.xy), 0).xy : gl_FragCoord.xy + origin + jitter;
}
