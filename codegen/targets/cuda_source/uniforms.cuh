// uniforms.cuh: what a picture shows; the names and meanings of the GLSL targets' uniforms.
enum Shading { SHADE_PHONG, SHADE_NORMAL, SHADE_DEPTH, SHADE_STEPS, SHADE_TEXTURE, SHADE_DATA };

struct Settings {
    int width = 512, height = 512;  // pixels
    mat4 camera;                    // camera to model space: columns right, up, back, eye
    float focal = 2.75f;            // 1 / tan(fov / 2), vertical
    int level = LEVELS;             // level that is traced
    int normal_level = LEVELS;      // level whose gradient is the normal
    int rounds = 32;                // how often the levels are gone through
    float step_scale = 0.8f;        // factor on every step: a trained gradient is in places longer than 1
    Shading shading = SHADE_PHONG;
    vec3 light = vec3(-0.5f, 0.7f, 0.8f);  // direction to the light, camera space
    vec3 background_bottom = vec3(0.13f, 0.14f, 0.17f), background_top = vec3(0.33f, 0.36f, 0.41f);  // sRGB
    __host__ __device__ int pixels() const { return width * height; }
};

__constant__ int iterations[LEVELS];  // sphere tracing steps at each level, per round
__constant__ float delta[LEVELS];     // half width of each level's band, model units
__constant__ float time;              // fourth input of a field that moves
