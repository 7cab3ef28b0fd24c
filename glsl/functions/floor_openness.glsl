#define FLOOR_LIGHT
uniform sampler2D floor_light; // output of floor.glsl
uniform vec2 floor_corner; // the block left of and below the tile's first, in blocks from the picture's lower left corner
const float FLOOR_BLOCK = 4.0; // pixels along a block's side
const float FLOOR_BEND = 0.16; // largest second difference between corners, in full light, that allows interpolation; it
                               // is an error of 0.02; in shade, where the eye sees more, less

vec4 at_corner(ivec2 corner) { return texelFetch(floor_light, corner, 0); }

// Second differences of the corners before, at, after, and behind a block's side: the larger one.
vec4 second_difference(vec4 before, vec4 start, vec4 end, vec4 behind) {
    return max(abs(before - 2.0 * start + end), abs(start - 2.0 * end + behind));
}

// floor_openness(): interpolates openness() between the corners of this fragment's block. Returns whether the corners and
// those around them are so nearly linear that `open` is valid.
bool floor_openness(out vec3 open) {
    vec2 place = floor(gl_FragCoord.xy + origin) / FLOOR_BLOCK - floor_corner;
    ivec2 low = ivec2(place), right = ivec2(1, 0), up = ivec2(0, 1);
    vec2 share = place - vec2(low);
    vec4 a = at_corner(low), b = at_corner(low + right), c = at_corner(low + up), d = at_corner(low + right + up);
    open = mix(mix(a, b, share.x), mix(c, d, share.x), share.y).xyz;
    if (scattered || min(min(a.a, b.a), min(c.a, d.a)) == 0.0) return false;
    vec4 across = max(second_difference(at_corner(low - right), a, b, at_corner(low + 2 * right)),
                      second_difference(at_corner(low + up - right), c, d, at_corner(low + up + 2 * right)));
    vec4 along = max(second_difference(at_corner(low - up), a, c, at_corner(low + 2 * up)),
                     second_difference(at_corner(low + right - up), b, d, at_corner(low + right + 2 * up)));
    vec4 most = max(across, along);
    return max(most.x, most.y) < FLOOR_BEND * sqrt(0.5 * (open.x + open.y));
}
