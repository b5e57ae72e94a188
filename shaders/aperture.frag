#version 330 core
// Light through the aperture: the weighted sum over its samples, each sheared to the focus plane.
// REPROJECT: other views stand in for those wanted. TILES: tiles without a layer's content skip it, and where all is
// sharp few samples suffice.
#include "samples.glsl"
#include "layers.glsl"

uniform float share;     // of this pass in the picture; the rest comes from the pinhole pass
#ifdef TILES
uniform sampler2D tiles; // see defocus_tiles.frag
#ifndef BLURRED
uniform int sparse_count;   // the first samples that suffice where all is sharp
uniform float sparse_up_to_px;
#endif
#endif

in vec2 uv, target_uv;

// Where sample i reads (xy) in which layer (z), and its weight, next to nothing where it knows nothing.
vec3 place_of(int i, float focus, inout float weight) {
    vec4 wanted = samples[i];
    vec3 place = vec3(uv - focus * wanted.xy / view_size_px, wanted.z);
#ifdef REPROJECT
    FallbackView fallback = fallback_view_of(i, uv);
    vec3 found = reprojected_place(uv, wanted.xy, fallback, focus);
    place = vec3(found.xy, fallback.layer);
    weight *= found.z;
#endif
    weight *= in_picture(place.xy) * barrel_share(wanted.xy, uv);
#ifdef REPROJECT
    place.xy = mirrored(place.xy);
#endif
    return place;
}

#ifdef BLURRED
void main() {
    float focus = focus_at(uv);
    vec2 line = blur_from_depth(focus);
    vec4 front = vec4(0.0), back = vec4(0.0);
    float all = 0.0;
    // Tiles without defocused light add to the weights only.
    bool is_empty = false;
#ifdef TILES
    vec2 widest = texelFetch(tiles, ivec2(target_uv * vec2(textureSize(tiles, 0))), 0).xy;
    is_empty = max(widest.x, widest.y) <= sharp_up_to_px.x;
#endif
    for (int i = 0; i < (is_empty ? sample_count : 0); i++) {
        float weight = samples[i].w;
        place_of(i, focus, weight);
        all += weight;
    }
    for (int i = 0; i < (is_empty ? 0 : sample_count); i++) {
        float weight = samples[i].w;
        vec3 place = place_of(i, focus, weight);
        all += weight;
        vec4 light = linear_from_stored(textureLod(colors, place, 0.0));
        float blur = blur_beyond_range(light.a * line.x + line.y);
        // Alpha-weighted light, less the share of the sharp layer, on its side of the focus plane.
        vec4 weighted = vec4(light.rgb, 1.0) * (weight - weight * sharpness(blur));
        front += blur > 0.0 ? weighted : vec4(0.0);
        back += blur > 0.0 ? vec4(0.0) : weighted;
    }
    in_front = share * front;
    behind = share * back;
    weights = vec4(all, front.a, 0.0, 0.0) * share;
}
#else
void main() {
    float focus = focus_at(uv);
    int count = sample_count;
#ifdef TILES
    vec3 tile = texelFetch(tiles, ivec2(target_uv * vec2(textureSize(tiles, 0))), 0).xyz;
    // All sharp: the first few samples suffice, with weights of their own. All defocused: nothing to gather.
    bool is_sparse = max(tile.x, tile.y) < sparse_up_to_px;
    if (is_sparse) count = sparse_count;
    if (tile.z >= sharp_up_to_px.y) count = 0;
#endif
#ifdef SHARP
    vec2 line = blur_from_depth(focus);
#endif
    vec4 sum = vec4(0.0);
    for (int i = 0; i < count; i++) {
        float weight = samples[i].w;
#ifdef TILES
        if (is_sparse) weight = reprojections[i].w;
#endif
        vec3 place = place_of(i, focus, weight);
        // Backward warp: the sample's light from its view, in linear light.
        vec4 light = linear_from_stored(textureLod(colors, place, 0.0));
#ifdef SHARP
        weight *= sharpness(blur_beyond_range(light.a * line.x + line.y));
#endif
        sum += weight * vec4(light.rgb, 1.0);
    }
    in_focus = share * sum;
}
#endif
