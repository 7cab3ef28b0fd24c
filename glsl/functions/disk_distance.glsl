// disk_distance(): gradient and value of the distance to a round plate below y = 0.
vec4 disk_distance(vec3 q, float radius, float half_thickness) {
    float around = length(q.xz), y = q.y + half_thickness;
    float beside = around - radius, above = abs(y) - half_thickness;
    vec2 out_of = max(vec2(beside, above), 0.);
    float away = length(out_of);
    vec2 slope = away > 0. ? out_of / away : beside > above ? vec2(1., 0.) : vec2(0., 1.);
    vec2 rim = slope.x * q.xz / max(around, 1e-12);
    return vec4(rim.x, slope.y * (y < 0. ? -1. : 1.), rim.y, min(max(beside, above), 0.) + away);
}
