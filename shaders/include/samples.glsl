// What is summed: views the eye's aperture asks for, each answered by a stored view (itself, or the nearest one present).
#include "field.glsl"

const int MAX_SAMPLES = 512;

layout(std140) uniform Samples {
    vec4 samples[MAX_SAMPLES];  // xy: shift to the focus plane in texture coordinates; z: layer; w: weight, all sum to 1
    vec4 detours[MAX_SAMPLES];  // xy: texture coordinates per px of disparity, wanted view to stored; z: 1 = has disparity
};
uniform int sample_count;

// Where the surface at `at` of the wanted view lies in the stored one. In-focus content is right at once, and that is
// where the eye would see an error; the rest is out of focus and comes close enough in three steps.
vec2 detoured(vec2 at, vec4 wanted, vec4 detour) {
    float disparity = focus_disparity, before = focus_disparity;
    for (int k = 0; k < 3; k++) {
        float seen = textureLod(disparities, vec3(at - disparity * detour.xy, wanted.z), 0.0).r;
        before = disparity;
        disparity = mix(focus_disparity, seen, detour.z);
    }
    // In a hole the steps go back and forth between foreground and background; the foreground's shift lands on background.
    return at - max(disparity, before) * detour.xy;
}
