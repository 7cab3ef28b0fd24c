// Vertices that add packed samples to the picture: one point for each sample, in the sample's pixel.
uniform sampler2D points; // points of the samples (sample_point.glsl)
uniform int across; // samples in a row
uniform vec2 size; // of the picture, pixels
flat out ivec2 from; // the sample
void main() {
    from = ivec2(gl_VertexID % across, gl_VertexID / across);
    vec2 pixel = floor(texelFetch(points, from, 0).xy) + 0.5;
    gl_Position = vec4(2.0 * pixel / size - 1.0, 0.0, 1.0);
    gl_PointSize = 1.0;
}
