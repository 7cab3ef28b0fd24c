// dither(): noise within half a step of 8 bits, to add to sRGB before rounding: it prevents bands in the background
// (Jimenez 2014, interleaved gradient noise). Colors that are exact in 8 bits do not change. pixel: of the screen.
float dither(vec2 pixel) {
    return (fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715)))) - 0.5) / 255.0;
}
