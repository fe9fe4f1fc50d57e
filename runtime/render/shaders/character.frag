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

const vec3 KEY = vec3(1.0, 0.87, 0.70) * 2.35;
const vec3 RIM = vec3(0.50, 0.68, 1.0) * 1.5;
const vec3 SKY = vec3(0.20, 0.22, 0.32);
const vec3 BOUNCE = vec3(0.36, 0.22, 0.13);
const vec3 RIM_LEFT = vec3(-0.72, 0.36, -0.60);
const vec3 RIM_RIGHT = vec3(0.74, 0.30, -0.60);

float lit(vec3 n) {
    vec3 at = (light * vec4(world + n * shadow_texel, 1.0)).xyz;
    vec2 s = vec2(0.75 / 1024.0, 0.0);
    return 0.25 * (texture(shadow_map, at + s.xyy) + texture(shadow_map, at - s.xyy)
                 + texture(shadow_map, at + s.yxy) + texture(shadow_map, at - s.yxy));
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
    vec3 soft = clamp((facing + vec3(0.22, 0.10, 0.06)) / vec3(1.22, 1.10, 1.06), 0.0, 1.0);
    vec3 diffuse = KEY * soft * mix(vec3(0.06, 0.03, 0.04), vec3(1.0), shadow);

    float up = n.y * 0.5 + 0.5;
    float near_floor = clamp(world.y * 1.6, 0.0, 1.0);
    vec3 ambient = mix(BOUNCE * (1.25 - 0.55 * near_floor), SKY, up);
    ambient *= mix(0.35, 1.0, clamp(world.y * 5.0 + up * 0.5, 0.0, 1.0));

    float grazing = 1.0 - clamp(dot(n, to_eye), 0.0, 1.0);
    float edge = grazing * grazing * grazing;
    vec2 behind = clamp(vec2(dot(n, RIM_LEFT), dot(n, RIM_RIGHT)) + 0.1, 0.0, 1.0);
    vec3 rim = RIM * (behind.x * 0.8 + behind.y) * (0.14 + edge);

    float gloss = clamp(dot(n, normalize(key.xyz + to_eye)), 0.0, 1.0);
    gloss *= gloss; gloss *= gloss; gloss *= gloss; gloss *= gloss; gloss *= gloss;
    vec3 lacquer = KEY * gloss * 0.13 * shadow;

    vec3 light_out = base.rgb * (diffuse + ambient) + rim * (0.35 * base.rgb + 0.22) + lacquer;
    picture_colour = vec4(encode(tone(light_out)), base.a);
}
