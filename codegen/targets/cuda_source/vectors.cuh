// vectors.cuh: what the program and the kernels use of GLSL's types and functions.
struct vec3 {
    float x, y, z;
    vec3() = default;
    __host__ __device__ constexpr vec3(float x, float y, float z) : x(x), y(y), z(z) {}
    __host__ __device__ explicit constexpr vec3(float all) : x(all), y(all), z(all) {}
};

struct vec4 {
    vec3 xyz;
    float w;
    vec4() = default;
    __host__ __device__ constexpr vec4(float x, float y, float z, float w) : xyz(x, y, z), w(w) {}
    __host__ __device__ constexpr vec4(vec3 xyz, float w) : xyz(xyz), w(w) {}
    __host__ __device__ explicit constexpr vec4(float all) : xyz(all), w(all) {}
};

// Columns.
struct mat4 {
    vec4 a, b, c, d;
    mat4() = default;
    __host__ __device__ constexpr mat4(vec4 a, vec4 b, vec4 c, vec4 d) : a(a), b(b), c(c), d(d) {}
};

__device__ inline vec3 operator+(vec3 a, vec3 b) { return vec3(a.x + b.x, a.y + b.y, a.z + b.z); }
__device__ inline vec3 operator-(vec3 a, vec3 b) { return vec3(a.x - b.x, a.y - b.y, a.z - b.z); }
__device__ inline vec3 operator*(vec3 a, vec3 b) { return vec3(a.x * b.x, a.y * b.y, a.z * b.z); }
__device__ inline vec3 operator*(float s, vec3 a) { return vec3(s * a.x, s * a.y, s * a.z); }
__device__ inline vec3 operator-(vec3 a) { return vec3(-a.x, -a.y, -a.z); }
__device__ inline float dot(vec3 a, vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
__device__ inline vec3 normalize(vec3 a) { return 1.0f / sqrtf(dot(a, a)) * a; }
__device__ inline float length(vec3 a) { return sqrtf(dot(a, a)); }
__device__ inline vec3 reflect(vec3 incident, vec3 normal) { return incident - 2.0f * dot(normal, incident) * normal; }

__device__ inline vec4 operator+(vec4 a, vec4 b) { return vec4(a.xyz + b.xyz, a.w + b.w); }
__device__ inline vec4 operator*(vec4 a, vec4 b) { return vec4(a.xyz * b.xyz, a.w * b.w); }
__device__ inline vec4 operator*(float s, vec4 a) { return vec4(s * a.xyz, s * a.w); }
__device__ inline vec4 &operator+=(vec4 &a, vec4 b) { return a = a + b; }
__device__ inline float dot(vec4 a, vec4 b) { return dot(a.xyz, b.xyz) + a.w * b.w; }
__device__ inline vec4 sin(vec4 a) { return vec4(sinf(a.xyz.x), sinf(a.xyz.y), sinf(a.xyz.z), sinf(a.w)); }
__device__ inline vec4 cos(vec4 a) { return vec4(cosf(a.xyz.x), cosf(a.xyz.y), cosf(a.xyz.z), cosf(a.w)); }
__device__ inline vec4 operator*(mat4 m, vec4 v) {
    return v.xyz.x * m.a + v.xyz.y * m.b + v.xyz.z * m.c + v.w * m.d;
}
__device__ inline vec4 operator*(vec4 v, mat4 m) { return vec4(dot(v, m.a), dot(v, m.b), dot(v, m.c), dot(v, m.d)); }
// mat3(m) * v
__device__ inline vec3 rotate(mat4 m, vec3 v) { return v.x * m.a.xyz + v.y * m.b.xyz + v.z * m.c.xyz; }

__device__ inline float abs(float a) { return fabsf(a); }
__device__ inline float clamp(float a, float low, float high) { return fminf(fmaxf(a, low), high); }
__device__ inline vec3 clamp(vec3 a, float low, float high) {
    return vec3(clamp(a.x, low, high), clamp(a.y, low, high), clamp(a.z, low, high));
}
__device__ inline vec3 mix(vec3 a, vec3 b, float share) { return (1.0f - share) * a + share * b; }
__device__ inline float smoothstep(float low, float high, float a) {
    float x = clamp((a - low) / (high - low), 0.0f, 1.0f);
    return x * x * (3.0f - 2.0f * x);
}
