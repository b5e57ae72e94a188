// The stored views. colors.rgb: square root of linear light; colors.a: disparity, 0..1 from farthest to nearest.
uniform sampler2DArray colors;
uniform sampler2DArray disparities;  // px per view step, nearest texel
uniform vec2 view_size_px;
uniform vec2 view_step;              // distances of views across and down, in those of columns: (1, row step)
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

// Outside every view, sample mirrored content: clamping would show streaks.
vec2 mirrored(vec2 at) {
    return 1.0 - abs(1.0 - abs(at));
}

// 1 inside a view, next to nothing outside: other views know better there.
float in_picture(vec2 at) {
    vec2 off_centre = abs(at - 0.5);
    return max(off_centre.x, off_centre.y) > 0.5 ? 1e-4 : 1.0;
}

vec4 light_from_root(vec4 root) {
    vec4 light = vec4(root.rgb * root.rgb, root.a);
#ifdef HIGHLIGHTS
    // Light is clipped if all channels clip: a single clipped channel is a saturated colour.
    float clipped = clamp(20.0 * min(min(root.r, root.g), root.b) - 19.0, 0.0, 1.0);
    light.rgb *= 1.0 + highlight_gain * clipped * clipped;
#endif
    return light;
}

// Linear light and depth (0..1) of a stored view, between pixels: interpolated by Keys' kernel (1981; a = -0.75, which
// keeps the view's sharpness best) in five bilinear fetches, without the corners of its 16 taps, whose weights are next to
// nothing.
vec4 light_at(vec2 at, float layer) {
    at = clamp(mirrored(at), 0.0, 1.0);
    vec2 texel = at * view_size_px - 0.5, f = fract(texel), first = floor(texel);
    vec2 before = -0.75 * f * (1.0 - f) * (1.0 - f), after = -0.75 * f * f * (1.0 - f), inner = 1.0 - before - after;
    vec2 centre = (first + f * (0.75 + f * (1.5 - 1.25 * f)) / inner + 0.5) / view_size_px;
    vec4 ends = (vec4(first - 1.0, first + 2.0) + 0.5) / view_size_px.xyxy;
    vec4 weights = vec4(before, after) * inner.yxyx;
    float middle = inner.x * inner.y;
    vec4 root = middle * textureLod(colors, vec3(centre, layer), 0.0);
    root += weights.x * textureLod(colors, vec3(ends.x, centre.y, layer), 0.0);
    root += weights.y * textureLod(colors, vec3(centre.x, ends.y, layer), 0.0);
    root += weights.z * textureLod(colors, vec3(ends.z, centre.y, layer), 0.0);
    root += weights.w * textureLod(colors, vec3(centre.x, ends.w, layer), 0.0);
    return light_from_root(max(root / (middle + dot(weights, vec4(1.0))), 0.0));
}
