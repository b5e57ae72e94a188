#version 330 core
// The view from any point: stored views near the eye, each warped by its own disparity, front-most surface first.
// With one stored view (a photo and its disparity) this is the instant preview.
#include "front_most.glsl"
#include "layers.glsl"

const int MAX_SOURCES = 4;

uniform int source_count;
uniform vec4 sources[MAX_SOURCES];      // xy: (s, t) from the eye to the view, view steps; z: layer; w: weight
uniform int search_steps[MAX_SOURCES];  // 0: this view has no disparity and counts as flat at the focus plane
uniform vec2 within_pixel;              // from its middle, texture coordinates
#ifdef DOLLY
uniform vec4 cell;                         // part of the picture that is drawn: left, top, right, bottom
uniform vec4 corner_weights[MAX_SOURCES];  // left top, right top, left bottom, right bottom
#endif
uniform float share;                    // of this pass in the picture; the rest comes from the aperture pass

in vec2 uv;

// Texture coordinates per px of disparity, from the pixel's eye to the view.
vec2 delta_to(int i) {
    return (sources[i].xy - dolly * (uv - 0.5)) / view_size_px;
}

float weight_of(int i) {
#ifdef DOLLY
    vec2 place = (uv - cell.xy) / (cell.zw - cell.xy);
    vec2 column = mix(corner_weights[i].xz, corner_weights[i].yw, place.x);
    return clamp(mix(column.x, column.y, place.y), 1e-6, 1.0);
#else
    return sources[i].w;
#endif
}

// Which surface shows is asked somewhere in the pixel, elsewhere in each round, so that edges become smooth; its colour
// is that of the pixel's middle, so that nothing else is blurred.
Surface surface_in(int i) {
    float focus = focus_at(uv);
    vec2 delta = delta_to(i);
    if (search_steps[i] == 0) return Surface(focus, uv - focus * delta, false);
    Surface found = front_most(uv + within_pixel, sources[i].z, delta, search_steps[i]);
    found.at -= within_pixel;
    return found;
}

void main() {
    Surface surfaces[MAX_SOURCES];
    for (int i = 0; i < source_count; i++) surfaces[i] = surface_in(i);

    // A surface in front hides those behind it, the more the nearer its view is to the eye: nothing pops as it moves.
    float tolerance = 0.04 * (nearest - farthest) + 0.05;
    vec4 sum = vec4(0.0);
    float total = 0.0;
    for (int i = 0; i < source_count; i++) {
        float own = weight_of(i), weight = own;
        for (int j = 0; j < source_count; j++) {
            float in_front_by = surfaces[j].is_hidden ? 0.0 : surfaces[j].disparity - surfaces[i].disparity;
            float hides = clamp(in_front_by / tolerance - 1.0, 0.0, 1.0);
            weight *= 1.0 - hides * min(weight_of(j) / own, 1.0);
        }
        if (surfaces[i].is_hidden) weight *= 1e-3;
        weight *= in_picture(surfaces[i].at);
        weight = max(weight, 1e-8 * own);
        vec4 light = linear_from_stored(textureLod(colors, vec3(surfaces[i].at, sources[i].z), 0.0));
        sum += weight * light;
        total += weight;
    }
    vec4 light = vec4(sum.rgb / total, 1.0) * share;
#if defined(SHARP) || defined(BLURRED)
    vec2 line = blur_from_depth(focus_at(uv));
    float blur = blur_beyond_range(sum.a / total * line.x + line.y);
    float sharp = sharpness(blur);
#endif
#ifdef BLURRED
    in_front = (blur > 0.0 ? 1.0 - sharp : 0.0) * light;
    behind = (1.0 - sharp) * light - in_front;
    weights = vec4(share, in_front.a, 0.0, 0.0);
#elif defined(SHARP)
    in_focus = sharp * light;
#else
    in_focus = light;
#endif
}
