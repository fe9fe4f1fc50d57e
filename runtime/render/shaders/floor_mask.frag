// How much key light (r) and open sky (g) each point of the floor gets.
#include "frame.glsl"
uniform sampler2DShadow shadow_map;
uniform sampler2D height_map;
in vec2 place;
layout(location = 0) out vec4 mask;

const vec2 RING[8] = vec2[8](vec2(1, 0), vec2(0.707), vec2(0, 1), vec2(-0.707, 0.707),
                             vec2(-1, 0), vec2(-0.707), vec2(0, -1), vec2(0.707, -0.707));

void main() {
    vec3 at = vec3(floor_area.x + place.x / floor_area.z, 0.0,
                   floor_area.y + place.y / floor_area.w);
    vec3 in_light = (light * vec4(at, 1.0)).xyz;
    vec2 metre = floor_area.zw;
    float key_light = texture(shadow_map, in_light);
    float cover = 1.0 - texture(height_map, place).r;
    cover *= cover;
    for (int i = 0; i < 8; ++i) {
        key_light += texture(shadow_map, in_light + vec3(RING[i] * (1.6 / 1024.0), 0.0));
        float near = 1.0 - texture(height_map, place + RING[i] * metre * 0.035).r;
        float far = 1.0 - texture(height_map, place + RING[i].yx * metre * 0.10).r;
        cover += near * near + 0.8 * far * far;
    }
    mask = vec4(key_light / 9.0, 1.0 - cover / 15.4, 0.0, 1.0);
}
