#version 330 core
// Light through the aperture: the weighted sum over its samples, each sheared to the focus plane.
// REPROJECT: other views stand in for those wanted. TILES: where all is sharp few samples suffice, and a tile that has
// its passes gets no more.
#include "samples.glsl"
#include "layers.glsl"
#include "gloss.glsl"

uniform float share;     // of this pass in the picture; the rest comes from the pinhole pass
#ifdef TILES
uniform sampler2D tiles;       // see defocus_tiles.frag
uniform sampler2D wide_tiles;  // see widen_tiles.frag
uniform float passes;          // that are drawn before this one
uniform int sparse_count;   // the first samples that suffice where all is sharp
uniform float sparse_up_to_px;
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

// Light of sample i, with its gloss if there is any.
vec4 light_at(int i, vec3 place) {
    vec4 light = linear_from_stored(textureLod(colors, place, 0.0));
#ifdef GLOSS
    vec2 ray = eye + dolly * (uv - 0.5) + samples[i].xy, view = ray;
#ifdef REPROJECT
    view += fallback_view_of(i, uv).reprojection;
#endif
    light.rgb = glossy(light.rgb, place.xy, view, light.a, ray);
#endif
    return light;
}

void main() {
    float focus = focus_at(uv);
    int count = sample_count;
    bool is_sparse = false;
#ifdef TILES
    // All sharp: the first few samples suffice, with weights of their own.
    ivec2 tile = ivec2(target_uv * vec2(textureSize(tiles, 0)));
    vec2 widest = texelFetch(tiles, tile, 0).xy;
    is_sparse = max(widest.x, widest.y) < sparse_up_to_px;
    if (is_sparse) count = sparse_count;
    if (passes >= texelFetch(wide_tiles, tile, 0).z) count = 0;
#endif
    vec4 all = vec4(0.0), sharp = vec4(0.0), front = vec4(0.0);
#ifdef LAYERS
    vec2 line = blur_from_depth(focus);
#endif
    for (int i = 0; i < count; i++) {
        float weight = is_sparse ? reprojections[i].w : samples[i].w;
        vec3 place = place_of(i, focus, weight);
        // Backward warp: the sample's light from its view, in linear light.
        vec4 light = light_at(i, place);
        vec4 weighted = weight * vec4(light.rgb, 1.0);
        all += weighted;
#ifdef LAYERS
        float blur = blur_beyond_range(light.a * line.x + line.y), share_in_focus = sharpness(blur);
        sharp += share_in_focus * weighted;
        front += (blur > 0.0 ? 1.0 - share_in_focus : 0.0) * weighted;
#endif
    }
#ifdef LAYERS
    in_focus = share * sharp;
    in_front = share * front;
    behind = share * max(all - sharp - front, 0.0);
#else
    in_focus = share * all;
#endif
}
