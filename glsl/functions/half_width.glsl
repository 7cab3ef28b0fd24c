// half_width(): half-width of a level's band at a point p, model space. Reads delta[]. narrow_bands.glsl replaces this file
// if the half-width depends on p.
float half_width(vec3 p, int level) { return delta[level - 1]; }
