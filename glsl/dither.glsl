// dither(): between half a step of 8 bits down and half a step up, to be added to sRGB before it is rounded to 8 bits:
// no bands in the background (Jimenez 2014, interleaved gradient noise). A colour of 8 bits stays as it is.
// pixel: of the screen.
float dither(vec2 pixel) {
    return (fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715)))) - 0.5) / 255.0;
}
