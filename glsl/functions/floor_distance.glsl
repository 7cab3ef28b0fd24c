// floor_distance(): distance along a ray to the floor; -1 if the ray does not meet it from above.
// origin, direction: model space, direction of length 1; ground: height of the floor.
float floor_distance(vec3 origin, vec3 direction, float ground) {
    return direction.y < 0.0 && origin.y > ground ? (ground - origin.y) / direction.y : -1.0;
}
