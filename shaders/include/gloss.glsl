// A glossy surface under a far, round light, as in iibr_core/gloss/shading.py and microfacet.py. Needs view_size_px,
// view_step, farthest and nearest, as in field.glsl.
#ifdef GLOSS
uniform sampler2D gloss_surface;    // of the photo: normal's x and y, share of the surface, disparity (px per view step)
uniform float gloss_focal;          // px
uniform float gloss_infinity;       // disparity of infinitely far points
uniform float gloss_min_nearness;   // lower limit of the disparity above that
uniform vec2 eye;                   // its offset (s, t), view steps; of an EPI the first view's
uniform vec3 gloss_light;           // towards it
uniform vec3 gloss_radiance;
uniform vec3 gloss_lobe;            // squared width, squared sine of the light's radius, reflectance

// The share of the light's radiance that is seen: GGX, Smith's shadowing, Schlick's Fresnel.
float lobe_share(vec3 normal, vec3 to_eye) {
    float n_l = dot(normal, gloss_light), n_v = dot(normal, to_eye), width2 = gloss_lobe.x;
    if (n_l <= 0.0 || n_v <= 0.0) return 0.0;
    vec3 half_way = normalize(to_eye + gloss_light), beside = cross(normal, half_way);
    float n_h = dot(normal, half_way), spread = width2 * n_h * n_h + dot(beside, beside);
    float masking = n_l * sqrt(n_v * n_v * (1.0 - width2) + width2) + n_v * sqrt(n_l * n_l * (1.0 - width2) + width2);
    float seen = min(gloss_lobe.y * width2 / (spread * spread) * 0.5 / masking * n_l, 1.0);
    return mix(pow(1.0 - clamp(dot(to_eye, half_way), 0.0, 1.0), 5.0), 1.0, gloss_lobe.z) * seen;
}

// Light of what is seen at `at` in the stored view at offset `view`, as an eye on the ray through the grid at `ray` sees
// it. depth: 0..1 from farthest to nearest.
vec3 glossy(vec3 light, vec2 at, vec2 view, float depth, vec2 ray) {
    view *= view_step;
    ray *= view_step;
    float disparity = mix(farthest, nearest, depth);
    vec2 place = at + disparity * view / view_size_px;
    vec4 surface = textureLod(gloss_surface, place, 0.0);
    bool is_outside = any(greaterThan(abs(place - 0.5), vec2(0.5)));
    bool is_other = abs(surface.w - disparity) * length(view) > 1.0;  // the photo shows another surface there
    if (surface.z <= 0.0 || is_outside || is_other) return light;
    vec3 normal = vec3(surface.xy, -sqrt(max(1.0 - dot(surface.xy, surface.xy), 0.0)));
    float nearness = max(disparity - gloss_infinity, gloss_min_nearness);
    vec3 to_eye = normalize(vec3(ray - (place - 0.5) * view_size_px / nearness, -gloss_focal / nearness));
    return mix(light, gloss_radiance, surface.z * lobe_share(normal, to_eye));
}
#endif
