// How wide the smoothing between samples has to be.
uniform sampler2D tiles;      // see widen_tiles.frag
uniform float narrowing;      // what remains of the blur that the tiles tell: more passes leave less in between

// px squared: half the size is a blur too, as wide as a box of this width squared.
const float HALF_SIZE_BLUR = 11.0;

// In front and behind, output px.
vec2 blur_width_px(vec2 target_uv) {
    return narrowing * textureLod(tiles, target_uv, 0.0).xy;
}
