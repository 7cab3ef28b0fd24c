uniform sampler2D rays; // output of mask_near.glsl and trace.glsl
uniform sampler2D normals; // output of gradient.glsl

// Pass of a frame that writes only depth: 1 where a ray is near the shape or has hit, but has no normal yet; 0 elsewhere.
void main() {
    ivec2 here = ivec2(gl_FragCoord.xy);
    gl_FragDepth = float(texelFetch(rays, here, 0).a > 0.5 && texelFetch(normals, here, 0).a < 0.0);
}
