// What is summed: points of the lens, each answered by a stored view (the one there, or the nearest one present).
#include "field.glsl"

const int MAX_SAMPLES = 512;

layout(std140) uniform Samples {
    vec4 samples[MAX_SAMPLES];  // xy: (s, t) from the eye, view steps; z: layer; w: weight, all sum to 1
    vec4 reprojections[MAX_SAMPLES];  // xy: stored less wanted view, view steps; z: 1 = has disparity; w: weight where
                                      // samples are sparse
};
uniform int sample_count;
#ifdef DOLLY
uniform sampler2D fallback_views;  // by place in the grid: nearest view's (column, row); z: 1 = has disparity; w: layer
uniform vec2 eye_in_grid;     // (column, row), real
#endif
#ifdef CAT_EYE
uniform vec3 barrel;         // xy: how far its opening moves across the picture, view steps; z: radius
uniform float sample_width;  // view steps
#endif

struct FallbackView {
    float layer;
    vec2 reprojection;    // view steps
    float has_disparity;
};

#ifdef DOLLY
FallbackView fallback_view_of(int i, vec2 uv) {
    vec2 wanted = eye_in_grid + dolly * (uv - 0.5) + samples[i].xy;
    ivec2 size = textureSize(fallback_views, 0);
    vec4 stored = texelFetch(fallback_views, clamp(ivec2(floor(wanted + 0.5)), ivec2(0), size - 1), 0);
    return FallbackView(stored.w, stored.xy - wanted, stored.z);
}
#else
FallbackView fallback_view_of(int i, vec2 uv) {
    return FallbackView(samples[i].z, reprojections[i].xy, reprojections[i].z);
}
#endif

// Where the surface that this sample sees at `uv` lies in the stored view, and 1; next to nothing where none is found.
// In-focus content is right at once, and there an error would be seen; the rest comes close in three steps.
vec3 reprojected_place(vec2 uv, vec2 offset, FallbackView fallback, float focus) {
    vec2 texel = 1.0 / view_size_px;
#ifdef RANGE
    float disparity = max(nearest, focus), before;
    for (int k = 0; k < 5; k++) {  // from the foreground: the nearest surface wins
        before = disparity;
        float sheared = clamp(disparity, focus - focus_range, focus + focus_range);
        vec2 at = uv - (offset * sheared + fallback.reprojection * disparity) * texel;
        disparity = mix(focus, textureLod(disparities, vec3(at, fallback.layer), 0.0).r, fallback.has_disparity);
    }
    float sheared = clamp(disparity, focus - focus_range, focus + focus_range);
    vec2 at = uv - (offset * sheared + fallback.reprojection * disparity) * texel;
    // Still moving: the steps found no surface that agrees.
    float missed_px = length(offset * (sheared - clamp(before, focus - focus_range, focus + focus_range))
        + fallback.reprojection * (disparity - before));
    return vec3(at, missed_px > 1.0 ? 1e-3 : 1.0);
#else
    // Fixed point d = disparity(at - d reprojection), from the focus on.
    vec2 at = uv - offset * focus * texel;
    float disparity = focus, before = focus;
    for (int k = 0; k < 3; k++) {
        vec2 there = at - disparity * fallback.reprojection * texel;
        float seen = textureLod(disparities, vec3(there, fallback.layer), 0.0).r;
        before = disparity;
        disparity = mix(focus, seen, fallback.has_disparity);
    }
    // In a hole the steps go back and forth between foreground and background; the foreground's lands on background.
    return vec3(at - max(disparity, before) * fallback.reprojection * texel, 1.0);
#endif
}

// How much of this sample the lens barrel leaves.
float barrel_share(vec2 offset, vec2 uv) {
#ifdef CAT_EYE
    return clamp(0.5 + (barrel.z - length(offset - barrel.xy * (uv - 0.5))) / sample_width, 0.0, 1.0);
#else
    return 1.0;
#endif
}
