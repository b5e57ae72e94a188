#version 330 core
// The view from any point: stored views near the eye, each warped by its own disparity, front-most surface first.
// With one stored view (a photo and its disparity) this is the instant preview.
// FLAT: only tiles where all sources see one surface without edges. EDGES: only the others, and there only those steps of
// the search that can find something.
#include "sources.glsl"
#include "first_hit.glsl"
#include "layers.glsl"
#include "gloss.glsl"

uniform vec2 within_pixel;  // from its middle, texture coordinates
#if defined(FLAT) || defined(EDGES)
flat in ivec2 tile;
uniform sampler2D intervals_of_0_and_1, intervals_of_2_and_3;  // see march_intervals.frag
#endif
#ifdef DOLLY
uniform vec4 cell;                         // part of the picture that is drawn: left, top, right, bottom
uniform vec4 corner_weights[MAX_SOURCES];  // left top, right top, left bottom, right bottom
#endif
uniform float share;        // of this pass in the picture; the rest comes from the aperture pass

in vec2 uv;

float weight_of(int i) {
#ifdef DOLLY
    // Bilinear between the corners of the cell.
    vec2 place = (uv - cell.xy) / (cell.zw - cell.xy);
    vec2 column = mix(corner_weights[i].xz, corner_weights[i].yw, place.x);
    return clamp(mix(column.x, column.y, place.y), 1e-6, 1.0);
#else
    return sources[i].w;
#endif
}

// First and last step of the search in a source; FLAT: about where the surface is, and -1.
vec2 interval_of(int i) {
#if defined(FLAT) || defined(EDGES)
    vec4 spans = i < 2 ? texelFetch(intervals_of_0_and_1, tile, 0) : texelFetch(intervals_of_2_and_3, tile, 0);
    return i % 2 == 0 ? spans.xy : spans.zw;
#else
    return vec2(0.0, search_steps[i]);
#endif
}

// Which surface shows is asked somewhere in the pixel, elsewhere in each pass, so that edges become smooth; its colour
// is that of the pixel's middle, so that nothing else is blurred.
Surface surface_in(int i) {
    vec2 delta = delta_to(i, uv);
#ifdef FLAT
    // No edges: two steps of the fixed point, from about where the surface is.
    float seen = disparity_at(uv - delta * interval_of(i).x, sources[i].z);
    vec2 at = uv - delta * disparity_at(uv - delta * seen, sources[i].z);
    return Surface(seen, at, in_picture(at) < 1.0);
#else
    float focus = focus_at(uv);
    if (search_steps[i] == 0) return Surface(focus, uv - focus * delta, false);
    Surface found = first_hit(uv + within_pixel, sources[i].z, delta, search_steps[i], ivec2(interval_of(i) + 0.5));
    found.at -= within_pixel;
    return found;
#endif
}

// A surface in front hides those behind it, the more the nearer its view is to the eye: nothing pops as it moves.
float share_left(Surface surfaces[MAX_SOURCES], int i) {
    float own = weight_of(i), weight = own;
    for (int j = 0; j < source_count; j++) {
        float in_front_by = surfaces[j].is_hidden ? 0.0 : surfaces[j].disparity - surfaces[i].disparity;
        // A soft z-test; a view hides the less, the less it weighs.
        float hides = clamp(in_front_by / hiding_tolerance() - 1.0, 0.0, 1.0);
        weight *= 1.0 - hides * min(weight_of(j) / own, 1.0);
    }
    // What a view does not see itself, or only beyond its border, counts where no other knows better.
    if (surfaces[i].is_hidden) weight *= 1e-3;
    return max(weight * in_picture(surfaces[i].at), 1e-8 * own);
}

void main() {
    Surface surfaces[MAX_SOURCES];
    // Each view's surface, then their blend in linear light.
    for (int i = 0; i < source_count; i++) surfaces[i] = surface_in(i);
    vec4 sum = vec4(0.0);
    float total = 0.0;
    for (int i = 0; i < source_count; i++) {
        float weight = share_left(surfaces, i);
        sum += weight * linear_from_stored(textureLod(colors, vec3(mirrored(surfaces[i].at), sources[i].z), 0.0));
        total += weight;
    }
    sum /= total;
#ifdef GLOSS
    vec2 ray = eye + dolly * (uv - 0.5);
    sum.rgb = glossy(sum.rgb, uv, ray, sum.a, ray);
#endif
    vec4 light = vec4(sum.rgb, 1.0) * share;
    in_focus = light;
#ifdef LAYERS
    // Its defocus decides which layer the light goes to.
    vec2 line = blur_from_depth(focus_at(uv));
    float blur = blur_beyond_range(sum.a * line.x + line.y);
    float sharp = sharpness(blur);
    in_focus = sharp * light;
    in_front = (blur > 0.0 ? 1.0 - sharp : 0.0) * light;
    behind = (1.0 - sharp) * light - in_front;
#endif
}
