// Values of the uniform `shading`; shade.glsl defines them.
const int SHADE_PHONG = 0;
const int SHADE_NORMAL = 1;
const int SHADE_DEPTH = 2;
const int SHADE_STEPS = 3;
const int SHADE_TEXTURE = 4;
const int SHADE_SOFTBOX = 5;
const int SHADE_DATA = 6;
