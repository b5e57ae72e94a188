// Output of the passes that gather light: sums weighted by alpha, which the last pass divides by. LAYERS: light is kept
// apart by its defocus, so that what is defocused can be smoothed by what lies between neighbouring samples.
layout(location = 0) out vec4 in_focus;
#ifdef LAYERS
layout(location = 1) out vec4 in_front;
layout(location = 2) out vec4 behind;
#endif

uniform float blur_px;         // output px that one px of disparity beside the focus moves from one sample to the next
uniform vec2 sharp_up_to_px;   // blur where the sharp layer begins to fade, and where it ends

// Blur for a depth of 0..1 (colors.a), in units of the fade: factor and offset. Positive in front of the focus.
vec2 blur_from_depth(float focus) {
    return blur_px * vec2(nearest - farthest, farthest - focus) / (sharp_up_to_px.y - sharp_up_to_px.x);
}

float blur_beyond_range(float blur) {
#ifdef RANGE
    float range = blur_px * focus_range / (sharp_up_to_px.y - sharp_up_to_px.x);
    return blur - clamp(blur, -range, range);
#else
    return blur;
#endif
}

// Share of the sharp layer; of what is left, all lies on its own side of the focus plane.
float sharpness(float blur) {
    return clamp(sharp_up_to_px.y / (sharp_up_to_px.y - sharp_up_to_px.x) - abs(blur), 0.0, 1.0);
}
