uniform sampler2D rays; // what near.glsl and trace.glsl wrote, pixel by pixel
uniform sampler2D normals; // what normals.glsl wrote

// A pass of a frame that writes depth alone: 1 where a ray came near, or has hit, and has no normal yet, and 0 elsewhere.
void main() {
    ivec2 here = ivec2(gl_FragCoord.xy);
    gl_FragDepth = float(texelFetch(rays, here, 0).a > 0.5 && texelFetch(normals, here, 0).a < 0.0);
}
