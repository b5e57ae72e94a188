#version 330 core
// Pictures woven for a lenticular display: every subpixel shows what is seen from the side to which its lens sends the
// light, blended from the two nearest pictures. The rooms of pictures are stretched over the screen, whose row 0 lies at
// the bottom.
#include "sheet.glsl"

uniform int views;           // number of pictures, the leftmost first
uniform vec2 lenses_per_px;  // lenses that a step of one pixel crosses
uniform float center;        // part of a lens
uniform vec2 is_mirrored;    // 1 where the picture is seen mirrored
uniform float is_inverted;   // 1 where views are counted against x
uniform vec2 emitters[48];   // red, green and blue of each cell, in pixels
uniform int cells, pattern;

out vec4 color;

int cell_of(ivec2 pixel) {
    int odd_x = pixel.x % 2, odd_y = pixel.y % 2;
    int cell = pattern == 1 ? odd_x ^ odd_y : pattern == 2 ? odd_x : pattern == 4 ? odd_y : 0;
    if (pattern == 3) cell = (pixel.y + 2 * odd_x) % 4;
    return cell % cells;
}

void main() {
    int first = 3 * cell_of(ivec2(gl_FragCoord.xy));
    vec2 at = mix(gl_FragCoord.xy, screen_px - gl_FragCoord.xy, is_mirrored) / screen_px;
    vec2 place = (vec2(at.x, 1.0 - at.y) * frame_px - floor((frame_px - tile_px) / 2.0)) / tile_px;
    color = vec4(0.0, 0.0, 0.0, 1.0);
    if (any(lessThan(place, vec2(0.0))) || any(greaterThan(place, vec2(1.0)))) return;
    for (int i = 0; i < 3; i++) {
        vec2 emitter = gl_FragCoord.xy + emitters[first + i];
        emitter.x = mix(emitter.x, screen_px.x - emitter.x, is_mirrored.x);
        float across = fract(dot(emitter, lenses_per_px) - center);
        float view = clamp(mix(across, 1.0 - across, is_inverted) * float(views) - 0.5, 0.0, float(views - 1));
        int left = int(view);
        color[i] = mix(picture_at(left, place), picture_at(min(left + 1, views - 1), place), view - float(left))[i];
    }
}
