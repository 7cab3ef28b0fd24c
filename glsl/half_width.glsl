// half_width(): half the width of a level's band at a point p, model space. Reads delta[]. Texts whose bands are narrower in
// places have narrow_bands.glsl in place of this.
float half_width(vec3 p, int level) { return delta[level - 1]; }
