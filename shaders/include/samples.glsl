// What is summed: points of the lens, each answered by a stored view (the one there, or the nearest one present).
#include "field.glsl"

const int MAX_SAMPLES = 512;

layout(std140) uniform Samples {
    vec4 samples[MAX_SAMPLES];  // xy: (s, t) from the eye, view steps; z: layer; w: weight, all sum to 1
    vec4 detours[MAX_SAMPLES];  // xy: stored less wanted view, view steps; z: 1 = has disparity; w: weight of the few
};
uniform int sample_count;
#ifdef DOLLY
uniform sampler2D stand_ins;  // by place in the grid: nearest view's (column, row); z: 1 = has disparity; w: layer
uniform vec2 eye_in_grid;     // (column, row), real
#endif
#ifdef CAT_EYE
uniform vec3 barrel;         // xy: how far its opening moves across the picture, view steps; z: radius
uniform float sample_width;  // view steps
#endif

struct Answer {
    float layer;
    vec2 detour;          // view steps
    float has_disparity;
};

#ifdef DOLLY
Answer answer_of(int i, vec2 uv) {
    vec2 wanted = eye_in_grid + dolly * (uv - 0.5) + samples[i].xy;
    ivec2 size = textureSize(stand_ins, 0);
    vec4 stored = texelFetch(stand_ins, clamp(ivec2(floor(wanted + 0.5)), ivec2(0), size - 1), 0);
    return Answer(stored.w, stored.xy - wanted, stored.z);
}
#else
Answer answer_of(int i, vec2 uv) {
    return Answer(samples[i].z, detours[i].xy, detours[i].z);
}
#endif

// Where the surface that this sample sees at `uv` lies in the stored view, and 1; next to nothing where none is found.
// In-focus content is right at once, and there an error would be seen; the rest comes close in three steps.
vec3 detoured(vec2 uv, vec2 offset, Answer answer, float focus) {
    vec2 texel = 1.0 / view_size_px;
#ifdef RANGE
    float disparity = max(nearest, focus), before;
    for (int k = 0; k < 5; k++) {  // from the front: the nearest surface wins
        before = disparity;
        float sheared = clamp(disparity, focus - focus_range, focus + focus_range);
        vec2 at = uv - (offset * sheared + answer.detour * disparity) * texel;
        disparity = mix(focus, textureLod(disparities, vec3(at, answer.layer), 0.0).r, answer.has_disparity);
    }
    float sheared = clamp(disparity, focus - focus_range, focus + focus_range);
    vec2 at = uv - (offset * sheared + answer.detour * disparity) * texel;
    float missed_px = length(offset * (sheared - clamp(before, focus - focus_range, focus + focus_range))
        + answer.detour * (disparity - before));
    return vec3(at, missed_px > 1.0 ? 1e-3 : 1.0);
#else
    vec2 at = uv - offset * focus * texel;
    float disparity = focus, before = focus;
    for (int k = 0; k < 3; k++) {
        float seen = textureLod(disparities, vec3(at - disparity * answer.detour * texel, answer.layer), 0.0).r;
        before = disparity;
        disparity = mix(focus, seen, answer.has_disparity);
    }
    // In a hole the steps go back and forth between foreground and background; the foreground's lands on background.
    return vec3(at - max(disparity, before) * answer.detour * texel, 1.0);
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
