// The reflection in the polished floor: plain shading that fades with height.
#include "frame.glsl"
#include "colour.glsl"
uniform vec4 tint;
in vec3 world;
in vec3 normal;
in vec4 colour;
layout(location = 0) out vec4 picture_colour;
void main() {
    vec3 n = normalize(normal);
    if (gl_FrontFacing != (eye.w > 0.0)) n = -n;
    float light_in = 0.16 + 0.75 * clamp(dot(n, key.xyz), 0.0, 1.0);
    float fade = exp(-2.2 * max(world.y, 0.0));
    picture_colour = vec4(encode(tone(colour.rgb * tint.rgb * light_in)), 1.0) * fade;
}
