// The hull of a model in a scene of three.js. `at`: its point, model space. eye, ahead: of the camera, model space; ahead is
// 0 for a perspective camera. depth_z, depth_w: rows of the matrix from model space to the clip space. into_world: from a normal
// in model space to one in the world.
varying vec3 at;
flat varying vec3 eye, ahead;
flat varying vec4 depth_z, depth_w;
flat varying mat3 into_world;

void main() {
    at = position;
    mat4 back = inverse(modelViewMatrix), clip = projectionMatrix * modelViewMatrix;
    bool perspective = projectionMatrix[2][3] != 0.0;
    eye = back[3].xyz;
    ahead = perspective ? vec3(0.0) : normalize(-back[2].xyz);
    depth_z = vec4(clip[0].z, clip[1].z, clip[2].z, clip[3].z);
    depth_w = vec4(clip[0].w, clip[1].w, clip[2].w, clip[3].w);
    into_world = transpose(inverse(mat3(modelMatrix)));
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}
