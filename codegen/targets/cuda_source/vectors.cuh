// vectors.cuh: GLSL's types and functions in the field, the files of glsl/ and the kernels.
using uint = unsigned;

struct vec2 {
    float x, y;
    vec2() = default;
    __host__ __device__ constexpr vec2(float x, float y) : x(x), y(y) {}
    __host__ __device__ explicit constexpr vec2(float all) : x(all), y(all) {}
};

struct ivec3;

struct vec3 {
    float x, y, z;
    vec3() = default;
    __host__ __device__ constexpr vec3(float x, float y, float z) : x(x), y(y), z(z) {}
    __host__ __device__ constexpr vec3(vec2 xy, float z) : x(xy.x), y(xy.y), z(z) {}
    __host__ __device__ explicit constexpr vec3(float all) : x(all), y(all), z(all) {}
    __host__ __device__ explicit constexpr vec3(ivec3 v);
};

struct ivec3 {
    int x, y, z;
    ivec3() = default;
    __host__ __device__ constexpr ivec3(int x, int y, int z) : x(x), y(y), z(z) {}
    __host__ __device__ explicit constexpr ivec3(vec3 v)
        : x(static_cast<int>(v.x)), y(static_cast<int>(v.y)), z(static_cast<int>(v.z)) {}
};

struct vec4 {
    vec3 xyz;
    float w;
    vec4() = default;
    __host__ __device__ constexpr vec4(float x, float y, float z, float w) : xyz(x, y, z), w(w) {}
    __host__ __device__ constexpr vec4(vec3 xyz, float w) : xyz(xyz), w(w) {}
    __host__ __device__ explicit constexpr vec4(float all) : xyz(all), w(all) {}
};

__host__ __device__ constexpr vec3::vec3(ivec3 v)
    : x(static_cast<float>(v.x)), y(static_cast<float>(v.y)), z(static_cast<float>(v.z)) {}

// A matrix has its columns as members, not as an array, so that a selected column stays in registers.
struct mat4 {
    vec4 a, b, c, d;
    mat4() = default;
    __host__ __device__ constexpr mat4(vec4 a, vec4 b, vec4 c, vec4 d) : a(a), b(b), c(c), d(d) {}
    __host__ __device__ constexpr vec4 operator[](int i) const { return i == 0 ? a : i == 1 ? b : i == 2 ? c : d; }
};

struct mat3 {
    vec3 a, b, c;
    mat3() = default;
    __host__ __device__ explicit constexpr mat3(const mat4 &m) : a(m.a.xyz), b(m.b.xyz), c(m.c.xyz) {}
};

__device__ inline float abs(float a) { return fabsf(a); }
__device__ inline int abs(int a) { return a < 0 ? -a : a; }
__device__ inline float sqrt(float a) { return sqrtf(a); }
__device__ inline float sin(float a) { return sinf(a); }
__device__ inline float cos(float a) { return cosf(a); }
__device__ inline float max(float a, float b) { return fmaxf(a, b); }
__device__ inline float min(float a, float b) { return fminf(a, b); }
__device__ inline float floor(float a) { return floorf(a); }
__device__ inline float pow(float a, float exponent) { return powf(a, exponent); }
__device__ inline float step(float edge, float a) { return a < edge ? 0.0f : 1.0f; }
__device__ inline float clamp(float a, float low, float high) { return fminf(fmaxf(a, low), high); }
__device__ inline int clamp(int a, int low, int high) { return a < low ? low : a > high ? high : a; }
__device__ inline float mix(float a, float b, float share) { return (1.0f - share) * a + share * b; }
__device__ inline float smoothstep(float low, float high, float a) {
    float x = clamp((a - low) / (high - low), 0.0f, 1.0f);
    return x * x * (3.0f - 2.0f * x);
}

__device__ inline vec2 operator-(vec2 a, vec2 b) { return vec2(a.x - b.x, a.y - b.y); }
__device__ inline vec2 operator-(vec2 a, float b) { return a - vec2(b); }
__device__ inline vec2 operator*(float a, vec2 b) { return vec2(a * b.x, a * b.y); }
__device__ inline vec2 operator*(vec2 a, float b) { return b * a; }
__device__ inline vec2 operator/(vec2 a, vec2 b) { return vec2(a.x / b.x, a.y / b.y); }
__device__ inline vec2 operator/(vec2 a, float b) { return a / vec2(b); }
__device__ inline float dot(vec2 a, vec2 b) { return a.x * b.x + a.y * b.y; }

__device__ inline vec3 operator-(vec3 a) { return vec3(-a.x, -a.y, -a.z); }
__device__ inline vec3 operator+(vec3 a, vec3 b) { return vec3(a.x + b.x, a.y + b.y, a.z + b.z); }
__device__ inline vec3 operator+(vec3 a, float b) { return a + vec3(b); }
__device__ inline vec3 operator+(float a, vec3 b) { return vec3(a) + b; }
__device__ inline vec3 operator-(vec3 a, vec3 b) { return vec3(a.x - b.x, a.y - b.y, a.z - b.z); }
__device__ inline vec3 operator-(vec3 a, float b) { return a - vec3(b); }
__device__ inline vec3 operator*(vec3 a, vec3 b) { return vec3(a.x * b.x, a.y * b.y, a.z * b.z); }
__device__ inline vec3 operator*(float a, vec3 b) { return vec3(a) * b; }
__device__ inline vec3 operator*(vec3 a, float b) { return a * vec3(b); }
__device__ inline vec3 operator/(vec3 a, vec3 b) { return vec3(a.x / b.x, a.y / b.y, a.z / b.z); }
__device__ inline vec3 operator/(vec3 a, float b) { return a / vec3(b); }
__device__ inline float dot(vec3 a, vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
__device__ inline vec3 max(vec3 a, vec3 b) { return vec3(max(a.x, b.x), max(a.y, b.y), max(a.z, b.z)); }
__device__ inline float length(vec3 a) { return sqrtf(dot(a, a)); }
__device__ inline vec3 normalize(vec3 a) { return 1.0f / sqrtf(dot(a, a)) * a; }
__device__ inline vec3 reflect(vec3 incident, vec3 normal) { return incident - 2.0f * dot(normal, incident) * normal; }
__device__ inline vec3 pow(vec3 a, vec3 b) { return vec3(pow(a.x, b.x), pow(a.y, b.y), pow(a.z, b.z)); }
__device__ inline vec3 floor(vec3 a) { return vec3(floor(a.x), floor(a.y), floor(a.z)); }
__device__ inline vec3 step(vec3 a, vec3 b) { return vec3(step(a.x, b.x), step(a.y, b.y), step(a.z, b.z)); }
__device__ inline vec3 step(float a, vec3 b) { return step(vec3(a), b); }
__device__ inline vec3 clamp(vec3 a, float low, float high) {
    return vec3(clamp(a.x, low, high), clamp(a.y, low, high), clamp(a.z, low, high));
}
__device__ inline vec3 mix(vec3 a, vec3 b, vec3 share) {
    return vec3(mix(a.x, b.x, share.x), mix(a.y, b.y, share.y), mix(a.z, b.z, share.z));
}
__device__ inline vec3 mix(vec3 a, vec3 b, float share) { return mix(a, b, vec3(share)); }
__device__ inline vec3 operator*(const mat3 &m, vec3 v) { return v.x * m.a + v.y * m.b + v.z * m.c; }

__device__ inline ivec3 operator+(ivec3 a, ivec3 b) { return ivec3(a.x + b.x, a.y + b.y, a.z + b.z); }
__device__ inline ivec3 clamp(ivec3 a, int low, int high) {
    return ivec3(clamp(a.x, low, high), clamp(a.y, low, high), clamp(a.z, low, high));
}

__device__ inline vec4 operator+(vec4 a, vec4 b) { return vec4(a.xyz + b.xyz, a.w + b.w); }
__device__ inline vec4 operator*(vec4 a, vec4 b) { return vec4(a.xyz * b.xyz, a.w * b.w); }
__device__ inline vec4 operator*(float a, vec4 b) { return vec4(a * b.xyz, a * b.w); }
__device__ inline vec4 &operator+=(vec4 &a, vec4 b) { return a = a + b; }
__device__ inline float dot(vec4 a, vec4 b) { return dot(a.xyz, b.xyz) + a.w * b.w; }
__device__ inline vec4 sin(vec4 a) { return vec4(sinf(a.xyz.x), sinf(a.xyz.y), sinf(a.xyz.z), sinf(a.w)); }
__device__ inline vec4 cos(vec4 a) { return vec4(cosf(a.xyz.x), cosf(a.xyz.y), cosf(a.xyz.z), cosf(a.w)); }
__device__ inline vec4 operator*(mat4 m, vec4 v) { return v.xyz.x * m.a + v.xyz.y * m.b + v.xyz.z * m.c + v.w * m.d; }
__device__ inline vec4 operator*(vec4 v, mat4 m) { return vec4(dot(v, m.a), dot(v, m.b), dot(v, m.c), dot(v, m.d)); }
