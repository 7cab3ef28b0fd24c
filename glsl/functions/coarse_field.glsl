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
