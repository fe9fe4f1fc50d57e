// A lacquered rod or bead with a dark outline, or the glow around it; edges are analytic.
#include "colour.glsl"
uniform vec2 origin;          // lower left corner of the viewport [px]
flat in vec4 ends;
flat in vec2 radii;
flat in vec4 colour;
flat in float glow;
layout(location = 0) out vec4 premultiplied;

void main() {
    vec2 at = gl_FragCoord.xy - origin - ends.xy, axis = ends.zw - ends.xy;
    float along = clamp(dot(at, axis) / max(dot(axis, axis), 1e-6), 0.0, 1.0);
    vec2 off = at - along * axis;
    float radius = mix(radii.x, radii.y, along);
    float distance_out = length(off) - radius;
    if (glow > 0.0) {
        float t = clamp(1.0 - distance_out / (radius * glow), 0.0, 1.0);
        float strength = colour.a * t * t * t;
        premultiplied = vec4(encode(colour.rgb), 1.0) * strength;
        return;
    }
    float inside = clamp(0.5 - distance_out, 0.0, 1.0);
    if (inside <= 0.0) discard;
    vec2 side = off / max(radius, 1e-3);
    float facing = sqrt(max(1.0 - dot(side, side), 0.0));
    vec3 n = vec3(side, facing);
    float shine = pow(max(dot(n, vec3(-0.32, 0.52, 0.79)), 0.0), 24.0);
    vec3 body = colour.rgb * (0.30 + 0.85 * clamp(dot(n, vec3(-0.25, 0.45, 0.86)), 0.0, 1.0));
    body += vec3(0.55) * shine;
    float outline = min(1.5, 0.42 * radius);
    body *= mix(0.12, 1.0, smoothstep(0.3 - outline, -0.3 - outline, distance_out));
    premultiplied = vec4(encode(tone(body)), 1.0) * (inside * colour.a);
}
