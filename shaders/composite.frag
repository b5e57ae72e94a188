#version 330 core
// The blurred slices of a picture, composited from near to far.
const int MAX_SLICES = 32;
const float OPEN_AT = 0.05;  // coverage from which on a slice continues the surface before it

uniform sampler2D atlas;           // blurred slices
uniform vec4 places[MAX_SLICES];   // pixel of the atlas: xy + z * pixel of the target

flat in uint slices;
out vec4 sum;

// A slice at a place of the target. A reduced one is enlarged by Keys' kernel, as views are (see light_at in field.glsl):
// a bilinear one would soften the rims of discs.
vec4 slice_at(int k, vec2 at) {
    vec2 size = vec2(textureSize(atlas, 0)), texel = places[k].xy + places[k].z * at - 0.5;
    vec2 first = floor(texel), f = texel - first;
    vec2 before = -0.75 * f * (1.0 - f) * (1.0 - f), after = -0.75 * f * f * (1.0 - f), inner = 1.0 - before - after;
    vec2 centre = (first + f * (0.75 + f * (1.5 - 1.25 * f)) / inner + 0.5) / size;
    vec4 ends = (vec4(first - 1.0, first + 2.0) + 0.5) / size.xyxy, weights = vec4(before, after) * inner.yxyx;
    float middle = inner.x * inner.y;
    vec4 sum = middle * textureLod(atlas, centre, 0.0);
    sum += weights.x * textureLod(atlas, vec2(ends.x, centre.y), 0.0);
    sum += weights.y * textureLod(atlas, vec2(centre.x, ends.y), 0.0);
    sum += weights.z * textureLod(atlas, vec2(ends.z, centre.y), 0.0);
    sum += weights.w * textureLod(atlas, vec2(centre.x, ends.w), 0.0);
    return max(sum / (middle + dot(weights, vec4(1.0))), 0.0);
}

void main() {
    vec3 light = vec3(0.0);
    // What passes the surfaces that are complete, and how much of the rest the last one covers. Neighbouring slices of
    // one surface add up; surfaces apart hide each other by chance.
    float passed = 1.0, covered = 0.0;
    uint left = slices;
    while (left != 0u) {
        uint lowest = left & (~left + 1u);
        left ^= lowest;
        int k = int(log2(float(lowest)) + 0.5);
        vec4 slice = slice_at(k, gl_FragCoord.xy);
        float alpha = clamp(slice.a, 0.0, 1.0), stays_open = min(alpha / OPEN_AT, 1.0);
        float closed = 1.0 - (1.0 - stays_open) * covered;
        passed *= closed;
        covered = stays_open * covered / max(closed, 1e-6);
        float shown = min(alpha, 1.0 - covered);
        light += passed * shown * slice.rgb / max(slice.a, 1e-6);
        covered += shown;
    }
    sum = vec4(light, max(1.0 - passed * (1.0 - covered), 1e-6));
}
