// How wide the smoothing between samples has to be.
uniform sampler2D tiles;  // see widen_tiles.frag
uniform float passes;     // of the picture that are drawn
uniform float spread;     // how wide smoothing is after one of them, as a share of the blur that the tiles tell

// px squared: half the size is a blur too, as wide as a box of this width squared.
const float HALF_SIZE_BLUR = 11.0;

// Of a pixel's tile.
float passes_wanted(vec2 target_uv) {
    return texelFetch(tiles, ivec2(target_uv * vec2(textureSize(tiles, 0))), 0).z;
}

// In front and behind, output px: more passes leave less between samples.
vec2 blur_width_px(vec2 target_uv) {
    float drawn = min(passes, passes_wanted(target_uv));
    return min(spread * inversesqrt(drawn), 1.0) * textureLod(tiles, target_uv, 0.0).xy;
}
