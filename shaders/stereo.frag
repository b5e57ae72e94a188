#version 330 core
// The pictures of both eyes woven into one for a display. A switch names the arrangement, as SBS or TOP_BOTTOM does.
// EXACT: the pictures are drawn in the pixels of the screen.
#include "sheet.glsl"
#include "srgb.glsl"

uniform mat3 left_seen, right_seen;  // light of the display from the light of each eye's picture

out vec4 color;

// The light that an eye sees at a pixel of its room, from the upper left corner.
vec3 seen(int eye, vec2 at) {
    vec2 place = at - floor((frame_px - tile_px) / 2.0);
    if (any(lessThan(place, vec2(0.0))) || any(greaterThan(place, tile_px))) return vec3(0.0);
#ifdef EXACT
    ivec2 texel = ivec2(place.x + float(eye) * tile_px.x, tile_px.y - place.y);
    return texelFetch(sheet, texel, 0).rgb;
#else
    return picture_at(eye, place / tile_px);
#endif
}

vec3 linear_from_srgb(vec3 code) {
    return mix(pow((code + 0.055) / 1.055, vec3(2.4)), code / 12.92, vec3(lessThanEqual(code, vec3(0.04045))));
}

void main() {
    vec2 at = vec2(gl_FragCoord.x, screen_px.y - gl_FragCoord.y);
    ivec2 pixel = ivec2(at);
#ifdef ANAGLYPH
    vec3 left = clamp(left_seen * linear_from_srgb(seen(0, at)), 0.0, 1.0);
    vec3 right = clamp(right_seen * linear_from_srgb(seen(1, at)), 0.0, 1.0);
    color = vec4(srgb_from_linear(clamp(left + right, 0.0, 1.0)), 1.0);
#else
#if defined(SBS) || defined(HALF_SBS) || defined(CROSS_EYED)
    int second = int(at.x > frame_px.x);
    at.x -= float(second) * frame_px.x;
#elif defined(TOP_BOTTOM)
    int second = int(at.y > frame_px.y);
    at.y -= float(second) * frame_px.y;
#elif defined(ROWS)
    int second = pixel.y & 1;
#elif defined(COLUMNS)
    int second = pixel.x & 1;
#else
    int second = (pixel.x + pixel.y) & 1;
#endif
    color = vec4(seen(second, at), 1.0);
#endif
}
