// The key light (r) and ambient light (g) that each point of the floor receives.
#include "frame.glsl"
uniform sampler2DShadow shadow_map;
uniform sampler2D height_map;
in vec2 place;
layout(location = 0) out vec4 mask;

const vec2 RING[4] = vec2[4](vec2(0.94, 0.34), vec2(-0.34, 0.94),
                             vec2(-0.94, -0.34), vec2(0.34, -0.94));

void main() {
    vec3 at = vec3(floor_area.x + place.x / floor_area.z, 0.0,
                   floor_area.y + place.y / floor_area.w);
    vec3 in_light = (light * vec4(at, 1.0)).xyz;
    vec2 metre = floor_area.zw;
    float key_light = texture(shadow_map, in_light);
    float cover = 1.0 - texture(height_map, place).r;
    cover *= cover;
    for (int i = 0; i < 4; ++i) {
        key_light += texture(shadow_map, in_light + vec3(RING[i] * (1.8 / 1024.0), 0.0));
        float near = 1.0 - texture(height_map, place + RING[i] * metre * 0.035).r;
        float far = 1.0 - texture(height_map, place + RING[i].yx * metre * 0.09).r;
        cover += near * near + far * far;
    }
    mask = vec4(key_light / 5.0, 1.0 - cover / 9.0, 0.0, 1.0);
}
