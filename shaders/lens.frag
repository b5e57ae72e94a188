#version 330 core
// The picture of a pinhole camera, which up to four stored views answer, each warped by its own disparity. Views without
// disparity give the picture of an open lens, too: their mean, in linear light, sheared to the focus.
// WARP: some views have disparity. NEAR: all answering views are near their cameras. DOLLY: the rays of different pixels
// cross the grid at different places. SEEN: disparity in place of light.
#include "first_hit.glsl"
#include "gloss.glsl"

const int MAX_SAMPLES = 256;

layout(std140) uniform Samples {
    vec4 cameras[MAX_SAMPLES];  // xy: (s, t) from the eye, view steps; zw: where in its pixel a camera looks
    vec4 answers[MAX_SAMPLES];  // xy: (s, t) from the camera to the stored view; DOLLY: thresholds that choose a
                                // corner of the cell, or with z = 1 the corner itself
    vec4 numbers[MAX_SAMPLES];  // x: layer; y: 1 = has disparity; z: weight
};
uniform int sample_count;
uniform vec4 field_part;      // of the picture that the views show: left, top, width, height
uniform vec2 pixel_uv;        // size of a pixel, texture coordinates of the views
#ifdef DOLLY
uniform sampler2D nearest_views;  // by place in the grid: nearest view's (column, row); z: 1 = has disparity; w: layer
uniform vec2 eye_in_grid;         // (column, row), real
#endif

in vec2 uv;
out vec4 sum;

struct Answer {
    vec2 to_view;  // (s, t) from the camera to the stored view
    float layer;
    bool has_disparity;
    float weight;
};

// The view that answers camera i.
Answer answer_of(int i) {
#ifdef DOLLY
    // A corner of the cell that this pixel's ray crosses: by thresholds, or each corner with its bilinear weight.
    vec2 last = vec2(textureSize(nearest_views, 0) - 1), wanted = eye_in_grid + dolly * (mirrored(uv) - 0.5) + cameras[i].xy;
    vec2 inside = clamp(wanted, vec2(0.0), last), cell = min(floor(inside), max(last - 1.0, 0.0)), f = inside - cell;
    bool is_blend = answers[i].z > 0.5;
    vec2 corner = is_blend ? answers[i].xy : step(answers[i].xy, f), share = mix(1.0 - f, f, corner);
    vec4 view = texelFetch(nearest_views, ivec2(min(cell + corner, last)), 0);
    float weight = numbers[i].z * (is_blend ? max(share.x * share.y, 1e-6) : 1.0);
    return Answer(view.xy - wanted, view.w, view.z > 0.5, weight);
#else
    return Answer(answers[i].xy, numbers[i].x, numbers[i].y > 0.5, numbers[i].z);
#endif
}

// The surface that camera i sees. Each camera searches it at another place of the pixel, which makes edges smooth; the
// colour is read at the pixel's middle, which blurs nothing else.
Surface surface_seen(int i, Answer answer, float focus, vec2 place) {
    vec2 in_view = (place - field_part.xy) / field_part.zw;
    vec2 camera = cameras[i].xy * view_step / view_size_px, to_view = answer.to_view * view_step / view_size_px;
    Ray ray = Ray(in_view, camera, to_view, answer.layer, focus);
#ifdef WARP
    vec2 within = cameras[i].zw * pixel_uv;
    ray.uv += within;
#ifdef NEAR
    Surface found = nearby_hit(ray);
#else
    Surface found = first_hit(ray);
#endif
    found.at -= within;
    if (answer.has_disparity) return found;
    ray.uv = in_view;
#endif
    return Surface(focus, place_at(ray, focus), false);
}

void main() {
    // Around the picture lies its mirror image.
    vec2 place = mirrored(uv);
    float focus = focus_at(place);
    sum = vec4(0.0);
    // There is at least one camera: a loop that tests first costs software GL one more turn.
    int i = 0;
    do {
        Answer answer = answer_of(i);
        Surface seen = surface_seen(i, answer, focus, place);
#ifdef SEEN
        sum = vec4(seen.disparity);
#else
        vec4 light = light_at(seen.at, answer.layer);
#ifdef GLOSS
        vec2 ray = eye + dolly * (place - 0.5) + cameras[i].xy;
        light.rgb = glossy(light.rgb, seen.at, ray + answer.to_view, light.a, ray);
#endif
        // A view that does not see the surface counts only where no other does.
        float known = in_picture(seen.at) * (seen.is_hidden ? 1e-3 : 1.0);
        sum += answer.weight * known * vec4(light.rgb, 1.0);
#endif
    } while (++i < sample_count);
}
