#version 330 core
// {"mplicits": "VERSION", "target": "glsl330", "name": "tiny \"/*\n</script>\\", "sha256": "6372a336b13b", "levels": ["4x1", "8x0"], "value_loops": [0, 0], "gradient_loops": [0, 0], "iterations": [20, 5], "deltas": [1.0, 0.5], "texture_loops": 0, "textured": true, "ground": -0.9655}
// Multiscale neural signed distance function. Model space: the shape fits the unit sphere. Every uniform has a default; draw a triangle over the image.

const int LEVELS = 2;
const float GROUND = -.9655; // of the shape's lowest point
uniform vec2 resolution = vec2(512); // size of the image, pixels; set this one
uniform vec2 origin = vec2(0); // offset of this tile in the image, pixels
uniform vec2 jitter = vec2(0); // offset of the sample in its pixel, pixels, [-0.5, 0.5)
uniform mat4 camera = mat4(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 3.4, 1); // camera to model space: columns right, up, back, eye
uniform float focal = 2.75; // 1 / tan(fov / 2), vertical
uniform int level = LEVELS; // traced level
uniform int normal_level = LEVELS; // level whose gradient is the normal
uniform int iterations[LEVELS] = int[](20, 5); // sphere tracing steps at each level, per round
uniform int rounds = 64; // most passes over the levels
uniform float delta[LEVELS] = float[](1., .5); // band half-width of each level, model units
uniform float step_bound[LEVELS] = float[](.8, .8); // factor on each level's steps if it is the traced level
uniform float band_step_bound[LEVELS] = float[](.8, .8); // factor on each level's steps if a finer level is traced
uniform float step_scale = 1.; // further factor on every step; below 1: safer, slower
uniform int schedule = 1; // sphere tracing: 0 plain, 1 over-relaxed
uniform int shading = 0; // 0 phong, 1 normal, 2 depth, 3 steps, 4 texture, 5 softbox, 6 data: (t, steps, level, hit)
uniform float ground = GROUND; // height of the floor of the shading softbox, model space, y up
uniform vec3 light = vec3(-0.5, 0.7, 0.8); // direction to the light, camera space
uniform vec3 background_bottom = vec3(0.13, 0.14, 0.17); // sRGB
uniform vec3 background_top = vec3(0.33, 0.36, 0.41); // sRGB
out vec4 color;
// half_width(): half-width of a level's band at a point p, model space. Reads delta[]. narrow_bands.glsl replaces this file
// if the half-width depends on p.
float half_width(vec3 p, int level) { return delta[level - 1]; }

const mat4 w1_0_0_0 = mat4(.913, -3.223, .711, 2.9, -1.535, 2.088, 1.53, 2.106, -3.06, 2.752, .291, -3.315, .715, -.933, .459, -.649);
const mat4 w1_1_0_0 = mat4(.89, -1.155, .283, .454, .102, -.92, -.285, .369, -.491, .418, 1.218, .462, -.189, .361, 1.178, -.272);
const vec4 b1_1_0 = vec4(-.73, .443, .051, -.38);
const vec4 o1_0_0 = vec4(-.035, .954, 1.063, -.348);
const mat4 w2_0_0_0 = mat4(-1.188, -.723, .821, 1.914, .629, 2.602, -2.773, -1.738, -1.081, -1.819, 2.218, 2.51, .344, -.601, .884, -.27);
const mat4 w2_0_1_0 = mat4(-2.943, -.331, -2.987, -2.728, -1.093, 1.975, -.636, .536, -2.331, -1.796, -2.01, -1.342, -.789, .258, .854, -.119);
const vec4 o2_0_0 = vec4(7.874, -.002, -1.295, 2.082);
const vec4 o2_0_1 = vec4(8.575, 7.776, -.692, 4.464);
const mat4 wt_0_0_0 = mat4(.195, 1.563, -2.567, 3.12, 1.905, 1.408, 1.527, -3.235, -.569, 2.88, 2.849, 2.424, .962, .914, -.702, .945);
const vec4 ot_0_0 = vec4(9.551, 7.897, -.49, -6.555);
const vec4 ot_1_0 = vec4(.739, 1.037, -.573, .095);
const vec4 ot_2_0 = vec4(-.14, 1.056, -1.126, .568);

float network1(vec4 p) {
    vec4 a0 = w1_0_0_0 * p;
    vec4 h0 = sin(a0);
    vec4 a1 = b1_1_0;
    a1 += w1_1_0_0 * h0;
    vec4 h1 = sin(a1);
    float f = .14306;
    f += dot(o1_0_0, h1);
    return f;
}

float network2(vec4 p) {
    vec4 a0_0 = w2_0_0_0 * p;
    vec4 a0_1 = w2_0_1_0 * p;
    vec4 h0_0 = sin(a0_0);
    vec4 h0_1 = sin(a0_1);
    float f = dot(o2_0_0, h0_0);
    f += dot(o2_0_1, h0_1);
    f = .1 * f + -.00515;
    return f;
}

vec4 network1_gradient(vec4 p) {
    vec4 a0 = w1_0_0_0 * p;
    vec4 h0 = sin(a0);
    vec4 a1 = b1_1_0;
    a1 += w1_1_0_0 * h0;
    vec4 h1 = sin(a1);
    float f = .14306;
    f += dot(o1_0_0, h1);
    vec4 c1 = cos(a1);
    vec4 g1 = o1_0_0 * c1;
    vec4 e1 = g1 * w1_1_0_0;
    vec4 c0 = cos(a0);
    vec4 g0 = e1 * c0;
    vec4 gradient = g0 * w1_0_0_0;
    return vec4(gradient.xyz, f);
}

vec4 network2_gradient(vec4 p) {
    vec4 a0_0 = w2_0_0_0 * p;
    vec4 a0_1 = w2_0_1_0 * p;
    vec4 h0_0 = sin(a0_0);
    vec4 h0_1 = sin(a0_1);
    float f = dot(o2_0_0, h0_0);
    f += dot(o2_0_1, h0_1);
    f = .1 * f + -.00515;
    vec4 c0_0 = cos(a0_0);
    vec4 c0_1 = cos(a0_1);
    vec4 g0_0 = o2_0_0 * c0_0;
    vec4 g0_1 = o2_0_1 * c0_1;
    vec4 e0 = g0_0 * w2_0_0_0;
    e0 += g0_1 * w2_0_1_0;
    vec4 gradient = .1 * e0;
    return vec4(gradient.xyz, f);
}

vec3 network_texture(vec4 p) {
    vec4 a0 = wt_0_0_0 * p;
    vec4 h0 = sin(a0);
    float r = dot(ot_0_0, h0);
    r = .1 * r + .22875;
    float g = -.94327;
    g += dot(ot_1_0, h0);
    float b = .43844;
    b += dot(ot_2_0, h0);
    return vec3(r, g, b);
}

float field(vec3 p, int level, out int reached) {
    vec4 q = vec4(p, 1.);
    float f = network1(q);
    reached = 1;
    if (reached == 1 && level > 1 && abs(f) < delta[0]) {
        f += network2(q);
        reached = 2;
    }
    return f;
}

vec4 field_gradient(vec3 p, int level) {
    vec4 q = vec4(p, 1.);
    vec4 g = network1_gradient(q);
    if (level > 1) g += network2_gradient(q);
    return g;
}

vec3 albedo(vec3 p) {
    return clamp(network_texture(vec4(p, 1.)), 0., 1.);
}

#define FEW_CELLS // how near the surface is, in a grid; see skip()
const int cell_count = 8;
const float cells_half = 2.;
const float CELLS_DELTA = 1.;
const uint few_cells[64] = uint[](
1192366353u,3239121169u,1896943889u,286331153u,287510801u,287510801u,292426001u,3323793681u,
286593300u,286331159u,286331157u,554799377u,564728081u,581505297u,291574033u,1360072977u,
286331153u,286331153u,286331153u,2165444881u,3608809745u,3608690961u,309399825u,292622609u,
286331409u,286331409u,286331153u,1141969169u,286593297u,293130513u,292622609u,393285905u,
286331153u,286331153u,2165380113u,286332689u,295770385u,295770897u,296317209u,823202065u,
286331153u,286331153u,286331201u,286332529u,286333457u,286333713u,286527772u,286331165u,
286332833u,286331345u,345051585u,293671185u,286351633u,286352145u,286331340u,286331153u,
286331153u,1997607185u,3926988561u,3574665489u,286335256u,286662936u,286333559u,353443089u
);
// camera_ray(): direction of the ray through a point of the image; length 1, model space.
// pixel, resolution: pixels, origin bottom left; camera: columns right, up, back, eye; focal: 1 / tan(fov / 2), vertical.
vec3 camera_ray(vec2 pixel, vec2 resolution, mat4 camera, float focal) {
    vec2 plane = (2.0 * pixel - resolution) / resolution.y;
    return normalize(mat3(camera) * vec3(plane, -focal));
}
// skip(): advances a ray by a grid of cells instead of the field; returns the new distance, at least t.
// origin, direction: model space; t, far: current distance along the ray, and distance at which it leaves the ball.
// footprint, step_scale: see march.glsl. sphere: distance of the last free sphere, and its radius; radius 0: none.
// The grid (field/cells.py) fills a cube around the origin. The texel of an empty cell, below CELL_EMPTY, is
// log2 of the edge, in cells, of the largest aligned empty cube (power-of-2 edge and corners) that contains the cell. Other
// texels encode values at the cells' centers, in cell edges. Interpolated, they never exceed the distance to the surface:
// rays are sphere traced in them up to CELL_CLOSE pixels.
// A ray reads the grid at most CELL_READS times (cells.glsl); reads: number of reads so far.
// NEAR: radius of a free sphere, in gaps, above which an over-relaxed step becomes plain (march.glsl). With a fine grid rays
// take few steps, so plain steps cost little, and over-relaxation past spheres of over a pixel misses a few folds.
// CELLS: the grid is a fine texture. FEW_CELLS: the grid is in the text above, 4 bits per cell, lowest bits first, 0 for an
// empty cell, valid for the last level and the original bands. Without either, nothing is skipped.
#ifdef CELLS
const float NEAR = 1.0;
uniform highp usampler3D cells;
uniform int cell_count; // along an edge; 0: no grid
uniform float cells_half; // half of the cube's edge, model units

uint cell_code(ivec3 cell) { return texelFetch(cells, clamp(cell, 0, cell_count - 1), 0).r; }

bool cells_hold() { return cell_count > 0; }
#else
const float NEAR = 2.0;
#endif
#ifdef FEW_CELLS
uint cell_code(ivec3 cell) {
    ivec3 inside = clamp(cell, 0, cell_count - 1);
    int i = inside.x + cell_count * (inside.y + cell_count * inside.z);
    uint code = few_cells[i >> 3] >> uint(4 * (i & 7)) & 15u;
    return code == 0u ? 0u : 8u + (code - 1u) * 247u / 14u;
}

bool cells_hold() { return level == LEVELS && delta[0] == CELLS_DELTA; }
#define CELLS
#endif
#ifdef CELLS
// skip() by the grid of cells; skip.glsl explains it. Reads cell_code(), cell_count, cells_half, cells_hold().
const int CELL_READS = 512;
const uint CELL_EMPTY = 8u;
const float CELL_REACH = 1.1258330; // largest value, also of an empty cell
const float CELL_CLOSE = 0.2; // pixels

float cell_value(ivec3 cell) {
    uint code = cell_code(cell);
    return code < CELL_EMPTY ? CELL_REACH : (float(code) / 123.5 - 131.5 / 123.5) * CELL_REACH;
}

// Interpolates between four cells of a layer. share: position between `low` and the next cells in x and y.
float cell_layer(ivec3 low, vec3 share) {
    float nearer = mix(cell_value(low), cell_value(low + ivec3(1, 0, 0)), share.x);
    float farther = mix(cell_value(low + ivec3(0, 1, 0)), cell_value(low + ivec3(1, 1, 0)), share.x);
    return mix(nearer, farther, share.y);
}

// A number that is safe to divide by.
float nonzero(float along) { return along == 0.0 ? 0.000001 : along; }

float skip(vec3 origin, vec3 direction, float t, float far, float footprint, float step_scale, inout vec2 sphere,
           inout int reads) {
    if (!cells_hold()) return t;
    float scale = 0.5 * float(cell_count) / cells_half; // cells per model unit
    vec3 start = scale * (origin + cells_half);
    vec3 along = scale * direction;
    along = vec3(nonzero(along.x), nonzero(along.y), nonzero(along.z));
    while (reads < CELL_READS && t <= far) {
        ++reads;
        vec3 place = start + t * along;
        ivec3 cell = clamp(ivec3(floor(place)), 0, cell_count - 1);
        uint code = cell_code(cell);
        if (code < CELL_EMPTY) {
            float edge = float(1 << int(code));
            vec3 corner = edge * floor(vec3(cell) / edge);
            vec3 leaving = (corner + edge * step(0.0, along) - place) / along;
            sphere = vec2(t, 0.0);
            t += max(min(leaving.x, min(leaving.y, leaving.z)), 0.0) + 0.001 / scale;
        } else {
            vec3 first = floor(place - 0.5);
            vec3 share = place - 0.5 - first;
            float value = mix(cell_layer(ivec3(first), share), cell_layer(ivec3(first) + ivec3(0, 0, 1), share), share.z);
            float free = step_scale * value / scale;
            if (free <= CELL_CLOSE * footprint * t) break;
            sphere = vec2(t, free);
            t += free;
        }
    }
    return t;
}
#else
float skip(vec3 origin, vec3 direction, float t, float far, float footprint, float step_scale, inout vec2 sphere,
           inout int reads) {
    return t;
}
#endif
// background(): vertical gradient, sRGB. A dark gradient gets darker toward the corners.
// pixel, resolution: pixels, origin bottom left; bottom, top: sRGB.
vec3 background(vec2 pixel, vec2 resolution, vec3 bottom, vec3 top) {
    vec2 plane = pixel / resolution;
    vec2 corner = plane - 0.5;
    float dark = 1.0 - smoothstep(0.45, 0.75, dot(bottom + top, vec3(1.0 / 6.0)));
    return mix(bottom, top, smoothstep(0.0, 1.0, plane.y)) * (1.0 - 0.35 * dark * dot(corner, corner));
}
// ball(): intersection of a ray with a ball around the origin.
// origin, direction: model space, direction of length 1; radius: model units.
// Returns the distances (entry, exit) along the ray; entry > exit if it misses.
vec2 ball(vec3 origin, vec3 direction, float radius) {
    float b = dot(origin, direction);
    float h = b * b - dot(origin, origin) + radius * radius;
    return h < 0.0 ? vec2(1.0, -1.0) : vec2(-sqrt(h), sqrt(h)) - b;
}
// Values of the uniform `schedule`; march.glsl explains them.
const int SCHEDULE_PLAIN = 0;
const int SCHEDULE_RELAXED = 1;
// march(): multiscale sphere tracing (Section 3.2, Appendix C): f_1 - delta_1, then f_2 - delta_2, ..., then f_level.
// origin, direction: model space, direction of length 1; footprint: width of a pixel at distance 1.
// rounds: largest number of passes through the levels; step_scale: factor on every step; schedule: see below.
// Reads delta[], iterations[], step_bound[], band_step_bound[] (one per level), field(), half_width(), skip() and NEAR. The
// bounds are factors on a level's steps: 1 if full steps never cross the surface, less if f exceeds the distance.
//
// Two additions to the paper's scheme prevent holes (docs/lessons.md). A ray that leaves a band without a hit returns
// to the coarser level, and passes through the levels again: hence rounds. And a band's offset surface is traced at
// half-width / 1.3, where delta / 1.3 = max |f_i(x_j)| (Eq. 5), so that a ray crosses the band's border in finitely many
// steps. A ray ends if it starts inside the shape or moves behind the eye. A ray stops within 1/20 pixel of the surface;
// a ray that has used all its rounds hits within 1/2 pixel.
//
// SCHEDULE_PLAIN: a step is the free sphere's radius, and all rays pass through the levels together, so that branches on
// the level are uniform on a GPU.
// SCHEDULE_RELAXED: over-relaxed. skip() jumps over empty space, the finest level defined at a point takes the step, and
// the step goes to where the surface is expected, but no farther than consecutive spheres overlap (relaxed_step()). Far
// from the shape, the field may exceed the distance by a third and spheres may not be free: steps are plain there.
const float STOP = 0.05; // pixels to the surface within which a ray stops
const float FLATTEST = 0.1; // smallest slope along a ray that predicts how far the surface is
const float STEEPEST = 4.0; // slope between a free sphere and a point inside, above which the sphere was not free
const float GAP = 0.005; // largest gap between two free spheres, model units, if a pixel is wider

struct Hit {
    bool hit;
    float t;
    int level; // current level; negative once the ray has ended
    int steps;
};

// Radius of the free sphere around a ray's point. f: field of the level `reached` there; width: half-width of its band.
float free_radius(float f, float width, int reached, int level, float step_scale) {
    bool last = reached == level;
    float bound = last ? step_bound[reached - 1] : band_step_bound[reached - 1];
    return step_scale * bound * (last ? f : f - width / 1.3);
}

// Moves a ray by a step, and sets whether it hits or ends.
void move_ray(inout Hit ray, float change, float f, int reached, int level, float pixel, float far) {
    bool last = reached == level;
    ray.t += change;
    ray.hit = last && f < 0.5 * pixel && ray.t <= far && ray.t >= 0.0;
    ray.level = last && abs(f) < STOP * pixel || ray.t > far || ray.t < 0.0 ? -reached : reached;
}

// One plain step of a ray at ray.level. f: field of `reached`, the finest level defined there; width: half-width of its
// band.
void plain_step(inout Hit ray, float f, float width, int reached, int level, float footprint, float far,
                float step_scale) {
    ++ray.steps;
    if (reached == ray.level && reached < level && abs(f) < width) {
        ++ray.level;
        return;
    }
    move_ray(ray, free_radius(f, width, reached, level, step_scale), f, reached, level, footprint * ray.t, far);
}

// One over-relaxed step. sphere: distance of the last free sphere along the ray, and its radius; radius 0: none.
//
// The radii of the last two spheres predict the surface. The step goes there, but no farther than 0.9 of the step after
// which the predicted next sphere would be a pixel from this one. Before the first step, the last sphere is the grid's,
// which may be too small by far, and so is the slope. The last step is short, since nothing checks it. If the prediction fails, with a gap of over a pixel, the
// ray returns to the end of the last sphere (Keinert et al., Enhanced sphere tracing, 2014; Balint and Valasek,
// Accelerating sphere tracing, 2018). Past the surface: false position between the last two points, even back beyond the
// last sphere if the slope shows that it was not free, since the grid may be wrong.
void relaxed_step(inout Hit ray, inout vec2 sphere, float f, float width, int reached, int level, float footprint,
                  float far, float step_scale) {
    ++ray.steps;
    float pixel = footprint * ray.t;
    float radius = free_radius(f, width, reached, level, step_scale);
    float moved = ray.t - sphere.x;
    float gap = min(pixel, GAP);
    bool known = sphere.y > 0.0 && moved > 0.0;
    if (known && radius > 0.0 && moved > sphere.y + radius + gap && moved > 1.00001 * sphere.y) {
        ray.t = sphere.x + sphere.y;
        ray.hit = false;
        ray.level = 1;
        sphere.y = 0.0;
        return;
    }
    float slope = known ? (sphere.y - radius) / moved : 1.0;
    float change = radius;
    if (known && radius < 0.0) {
        change = radius / min(slope, STEEPEST);
    } else {
        if (known && radius > 0.0 && radius < NEAR * gap) {
            float nearest = max(slope, 0.0);
            float touching = 0.9 * (2.0 * radius / (1.0 + nearest) + gap);
            bool predicts = ray.steps > 1 && f >= STOP * pixel;
            change = min(touching, radius / max(nearest, predicts ? FLATTEST : 0.5));
            change = max(change, radius);
        }
        sphere = vec2(ray.t, radius);
    }
    move_ray(ray, change, f, reached, level, pixel, far);
}

// Moves a ray, between two over-relaxed steps, past empty cells of the grid; ends it if only those are left.
// reads: number of reads of the grid so far.
void skip_cells(inout Hit ray, inout vec2 sphere, inout int reads, vec3 origin, vec3 direction, float footprint,
                float far, float step_scale) {
    if (ray.level == 1 && ray.t > 0.0) { // first check for an eye inside the shape
        ray.t = skip(origin, direction, ray.t, far, footprint, step_scale, sphere, reads);
        if (ray.t > far) ray.level = ray.steps > 0 ? -1 : 0;
    }
}

// Traces a ray from its current point. far: where it leaves the ball; sphere: see relaxed_step(); once: take only one step.
void continue_march(inout Hit ray, inout vec2 sphere, vec3 origin, vec3 direction, float footprint, int level,
                    int rounds, float step_scale, int schedule, float far, bool once) {
    int reads = 0;
    bool relaxed = schedule == SCHEDULE_RELAXED;
    for (int round = 0; round < rounds && ray.level > 0; ++round) {
        for (int phase = relaxed ? level : 1; phase <= level; ++phase) {
            for (int i = 0; i < iterations[phase - 1] && (relaxed ? ray.level > 0 : ray.level == phase); ++i) {
                if (relaxed) {
                    skip_cells(ray, sphere, reads, origin, direction, footprint, far, step_scale);
                    if (ray.level <= 0) break;
                }
                int reached;
                vec3 p = origin + ray.t * direction;
                float f = field(p, phase, reached);
                float width = half_width(p, reached);
                if (relaxed) relaxed_step(ray, sphere, f, width, reached, level, footprint, far, step_scale);
                else plain_step(ray, f, width, reached, level, footprint, far, step_scale);
                if (once) return;
            }
        }
    }
}

// Returns a ray at its entry into the ball; it has ended if it misses. span: distances (entry, exit).
Hit start_ray(vec2 span) {
    return Hit(false, max(span.x, 0.0), span.x < span.y && span.y > 0.0 ? 1 : 0, 0);
}

Hit march(vec3 origin, vec3 direction, float footprint, int level, int rounds, float step_scale, int schedule) {
    vec2 span = ball(origin, direction, 1.0 + delta[level - 1]);
    Hit ray = start_ray(span);
    vec2 sphere = vec2(0.0);
    continue_march(ray, sphere, origin, direction, footprint, level, rounds, step_scale, schedule, span.y, false);
    return ray;
}
// floor_distance(): distance along a ray to the floor; -1 if the ray does not meet it from above.
// origin, direction: model space, direction of length 1; ground: height of the floor.
float floor_distance(vec3 origin, vec3 direction, float ground) {
    return direction.y < 0.0 && origin.y > ground ? (ground - origin.y) / direction.y : -1.0;
}
// heat(): color map of [0, 1], sRGB: black, violet, red, orange, pale yellow.
vec3 heat(float share) {
    float x = 4.0 * clamp(share, 0.0, 1.0);
    vec3 color = mix(vec3(0.01, 0.01, 0.05), vec3(0.32, 0.07, 0.45), clamp(x, 0.0, 1.0));
    color = mix(color, vec3(0.80, 0.20, 0.28), clamp(x - 1.0, 0.0, 1.0));
    color = mix(color, vec3(0.98, 0.60, 0.10), clamp(x - 2.0, 0.0, 1.0));
    return mix(color, vec3(1.0, 0.98, 0.75), clamp(x - 3.0, 0.0, 1.0));
}
// linear(): sRGB to linear light, each channel in [0, 1] (IEC 61966-2-1).
vec3 linear(vec3 srgb) {
    vec3 c = clamp(srgb, 0.0, 1.0);
    return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(vec3(0.04045), c));
}
// phong(): Phong shading with one key light, a sky above and a warm ground below, linear light.
// Above 0.6, a shoulder compresses values that would be clipped to 1.
// albedo: linear; normal, view (to the eye), light (to the light), up: length 1, one space for all.
vec3 phong(vec3 albedo, vec3 normal, vec3 view, vec3 light, vec3 up) {
    float key = max(dot(normal, light), 0.0);
    float highlight = pow(max(dot(reflect(-light, normal), view), 0.0), 48.0);
    float rim = pow(1.0 - max(dot(normal, view), 0.0), 4.0);
    vec3 ambient = mix(vec3(0.16, 0.13, 0.12), vec3(0.34, 0.38, 0.46), 0.5 + 0.5 * dot(normal, up));
    vec3 lit = albedo * (ambient + 1.05 * key * vec3(1.0, 0.96, 0.9)) + 0.14 * highlight + 0.10 * rim;
    vec3 over = max(lit - 0.6, vec3(0.0));
    return lit - over + over / (1.0 + 2.0 * over);
}
// Values of the uniform `shading`; shade.glsl defines them.
const int SHADE_PHONG = 0;
const int SHADE_NORMAL = 1;
const int SHADE_DEPTH = 2;
const int SHADE_STEPS = 3;
const int SHADE_TEXTURE = 4;
const int SHADE_SOFTBOX = 5;
const int SHADE_DATA = 6;
// srgb(): linear light to sRGB, each channel in [0, 1] (IEC 61966-2-1).
vec3 srgb(vec3 linear) {
    vec3 c = clamp(linear, 0.0, 1.0);
    return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(vec3(0.0031308), c));
}
// shade(): color of the surface, sRGB, in a shading mode.
// normal: length 1; direction: of the ray, length 1; t: distance along it; steps: taken by march().
// albedo: sRGB; light (to the light), up: length 1. All in model space. eye: distance of the eye from the origin.
vec3 shade(int shading, vec3 normal, vec3 direction, float t, float eye, int steps, vec3 albedo, vec3 light, vec3 up) {
    if (shading == SHADE_NORMAL) return 0.5 + 0.5 * normal;
    if (shading == SHADE_DEPTH) return vec3(clamp(0.5 - 0.45 * (t - eye), 0.0, 1.0));
    if (shading == SHADE_STEPS) return heat(float(steps) / 32.0);
    if (shading == SHADE_TEXTURE) return albedo;
    return srgb(phong(linear(albedo), normal, -direction, light, up));
}
#ifndef WITHOUT_SOFTBOX
// key_light(): direction to the key light, length 1, model space. The light follows the camera only around the y
// axis, so that shadows stay when the camera tilts, and stays above the floor.
// light: the uniform; camera: columns right, up, back, eye.
vec3 key_light(vec3 light, mat4 camera) {
    vec3 toward = normalize(light);
    vec3 right = camera[0].xyz;
    return normalize(toward.x * right + vec3(0.0, max(toward.y, 0.35), 0.0) + toward.z * vec3(-right.z, 0.0, right.x));
}
// coarse_field(): level 1's field at any point p, model space. The network is trained in the unit ball, which contains the
// shape. Outside, the distance is at least the hypotenuse of the distance to the ball and the field at the ball's nearest point,
// because the ball is convex.
float coarse_field(vec3 p) {
    float far = sqrt(dot(p, p));
    int reached;
    float f = field(p / max(far, 1.0), 1, reached);
    float outside = far - 1.0;
    float inside = max(f, 0.0);
    return outside > 0.0 ? sqrt(outside * outside + inside * inside) : f;
}
// openness(): visible shares of the sky (x) and of the key light (y), each in [0, 1], from level 1 only; z: field of level 1
// at p.
// p: on the surface, or on the floor if `floored`, model space; normal, light (to the light): length 1; ground: height of
// the floor.
//
// Sky: the field at SKY_TAPS points on the normal, farthest first. A field below the point's distance from p means
// occlusion (Evans, Fast approximations for global illumination on dynamic scenes, 2006). If a point above the floor has
// almost no occlusion, neither have the nearer points.
// Light: a disk. Along a ray to its center, the ratio of the field to the traveled distance is the distance between ray and
// shape in radii of the disk, from -1, where the shape hides the disk, to 1. The ratio takes the shape's edge for straight,
// which is wrong for parts smaller than the disk, so the floor's light is the mean of PARTS smaller disks. The ray to the
// first, in the middle, finds out where the shape may hide any of them; the others begin and end there.
// The samples of all rays are at the same distances, hence for the floor at the same heights of the shape: if they depended
// on p, so would the error of the minimum between them, and the penumbra would show ripples. For the same reason the
// minimum is that of a cubic whose slope is continuous. The network is not evaluated where the unit ball, which contains
// the shape, is too far to matter.
const int SKY_TAPS = 5;
const int PARTS = 5; // disks of the floor's light
const int LIGHT_STEPS = 16; // most samples of a ray
const float SKY_REACH = 0.7; // distance of the farthest tap, model units
const float SKY_WEIGHTS = 3.2; // sum of the weights of all taps
const float ENOUGH = 0.85; // field over a tap's distance above which occlusion counts as none
const float LIGHT_SIZE = 0.16; // radius of the light over its distance
const float PART_SIZE = 0.55; // radius of a part over the light's
const float PART_PLACE = 0.65; // distance of the outer parts from the middle, in radii of the light
const float LIGHT_FIRST = 0.03; // distance of the first sample; the next is LIGHT_GROWTH times it, plus LIGHT_STEP
const float LIGHT_GROWTH = 1.14;
const float LIGHT_STEP = 0.04;
const float LIGHT_STEADY = 0.8; // factor on steps over free space, since level 1 may exceed the distance
const float CLEAR = 0.8; // field over the rest of the ray in the ball plus the cone's end radius, above which it is free
const float LIFT = 0.25; // distance from p over which the field at p is subtracted, model units: level 1 may not be 0 at p

// Offset of the center of a part from the light's center, at distance 1.
vec3 part_offset(vec3 light, int part) {
    float flat_length = sqrt(light.x * light.x + light.z * light.z);
    vec3 across = vec3(1.0, 0.0, 0.0);
    if (flat_length > 0.001) across = vec3(light.z, 0.0, -light.x) / flat_length;
    vec3 up = vec3(light.y * across.z, light.z * across.x - light.x * across.z, -light.y * across.x);
    vec2 place = vec2(part == 1 || part == 4 ? -1.0 : 1.0, part > 2 ? -1.0 : 1.0) * sqrt(0.5);
    return LIGHT_SIZE * PART_PLACE * (place.x * across + place.y * up);
}

// The first distance of a sample, from t on, that is not below the goal.
float sample_from(float t, float goal) {
    while (t < goal) t = LIGHT_GROWTH * t + LIGHT_STEP;
    return t;
}

// The least value of a cubic between two places `width` apart, from its values and its slopes there, < 0 and > 0.
float cubic_minimum(float width, float start, float end, float slope, float slope_end) {
    float rise = end - start;
    float bend = 3.0 * rise - width * (2.0 * slope + slope_end);
    float twist = width * (slope + slope_end) - 2.0 * rise;
    float root = bend + sqrt(max(bend * bend - 3.0 * twist * width * slope, 0.0));
    float at = clamp(-width * slope / max(root, 0.000001), 0.0, 1.0);
    return start + at * (width * slope + at * (bend + at * twist));
}

vec3 openness(vec3 p, vec3 normal, vec3 light, float ground, bool floored) {
    float nearest = -dot(p, light); // distance along the light's ray to its point nearest to the origin
    float passed = dot(p, p) - nearest * nearest;
    float beside = 1.0 + LIGHT_SIZE * max(nearest, 0.0);
    bool shaded = dot(normal, light) > -LIGHT_SIZE && passed < beside * beside && (nearest > 0.0 || dot(p, p) < 1.0);
    int parts = floored ? PARTS : 1;
    int last = SKY_TAPS + (shaded ? parts * LIGHT_STEPS : 0);
    float size = floored ? LIGHT_SIZE * PART_SIZE : LIGHT_SIZE;
    float half_chord = sqrt(max(1.0 - passed, 0.1));
    float here = 0.0;
    float occluded = 0.0;
    float seen = shaded ? 0.0 : 1.0;
    int part = 0;
    vec3 toward = light;
    float cone = floored ? LIGHT_SIZE * (PART_SIZE + PART_PLACE) : LIGHT_SIZE; // radius at distance 1, of all parts
    float t = sample_from(LIGHT_FIRST, nearest - half_chord);
    float end = nearest + half_chord;
    float enter = 0.0; // first sample in the cone of all parts; 0: none yet
    float leave = 0.0; // first sample behind its last one
    int steps = 0;
    float cover = 1.0;
    vec2 before = vec2(0.0); // (distance, field over distance) of the previous sample
    vec2 last_but_one = vec2(0.0);
    float slope_before = 0.0;
    for (int i = floored ? 1 : 0; i <= last; ++i) {
        bool tap = i <= SKY_TAPS;
        float share = i == 0 ? 0.0 : float(SKY_TAPS + 1 - i) / float(SKY_TAPS);
        float way = tap ? SKY_REACH * share * share : t;
        vec3 q = p + way * (tap ? normal : toward);
        if (tap && floored && sqrt(dot(q, q)) - 1.0 >= way) {
            i = SKY_TAPS;
            continue;
        }
        float f = coarse_field(q);
        if (i == 0) here = f;
        f -= here * max(1.0 - way / LIFT, 0.0);
        if (tap) {
            float free = floored ? f : min(f, q.y - ground);
            occluded += i == 0 ? 0.0 : (1.0 - 0.6 * share) * clamp(1.0 - free / way, 0.0, 1.5);
            if (floored && free >= ENOUGH * way) i = SKY_TAPS;
            continue;
        }
        float ratio = f / (size * t);
        float slope = 0.0;
        cover = min(cover, ratio);
        if (steps > 1) {
            float width = before.x - last_but_one.x;
            float rise = (ratio - before.y) / (t - before.x);
            float rise_before = (before.y - last_but_one.y) / width;
            slope = (rise * width + rise_before * (t - before.x)) / (t - last_but_one.x);
            if (slope_before < 0.0 && slope > 0.0)
                cover = min(cover, cubic_minimum(width, last_but_one.y, before.y, slope_before, slope));
        }
        slope_before = slope;
        last_but_one = before;
        before = vec2(t, ratio);
        ++steps;
        t = sample_from(LIGHT_GROWTH * t + LIGHT_STEP, t + LIGHT_STEADY * (f - cone * t) / (1.0 + cone));
        if (part == 0 && f < cone * before.x) {
            if (enter == 0.0) enter = before.x;
            leave = t;
        }
        float left = max(end - before.x, 0.0);
        bool ends = t > (part == 0 ? end : leave) || f > CLEAR * (left + cone * (before.x + left));
        if (part > 0) ends = ends || cover < -1.0;
        if (!ends && steps < LIGHT_STEPS) continue;
        cover = clamp(cover, -1.0, 1.0);
        seen += 0.25 * (1.0 + cover) * (1.0 + cover) * (2.0 - cover);
        ++part;
        if (part == parts) break;
        if (enter == 0.0) {
            seen += float(parts - part);
            break;
        }
        toward = light + part_offset(light, part);
        cone = size;
        t = enter;
        steps = 0;
        cover = 1.0;
        slope_before = 0.0;
    }
    float sky = clamp(1.0 - occluded / SKY_WEIGHTS, 0.0, 1.0);
    return vec3(sky, shaded ? seen / float(parts) : 1.0, here);
}
// softbox(): the surface under a large key light and a sky, above a floor that reflects light; linear light.
// Above 0.6, a shoulder compresses values that would be clipped to 1 (phong.glsl).
// albedo: linear; normal, view (to the eye), light (to the key light): length 1, model space; open: openness(); delta:
// half-width of level 1's band; height: above the floor, model units.
vec3 softbox(vec3 albedo, vec3 normal, vec3 view, vec3 light, vec3 open, float delta, float height) {
    // A surface inside level 1's is in a crease that level 1 lacks.
    float sky = open.x * clamp(1.0 + 0.6 * open.z / delta, 0.5, 1.0);
    // A light as large as a fifth of its distance is still visible slightly below the horizon.
    float facing = dot(normal, light);
    float rising = clamp(facing + 0.2, 0.0, 0.4);
    float key = open.y * max(facing, 1.25 * rising * rising);
    float above = smoothstep(0.0, 1.0, 0.5 + 0.5 * normal.y);
    vec3 floor_light = sqrt(sky) * (1.0 - 0.75 / (1.0 + 4.0 * max(height, 0.0))) * vec3(0.30, 0.28, 0.26);
    vec3 diffuse = mix(floor_light, sky * vec3(0.40, 0.43, 0.48), above) + 0.86 * key * vec3(1.0, 0.97, 0.92);
    vec3 mirrored = reflect(-view, normal);
    float fresnel = 0.04 + 0.5 * pow(1.0 - max(dot(normal, view), 0.0), 5.0);
    float gloss = 0.9 * fresnel * sky * smoothstep(-0.2, 0.9, mirrored.y);
    gloss += 0.1 * open.y * pow(max(dot(mirrored, light), 0.0), 40.0);
    vec3 lit = albedo * diffuse + gloss;
    vec3 over = max(lit - 0.6, vec3(0.0));
    return lit - over + over / (1.0 + 2.0 * over);
}
// floor_color(): the floor, linear light: the backdrop's color times the visible key light and sky, so that floor
// and backdrop blend. On a dark backdrop, the key light makes a bright pool.
// backdrop: linear; p: on the floor, model space; light: to the key light, length 1; open: openness(); above: height of
// the eye above the floor, model units; the floor is invisible from below.
vec3 floor_color(vec3 backdrop, vec3 p, vec3 light, vec3 open, float above) {
    float key = 0.9 * light.y;
    float sky = 0.45;
    float lit = (key * open.y + sky * open.x) / (key + sky);
    float dark = 1.0 - smoothstep(0.05, 0.5, dot(backdrop, vec3(1.0 / 3.0)));
    float far = dot(p, p) / 2.5;
    float pool = 1.0 + 1.4 * dark / (1.0 + far * far);
    return backdrop * mix(1.0, lit * pool, smoothstep(0.0, 0.3, above));
}
#endif
uniform bool plain; // omits the model's colors
// base_color(): color of the surface at p, model space; sRGB.
vec3 base_color(vec3 p) {
    return plain ? vec3(0.80, 0.74, 0.66) : albedo(p);
}
// surface_color(): color, sRGB, of a pixel whose ray meets the surface or the floor, in the mode `shading`.
// normal: of the surface; direction: of the ray; both length 1, model space. t: distance along the ray; steps: of march();
// hit: whether the ray meets the surface, not the floor; backdrop: the background's color in this pixel, sRGB.
// WITHOUT_SOFTBOX: the mode is not SHADE_SOFTBOX, which compiles longer than all others together. FLOOR_LIGHT:
// floor_openness.glsl has the openness of parts of the floor.
vec3 surface_color(vec3 normal, vec3 direction, float t, int steps, bool hit, vec3 backdrop) {
    vec3 eye = camera[3].xyz;
    vec3 p = eye + t * direction, albedo = vec3(0.0);
    if (hit) albedo = base_color(p);
#ifndef WITHOUT_SOFTBOX
    if (shading == SHADE_SOFTBOX) {
        vec3 toward = key_light(light, camera);
        vec3 open;
#ifdef FLOOR_LIGHT
        if (hit || !floor_openness(open))
#endif
            open = openness(p, normal, toward, ground, !hit);
        if (!hit) return srgb(floor_color(linear(backdrop), p, toward, open, eye.y - ground));
        return srgb(softbox(linear(albedo), normal, -direction, toward, open, delta[0], p.y - ground));
    }
#endif
    return shade(shading, normal, direction, t, length(eye), steps, albedo, normalize(mat3(camera) * light), camera[1].xyz);
}

// ray_color(): color of a traced ray. rgb is sRGB, a is 1 on the surface and 0 on the background.
// SHADE_DATA returns (t, steps, last level, hit) instead; level 0: the ray never came near the shape.
// normal: of the surface; direction: of the ray; both length 1, model space. pixel: point of the image, pixels, origin
// bottom left.
vec4 ray_color(Hit ray, vec3 normal, vec3 direction, vec2 pixel) {
    // Never true. With a discard, llvmpipe compiles one variant of the shader instead of two.
    if (resolution.x < 0.0) discard;
    vec4 color = vec4(background(pixel, resolution, background_bottom, background_top), float(ray.hit));
    float t = ray.hit || shading != SHADE_SOFTBOX ? ray.t : floor_distance(camera[3].xyz, direction, ground);
    if (ray.hit || shading == SHADE_SOFTBOX && t > 0.0)
        color.rgb = surface_color(normal, direction, t, ray.steps, ray.hit, color.rgb);
    if (shading == SHADE_STEPS) color = vec4(heat(float(ray.steps) / 32.0), color.a);
    if (shading == SHADE_DATA) color = vec4(ray.t, float(ray.steps), float(abs(ray.level)), float(ray.hit));
    return color;
}
uniform float split; // share of the width, from the left, with the traced level's own normals
// normal_level_at(): level whose gradient is the normal of a pixel; pixel: pixels, origin bottom left.
int normal_level_at(vec2 pixel) {
    return pixel.x < split * resolution.x ? level : normal_level;
}
// normal_at(): the surface's normal, length 1, at p, model space, where the ray of a pixel hits.
// pixel: pixels, origin bottom left.
vec3 normal_at(vec3 p, vec2 pixel) {
    return normalize(field_gradient(p, normal_level_at(pixel)).xyz);
}

// pixel_color(): traces the ray through a point of the image, and returns ray_color(). pixel: pixels, origin bottom left.
vec4 pixel_color(vec2 pixel) {
    vec3 direction = camera_ray(pixel, resolution, camera, focal);
    Hit ray = march(camera[3].xyz, direction, 2.0 / (focal * resolution.y), level, rounds, step_scale, schedule);
    vec3 normal = vec3(0.0, 1.0, 0.0);
    if (ray.hit) normal = normal_at(camera[3].xyz + ray.t * direction, pixel);
    return ray_color(ray, normal, direction, pixel);
}
void main() {
    color = pixel_color(gl_FragCoord.xy + origin + jitter);
}
