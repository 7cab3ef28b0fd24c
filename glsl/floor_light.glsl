#define FLOOR_LIGHT
uniform sampler2D floor_light; // output of floor.glsl
uniform vec2 floor_corner; // the tile's first block, counted in blocks from the picture's lower left corner
const float FLOOR_BLOCK = 4.0; // pixels along a block's side
const float FLOOR_SPREAD = 0.05; // largest difference between a block's corners that allows interpolation

// floor_openness(): interpolates openness() between the corners of this fragment's block. Returns whether the corners
// differ so little that `open` is valid.
bool floor_openness(out vec3 open) {
    vec2 place = floor(gl_FragCoord.xy + origin) / FLOOR_BLOCK - floor_corner;
    ivec2 low = ivec2(place);
    vec2 share = place - vec2(low);
    vec4 a = texelFetch(floor_light, low, 0), b = texelFetch(floor_light, low + ivec2(1, 0), 0);
    vec4 c = texelFetch(floor_light, low + ivec2(0, 1), 0), d = texelFetch(floor_light, low + ivec2(1, 1), 0);
    vec4 least = min(min(a, b), min(c, d)), spread = max(max(a, b), max(c, d)) - least;
    open = mix(mix(a, b, share.x), mix(c, d, share.x), share.y).xyz;
    return !scattered && least.a > 0.0 && max(spread.x, spread.y) < FLOOR_SPREAD;
}
