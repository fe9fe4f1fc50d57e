// Darkens the backdrop's floor by shadow and contact, and adds the characters' reflections.
#include "frame.glsl"
#include "colour.glsl"
uniform sampler2D floor_mask;
uniform sampler2D reflection;
uniform float reach;
in vec2 place;
layout(location = 0) out vec4 add_and_keep;
void main() {
    vec2 mask = texture(floor_mask, place).rg;
    float keep = mix(0.16, 1.0, mask.r) * mix(0.06, 1.0, mask.g);
    vec2 at = gl_FragCoord.xy / picture.xy;
    vec2 step_up = vec2(0.0, 2.5) / picture.xy, step_right = vec2(1.6, 0.0) / picture.xy;
    vec3 seen = 0.25 * (texture(reflection, at + step_up + step_right).rgb
                      + texture(reflection, at + step_up - step_right).rgb
                      + texture(reflection, at - step_up + step_right).rgb
                      + texture(reflection, at - step_up - step_right).rgb);
    float past = max(max(place.y - 1.0, -place.y), 0.0) / floor_area.w;
    seen *= smoothstep(0.9 * reach, 0.1 * reach, past);
    add_and_keep = vec4(seen * 0.26, pow(keep, 1.0 / 2.2));
}
