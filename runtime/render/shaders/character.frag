// Painted wood under stage light: warm key with shadow, two cool rims, floor bounce, lacquer.
#include "frame.glsl"
#include "colour.glsl"
uniform sampler2DShadow shadow_map;
uniform float shadow_texel;
uniform vec4 tint;
in vec3 world;
in vec3 normal;
in vec4 colour;
#ifdef TEXTURED
uniform sampler2D image;
in vec2 uv;
#endif
layout(location = 0) out vec4 picture_colour;

const vec3 KEY = vec3(1.0, 0.88, 0.72) * 1.42;
const vec3 RIM = vec3(0.36, 0.60, 1.0) * 2.3;
const vec3 SKY = vec3(0.090, 0.100, 0.160);
const vec3 BOUNCE = vec3(0.150, 0.085, 0.045);
const vec3 RIM_LEFT = vec3(-0.72, 0.36, -0.60);
const vec3 RIM_RIGHT = vec3(0.74, 0.30, -0.60);

float lit(vec3 n) {
    vec3 at = (light * vec4(world + n * shadow_texel, 1.0)).xyz;
    vec3 s = vec3(0.6, 0.6, 0.0) / 1024.0;
    return 0.5 * (texture(shadow_map, at + s) + texture(shadow_map, at - s));
}

void main() {
    vec4 base = colour * tint;
#ifdef TEXTURED
    base *= texture(image, uv);
#endif
    vec3 to_eye = normalize(eye.xyz - world);
    vec3 n = normalize(normal);
    if (gl_FrontFacing != (eye.w > 0.0)) n = -n;

    // The terminator is soft and warm, as light that has gone a little way into the paint.
    float facing = dot(n, key.xyz);
    float shadow = facing > -0.25 ? lit(n) : 0.0;
    vec3 soft = clamp((facing + vec3(0.16, 0.06, 0.03)) / vec3(1.16, 1.06, 1.03), 0.0, 1.0);
    vec3 diffuse = KEY * soft * mix(vec3(0.05, 0.03, 0.05), vec3(1.0), shadow);

    float up = n.y * 0.5 + 0.5;
    float near_floor = clamp(world.y * 1.6, 0.0, 1.0);
    vec3 ambient = mix(BOUNCE * (1.25 - 0.55 * near_floor), SKY, up);
    ambient *= mix(0.35, 1.0, clamp(world.y * 5.0 + up * 0.5, 0.0, 1.0));

    float grazing = 1.0 - clamp(dot(n, to_eye), 0.0, 1.0);
    float edge = grazing * grazing;
    vec2 behind = clamp(vec2(dot(n, RIM_LEFT), dot(n, RIM_RIGHT)) + 0.22, 0.0, 1.0);
    vec3 rim = RIM * (behind.x * 0.6 + behind.y) * (0.12 + 1.15 * edge);

    float gloss = clamp(dot(n, normalize(key.xyz + to_eye)), 0.0, 1.0);
    gloss *= gloss; gloss *= gloss; gloss *= gloss; gloss *= gloss; gloss *= gloss;
    vec3 lacquer = KEY * gloss * 0.26 * shadow;

    vec3 light_out = base.rgb * (diffuse + ambient) + rim * (0.45 * base.rgb + 0.17) + lacquer;
    picture_colour = vec4(encode(tone(light_out)), base.a);
}
