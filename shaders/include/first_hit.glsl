// Finds the surface that a virtual eye sees in a stored view: the nearest one whose disparity agrees with the shift that
// its own disparity causes.
#include "field.glsl"

struct Surface {
    float disparity;
    vec2 at;         // texture coordinates in the stored view
    bool is_hidden;  // the stored view does not see it: `at` is the background beside what covers it, or off the border
};

float disparity_at(vec2 at, float layer) {
    return textureLod(disparities, vec3(at, layer), 0.0).r;
}

// Pixels at a depth edge mix both sides. Background shown apart from its foreground must not carry that seam along: it is
// read a little farther from the edge. `step_at`: 2 px along the parallax, or all of it, in texture coordinates.
vec2 clear_of_seam(vec2 at, float layer, float disparity, float edge_height, vec2 step_at) {
    bool covered_after = disparity_at(at + step_at, layer) > disparity + edge_height;
    bool covered_before = disparity_at(at - step_at, layer) > disparity + edge_height;
    return at + step_at * (float(covered_before) - float(covered_after));
}

// delta: texture coordinates per px of disparity, from the eye to the view. steps: at least one per pixel of parallax.
// span: the first and the last of them that can tell anything.
// The search goes from near to far. A step over a depth edge is no surface (accepting it stretches the foreground like a
// rubber sheet): the search goes on behind it, and where it ends there, the eye sees what the view does not.
Surface first_hit(vec2 uv, float layer, vec2 delta, int steps, ivec2 span) {
    // A ray march from the nearest disparity to the farthest; stride: disparity of one step.
    float stride = (nearest - farthest) / float(steps);
    vec2 parallax_px = delta * (nearest - farthest) * view_size_px;
    vec2 seam = parallax_px * min(1.0, 2.0 / max(length(parallax_px), 1e-6)) / view_size_px;
    vec2 edge = uv - delta * farthest;
    for (int k = span.x; k <= span.y; k++) {
        float seen;
        // On to the first step at which the view's surface agrees with the disparity of the step.
        for (; k <= span.y; k++) {
            float disparity = nearest - stride * float(k);
            vec2 at = uv - delta * disparity;
            seen = disparity_at(at, layer);
            // The surface lies farther than the step: still in empty space. Nearer by more: an edge was stepped over.
            if (seen - disparity < -0.5 * stride) edge = at;
            else if (seen - disparity <= 1.5 * stride || k == 0) break;
        }
        if (k > span.y) break;
        // One step of the fixed point d = disparity(uv - delta d): sharper than the stride.
        float refined = disparity_at(uv - delta * seen, layer);
        if (refined < seen - 1.5 * stride) continue;  // beside the edge of a surface, not on it
        vec2 found = clear_of_seam(uv - delta * refined, layer, refined, 1.5 * stride, seam);
        return Surface(refined, found, in_picture(found) < 1.0);
    }
    // Nothing found: the background beside the last edge.
    return Surface(disparity_at(edge - seam, layer), edge - seam, true);
}
