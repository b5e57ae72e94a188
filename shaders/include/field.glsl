// The stored views. colors.rgb: square root of linear light; colors.a: disparity, 0..1 from farthest to nearest.
uniform sampler2DArray colors;
uniform sampler2DArray disparities;  // px per view step, nearest texel
uniform vec2 view_size_px;
uniform float nearest, farthest;     // range of disparities, px per view step
uniform float focus_disparity;       // in the picture's middle
uniform vec2 focus_tilt;             // how much it grows to the right and to the lower border
uniform float focus_range;           // px per view step to both sides of the focus that are sharp too
uniform vec2 dolly;                  // how far from the eye a pixel's ray crosses the grid, view steps per picture size
#ifdef HIGHLIGHTS
uniform float highlight_gain;        // what clipped light counts for beyond white
#endif

// The sharp disparity at a place of the picture.
float focus_at(vec2 uv) {
    return focus_disparity + dot(focus_tilt, 2.0 * uv - 1.0);
}

vec4 linear_from_stored(vec4 stored) {
    vec4 light = vec4(stored.rgb * stored.rgb, stored.a);
#ifdef HIGHLIGHTS
    // Only where all channels clip: one alone is a saturated colour.
    float clipped = clamp(20.0 * min(min(stored.r, stored.g), stored.b) - 19.0, 0.0, 1.0);
    light.rgb *= 1.0 + highlight_gain * clipped * clipped;
#endif
    return light;
}

// Where no view has the content asked for, beyond all borders, the views' mirror images stand in: streaks would be seen.
vec2 mirrored(vec2 at) {
    return 1.0 - abs(1.0 - abs(at));
}

// 1 where a view has the content asked for, next to nothing beyond its border: there, other views know better.
float in_picture(vec2 at) {
    vec2 off_centre = abs(at - 0.5);
    return max(off_centre.x, off_centre.y) > 0.5 ? 1e-4 : 1.0;
}
