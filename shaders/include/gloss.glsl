// A glossy surface under a far, round light: iibr_core/rendering/gloss, for whatever view is drawn. Needs view_size_px,
// farthest and nearest, as in field.glsl.
#ifdef GLOSS
const float PI = 3.14159265359;

uniform sampler2D gloss_surface;      // of the photo: normal's x and y, share of the surface, disparity (px per view step)
uniform float gloss_focal;            // px
uniform float gloss_infinity;         // disparity of what is infinitely far
uniform float gloss_least_nearness;   // disparity above that counts as at least so much
uniform vec2 eye;                     // its offset (s, t), view steps; of an EPI the first view's
uniform vec3 gloss_light;             // towards it
uniform vec3 gloss_radiance;
uniform vec3 gloss_lobe;              // squared width, squared sine of the light's radius, reflectance
uniform bool gloss_has_surroundings;
uniform sampler2D gloss_surroundings; // equirectangular, smoothed by the lobe
uniform bool gloss_has_reflected;
uniform sampler2D gloss_reflected;    // of the photo: linear light that it shows reflected
uniform bool gloss_has_virtual;       // what is reflected is seen elsewhere from elsewhere
uniform sampler2D gloss_virtual;      // its virtual disparity, two by two

bool is_in_photo(vec2 at) {
    return all(lessThanEqual(abs(at - 0.5), vec2(0.5)));
}

float schlick(float cosine) {
    return gloss_lobe.z + (1.0 - gloss_lobe.z) * pow(1.0 - clamp(cosine, 0.0, 1.0), 5.0);
}

// The share of the light's radiance that is seen: GGX, Smith's shadowing (see microfacet.py).
float lobe_share(vec3 normal, vec3 to_eye) {
    float n_l = dot(normal, gloss_light), n_v = dot(normal, to_eye), width2 = gloss_lobe.x;
    if (n_l <= 0.0 || n_v <= 0.0) return 0.0;
    vec3 half_way = normalize(to_eye + gloss_light), beside = cross(normal, half_way);
    float n_h = dot(normal, half_way), spread = width2 * n_h * n_h + dot(beside, beside);
    float masking = n_l * sqrt(n_v * n_v * (1.0 - width2) + width2) + n_v * sqrt(n_l * n_l * (1.0 - width2) + width2);
    return schlick(dot(to_eye, half_way)) * min(gloss_lobe.y * width2 / (spread * spread) * 0.5 / masking * n_l, 1.0);
}

// Light of what is seen at `at` in the stored view at offset `view`, as an eye on the ray through the grid at `ray` sees
// it. depth: 0..1 from farthest to nearest.
vec3 glossy(vec3 light, vec2 at, vec2 view, float depth, vec2 ray) {
    float disparity = mix(farthest, nearest, depth);
    vec2 place = at + disparity * view / view_size_px;
    vec4 surface = textureLod(gloss_surface, place, 0.0);
    // Another surface is seen there, or nothing.
    float apart = abs(surface.w - disparity) * length(view);
    if (surface.z <= 0.0 || apart > 1.0 || !is_in_photo(place)) return light;
    vec3 normal = vec3(surface.xy, -sqrt(max(1.0 - dot(surface.xy, surface.xy), 0.0)));
    float nearness = max(disparity - gloss_infinity, gloss_least_nearness);
    vec3 to_eye = normalize(vec3(ray - (place - 0.5) * view_size_px / nearness, -gloss_focal / nearness));
    if (gloss_has_reflected) light = max(light - textureLod(gloss_reflected, place, 0.0).rgb, 0.0);
    if (gloss_has_virtual) {
        // The place in the photo whose reflection is seen here now: a fixed point.
        vec2 seen = at + disparity * (view - ray) / view_size_px, from = place;
        for (int k = 0; k < 4; k++) {
            vec4 virtual_disparity = textureLod(gloss_virtual, from, 0.0);
            from = seen + vec2(dot(virtual_disparity.xy, ray), dot(virtual_disparity.zw, ray)) / view_size_px;
        }
        if (is_in_photo(from)) light += textureLod(gloss_reflected, from, 0.0).rgb;
    }
    float n_v = dot(normal, to_eye);
    if (gloss_has_surroundings && n_v > 0.0) {
        vec3 around = 2.0 * n_v * normal - to_eye;
        vec2 direction = vec2(atan(around.x, around.z) / (2.0 * PI) + 0.5, acos(clamp(-around.y, -1.0, 1.0)) / PI);
        light = mix(light, textureLod(gloss_surroundings, direction, 0.0).rgb, surface.z * schlick(n_v));
    }
    return mix(light, gloss_radiance, surface.z * lobe_share(normal, to_eye));
}
#endif
