// Output of the passes that gather light. With LAYERS, light is kept in three layers by its defocus, so that each can be
// smoothed by what lies between neighbouring views: in front of the focus plane, in focus, behind it. Premultiplied.
layout(location = 0) out vec4 in_focus;
#ifdef LAYERS
layout(location = 1) out vec4 in_front;
layout(location = 2) out vec4 behind;

uniform vec2 defocus_px_from_depth;  // factor and offset: depth 0..1 (colors.a) to blur width in output px, > 0 in front

// Shares of (front, behind) for a blur width; below one pixel nothing needs smoothing.
vec2 layer_shares(float depth) {
    float width_px = depth * defocus_px_from_depth.x + defocus_px_from_depth.y;
    return clamp(vec2(width_px, -width_px) - 1.0, 0.0, 1.0);
}
#endif
