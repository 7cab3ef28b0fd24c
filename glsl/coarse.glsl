// coarse(): level 1's field at any point p, model space. The network knows the unit ball, which holds the shape. Since the
// ball is convex, a point outside is at least as far from the shape as the hypotenuse of the way to the ball and the
// distance from there.
float coarse(vec3 p) {
    float far = sqrt(dot(p, p));
    int reached;
    float f = field(p / max(far, 1.0), 1, reached);
    float outside = far - 1.0;
    float inside = max(f, 0.0);
    return outside > 0.0 ? sqrt(outside * outside + inside * inside) : f;
}
