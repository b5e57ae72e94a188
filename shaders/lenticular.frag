#version 330 core
// A quilt woven for a lenticular display: every subpixel shows what is seen from the side to which its lens sends the
// light, blended from the two nearest views. Row 0 lies at the bottom, in the quilt and on the screen.
uniform sampler2D quilt;     // view 0, the leftmost one, at the bottom left
uniform ivec2 tiles;         // columns and rows
uniform vec2 tile_px;        // size of a view
uniform vec2 screen_px;      // size of the screen
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

vec3 view_color(int view, vec2 at) {
    vec2 corner = vec2(view % tiles.x, view / tiles.x) * tile_px;
    return texture(quilt, (corner + clamp(at * tile_px, vec2(0.5), tile_px - 0.5)) / vec2(textureSize(quilt, 0))).rgb;
}

void main() {
    int first = 3 * cell_of(ivec2(gl_FragCoord.xy)), last = tiles.x * tiles.y - 1;
    vec2 at = mix(gl_FragCoord.xy, screen_px - gl_FragCoord.xy, is_mirrored) / screen_px;
    for (int i = 0; i < 3; i++) {
        vec2 emitter = gl_FragCoord.xy + emitters[first + i];
        emitter.x = mix(emitter.x, screen_px.x - emitter.x, is_mirrored.x);
        float across = fract(dot(emitter, lenses_per_px) - center);
        float view = clamp(mix(across, 1.0 - across, is_inverted) * float(last + 1) - 0.5, 0.0, float(last));
        int left = int(view);
        color[i] = mix(view_color(left, at), view_color(min(left + 1, last), at), view - float(left))[i];
    }
    color.a = 1.0;
}
