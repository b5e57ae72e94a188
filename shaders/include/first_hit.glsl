// Finds the surface that a camera in the lens sees, in a stored view: the nearest one whose disparity agrees with the
// shift that its own disparity causes.
#include "field.glsl"

const float MAX_SEARCH_STEPS = 96.0;  // one per pixel of parallax as long as that suffices

// A pixel of the picture as a camera sees it. The picture is sheared to the focus: content in focus does not move with
// the camera. camera: from the eye to the camera; to_view: from the camera to the stored view, layer: which one. Both in
// texture coordinates per px of disparity.
struct Ray {
    vec2 uv, camera, to_view;
    float layer, focus;
};

struct Surface {
    float disparity;
    vec2 at;         // texture coordinates in the stored view
    bool is_hidden;  // the stored view does not see it: `at` is the background beside what covers it
};

// The place in the stored view of a surface of some disparity that lies on the ray.
vec2 place_at(Ray ray, float disparity) {
    return ray.uv - ray.camera * ray.focus - ray.to_view * disparity;
}

// DISPARITY_IN_ALPHA: colours have it in alpha, 0 for the farthest and 1 for the nearest.
float disparity_at(vec2 at, float layer) {
#ifdef DISPARITY_IN_ALPHA
    ivec2 texel = clamp(ivec2(floor(at * view_size_px)), ivec2(0), textureSize(colors, 0).xy - 1);
    return mix(farthest, nearest, texelFetch(colors, ivec3(texel, layer), 0).a);
#else
    return textureLod(disparities, vec3(at, layer), 0.0).r;
#endif
}

// Pixels at a depth edge mix both sides. Background shown apart from its foreground must not carry that seam along: it is
// read a little farther from the edge. seam: 2 px along the parallax, or all of it, in texture coordinates.
vec2 clear_of_seam(vec2 at, float layer, float disparity, float edge_height, vec2 seam) {
    bool covered_after = disparity_at(at + seam, layer) > disparity + edge_height;
    bool covered_before = disparity_at(at - seam, layer) > disparity + edge_height;
    return at + seam * (float(covered_before) - float(covered_after));
}

// A ray march from the nearest disparity to the farthest. A step over a depth edge is no surface (accepting it stretches
// the foreground like a rubber sheet): the search goes on behind it, and where it ends there, the camera sees what the
// view does not.
Surface first_hit(Ray ray) {
    vec2 edge = place_at(ray, farthest);
    vec2 parallax = edge - place_at(ray, nearest);
    float parallax_px = length(parallax * view_size_px);
    vec2 seam = parallax * min(1.0, 2.0 / max(parallax_px, 1e-6));
    int steps = int(clamp(ceil(parallax_px), 2.0, MAX_SEARCH_STEPS));
    float stride = (nearest - farthest) / float(steps);  // disparity of one step
    for (int k = 0; k <= steps; k++) {
        float seen;
        // Search the first step at which the view's surface agrees with the disparity of the step.
        for (; k <= steps; k++) {
            float disparity = nearest - stride * float(k);
            vec2 at = place_at(ray, disparity);
            seen = disparity_at(at, ray.layer);
            // The surface lies farther than the step: still in empty space. Nearer by more: an edge was stepped over.
            if (seen - disparity < -0.5 * stride) edge = at;
            else if (seen - disparity <= 1.5 * stride || k == 0) break;
        }
        if (k > steps) break;
        // One step of the fixed point d = disparity(place_at(d)): sharper than the stride.
        float refined = disparity_at(place_at(ray, seen), ray.layer);
        if (refined < seen - 1.5 * stride) continue;  // beside the edge of a surface, not on it
        vec2 at = clear_of_seam(place_at(ray, refined), ray.layer, refined, 1.5 * stride, seam);
        return Surface(refined, at, false);
    }
    // Nothing found: the background beside the last edge.
    return Surface(disparity_at(edge - seam, ray.layer), edge - seam, true);
}

// The same for a view near the camera, a few pixels of parallax away: three steps of the fixed point, from the nearest
// disparity. Where they still move, the view does not see the surface.
Surface nearby_hit(Ray ray) {
    float disparity = disparity_at(place_at(ray, nearest), ray.layer);
    disparity = disparity_at(place_at(ray, disparity), ray.layer);
    vec2 at = place_at(ray, disparity);
    float last = disparity_at(at, ray.layer);
    vec2 moved_px = (place_at(ray, last) - at) * view_size_px;
    return Surface(last, at, dot(moved_px, moved_px) > 0.25);
}
